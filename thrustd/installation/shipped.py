"""Files that come with thrustd, wherever it runs: of the checkout, or of the installed wheel."""

import sys
from pathlib import Path

import thrustd
from thrustd.core.errors import UsageError


def shipped(name: str, option: str) -> Path:
    """`name` relative to the checkout; UsageError that asks for `option` where it is not."""
    places = Path(thrustd.__file__).parents[1], Path(sys.prefix) / "share" / "thrustd"
    for place in places:
        if (place / name).is_file():
            return place / name
    raise UsageError(f"{option}: expected a file; the shipped {name} is neither in {places[0]} nor in {places[1]}")
