"""Columns of foreign files under the names of the catalogue: `THEIRS=OURS`, with a factor and an offset where needed.

    Load [kN]=force_N*1000        T [K]=temperature_degC-273.15        t_ms=time_s*0.001

A name that says another unit than the channel's is refused, unless factor or offset are given.
"""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import NamedTuple

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.signals import CATALOGUE
from thrustd.records.recording import SUFFIX_UNITS, no_column, signal_of, unit_of

SYNONYMS = {"°C": "degC", "C": "degC", "deg C": "degC", "sec": "s", "m/s^2": "m/s2", "m/s²": "m/s2"}
UNITS = {*SUFFIX_UNITS.values(), "ms", "us", "min", "h", "K", "kPa", "hPa", "mbar", "ft", "kt", "lbf", "rpm", "um"}
_NUMBER = r"\d+\.?\d*(?:[eE][-+]?\d+)?"
_OURS = re.compile(rf"([A-Za-z]\w*)(?:\s*\*\s*([-+]?{_NUMBER}))?\s*([-+]{_NUMBER})?")
_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]\s*$")


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


def _remark(ours: str) -> str:
    if ours == "time_s" or signal_of(ours):
        return ""
    near = get_close_matches(ours, ("time_s", *CATALOGUE), 1)
    return f"{ours}: no channel of the catalogue, kept{f'; meant was {near[0]}?' if near else ''}"


def check_unit(theirs: str, ours: str) -> None:
    """UsageError when the name of a foreign column says another unit than the channel's."""
    said, own = _unit(theirs), unit_of(ours)
    if said and own and said != own:
        raise UsageError(
            f"{theirs}: its name says {said}, {ours} is in {own}; expected --rename '{theirs}={ours}*FACTOR' "
            "(or +OFFSET, or both)"
        )


def _unit(theirs: str) -> str:
    """As far as the name says one: `force_kN`, `Load [kN]`; in round brackets or after _ only what is known."""
    said = unit_in_brackets(theirs) or theirs.strip().rpartition("_")[2]
    known = SUFFIX_UNITS.get(said) or SYNONYMS.get(said) or (said if said in UNITS else "")
    return known or (said if theirs.rstrip().endswith("]") else unit_of(theirs.strip()))


def unit_in_brackets(name: str) -> str:
    """`bar` of `pressure [bar]` or `pressure (bar)`, known or not."""
    found = _BRACKETS.search(name)
    return found.group(1).strip() if found else ""
