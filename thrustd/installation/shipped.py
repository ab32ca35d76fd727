"""Files that come with thrustd, wherever it runs: of the checkout, or of the installed wheel."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import thrustd
from thrustd.core.errors import UsageError
from thrustd.sources.plain_file import read_text

if TYPE_CHECKING:
    from thrustd.brochure.deck import Deck
    from thrustd.core.aircraft import AircraftData

AIRCRAFT, CONFIGURATION, HIL = "deploy/citation-ii.toml", "deploy/ph-lab.toml", "deploy/hil.toml"
DECK = "models/brochure/jt15d-4.json"
MODELS = tuple(f"models/{side}-{place}.json" for side in ("left", "right") for place in ("upper", "lower"))


def shipped(name: str, option: str) -> Path:
    """`name` relative to the checkout; UsageError that asks for `option` where it is not."""
    places = Path(thrustd.__file__).parents[1], Path(sys.prefix) / "share" / "thrustd"
    for place in places:
        if (place / name).is_file():
            return place / name
    raise UsageError(f"{option}: expected a file; the shipped {name} is neither in {places[0]} nor in {places[1]}")


def given_or_shipped(given: Path | None, default: str, option: str) -> Path:
    """A file of one's own; else the shipped one: `default`, or by its name in a checkout, from any folder."""
    return shipped(default, option) if given is None else own_or_shipped(given, option)


def own_or_shipped(given: Path, option: str) -> Path:
    """A file of one's own; else, by its name in a checkout, the one that comes with thrustd."""
    known = not given.exists() and str(given) in (AIRCRAFT, CONFIGURATION, HIL, DECK, *MODELS)
    return shipped(str(given), option) if known else given


def aircraft_data(path: Path | None = None) -> "AircraftData":
    """What is known of a type of aircraft, None: of the shipped one; ConfigError, one line, otherwise."""
    from thrustd.core.aircraft import read_aircraft

    path = given_or_shipped(path, AIRCRAFT, "--aircraft")
    return read_aircraft(read_text(path), str(path))


def read_deck(path: Path | None = None) -> "Deck":
    """A brochure deck, None: the shipped one; one line that says why not otherwise."""
    from thrustd.brochure.deck import Deck  # numba: not every verb needs it

    path = given_or_shipped(path, DECK, "--deck")
    return Deck.from_json(read_text(path), str(path))
