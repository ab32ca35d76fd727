"""Columns of foreign files under the names of the catalogue: `THEIRS=OURS`, with a factor and an offset where needed.

    Load [kN]=force_N*1000        T [K]=temperature_degC-273.15        t_ms=time_s*0.001

A name that says another unit than the channel's is refused, unless factor or offset are given.
"""

import re
import shlex
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import NamedTuple

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.signals import CATALOGUE
from thrustd.records.recording import no_column, signal_of, unit_of
from thrustd.records.units import CONVERSIONS, UNITS, unit_said

UNITS_KEY, AS_NAMED = "units", "as named"  # of a recording's metadata: of all its columns; with a name, of this one
_NUMBER = r"\d+\.?\d*(?:[eE][-+]?\d+)?"
_OURS = re.compile(rf"([A-Za-z]\w*)(?:\s*\*\s*([-+]?{_NUMBER}))?\s*([-+]{_NUMBER})?")


class Rename(NamedTuple):
    """ours = theirs * factor + offset."""

    theirs: str
    ours: str
    factor: float = 1.0
    offset: float = 0.0


def read_rename(text: str) -> Rename:
    """THEIRS=OURS[*FACTOR][+OFFSET]; THEIRS may hold anything."""
    theirs, _, said = text.rpartition("=")
    found = _OURS.fullmatch(said.strip())
    if not theirs or found is None:
        raise UsageError(f"--rename {text}: expected THEIRS=OURS, THEIRS=OURS*FACTOR or THEIRS=OURS*FACTOR+OFFSET")
    ours, factor, offset = found.groups()
    if factor is None and offset is None:
        check_unit(theirs.strip(), ours)
    return Rename(theirs.strip(), ours, float(factor or 1.0), float(offset or 0.0))


def renamed(name: str, columns: Mapping[str, Floats], renames: Sequence[Rename]) -> tuple[dict[str, Floats], list[str]]:
    """The columns under their new names, and remarks; RecordingError when one is not there or a name is taken."""
    changed = dict(columns)
    for rename in renames:
        if rename.theirs not in changed:
            raise RecordingError(no_column(name, rename.theirs, changed))
        column = changed.pop(rename.theirs)
        if rename.ours in changed:
            raise RecordingError(f"{name}: {rename.theirs!r} cannot become {rename.ours!r}, which it has already")
        plain = (rename.factor, rename.offset) == (1.0, 0.0)
        changed[rename.ours] = column if plain else column * rename.factor + rename.offset
    return changed, [remark for rename in renames if (remark := _remark(rename.ours))]


def units_said(renames: Sequence[Rename]) -> dict[str, str]:
    """Metadata of a recording whose columns were converted: nothing guesses at their units again."""
    return {f"{UNITS_KEY} {each.ours}": AS_NAMED for each in renames if (each.factor, each.offset) != (1.0, 0.0)}


def _remark(ours: str) -> str:
    if ours == "time_s" or signal_of(ours):
        return ""
    near = get_close_matches(ours, ("time_s", *CATALOGUE), 1)
    return f"{ours}: no channel of the catalogue, kept{f'; did you mean {near[0]}?' if near else ''}"


def check_unit(theirs: str, ours: str) -> None:
    """UsageError when a foreign column's name says another unit than the channel's: [ell] is one, (left) is none."""
    said, own = unit_said(theirs), unit_of(ours)
    meant = said in UNITS or theirs.rstrip().endswith("]")
    if said and own and said != own and meant:
        known = CONVERSIONS.get(own, {}).get(said)
        expected = spelled(theirs, ours, *known) if known else f"{theirs}={ours}*FACTOR"
        raise UsageError(
            f"{theirs}: its name says {said}, {ours} is in {own}; expected --rename {shlex.quote(expected)}"
            + ("" if known else " (or +OFFSET, or both)")
        )


def spelled(theirs: str, ours: str, factor: float = 1.0, offset: float = 0.0) -> str:
    """ours = theirs * factor + offset, as `--rename` and `td.read` take it."""
    scale = "" if factor == 1.0 and not offset else f"*{factor!r}"
    return f"{theirs}={ours}{scale}{f'{offset:+}' if offset else ''}"
