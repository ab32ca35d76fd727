"""Units as the names of columns say them, and what they are in the catalogue's."""

import re
from math import log

from thrustd.records.recording import SUFFIX_UNITS, unit_of

_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]\s*$")
# our unit -> unit of theirs: (factor, offset)
CONVERSIONS: dict[str, dict[str, tuple[float, float]]] = {
    "s": {"s": (1, 0), "ms": (1e-3, 0), "us": (1e-6, 0), "ns": (1e-9, 0), "min": (60, 0), "h": (3600, 0)},
    "N": {"N": (1, 0), "kN": (1e3, 0), "daN": (10, 0), "kgf": (9.80665, 0), "tonf": (9806.65, 0),
          "lbf": (4.4482216152605, 0)},
    "mm": {"mm": (1, 0), "um": (1e-3, 0), "cm": (10, 0), "m": (1e3, 0), "in": (25.4, 0), "mil": (0.0254, 0)},
    "degC": {"degC": (1, 0), "K": (1, -273.15), "degF": (5 / 9, -160 / 9)},
    "g": {"g": (1, 0), "m/s2": (1 / 9.80665, 0)},
    "Pa": {"Pa": (1, 0), "kPa": (1e3, 0), "hPa": (100, 0), "mbar": (100, 0), "bar": (1e5, 0), "psi": (6894.757, 0)},
    "m": {"m": (1, 0), "ft": (0.3048, 0)},
    "%": {"%": (1, 0), "-": (100, 0)}, "-": {"-": (1, 0)}, "deg": {"deg": (1, 0), "rad": (57.29577951308232, 0)},
    "kg/s": {"kg/s": (1, 0), "kg/h": (1 / 3600, 0), "lb/h": (0.45359237 / 3600, 0)},
    "mm/s": {"mm/s": (1, 0), "cm/s": (10, 0), "m/s": (1e3, 0), "in/s": (25.4, 0)},
}  # fmt: skip
SPELLED = {
    "sec": "s", "seconds": "s", "msec": "ms", "µm": "um", "μm": "um", "inch": "in", "kp": "kgf", "pct": "%",
    "percent": "%", "°C": "degC", "C": "degC", "deg C": "degC", "°F": "degF", "F": "degF", "m/s^2": "m/s2",
    "m/s²": "m/s2",
}  # fmt: skip
UNITS = {*SUFFIX_UNITS.values(), *(unit for theirs in CONVERSIONS.values() for unit in theirs)}


def slips(times: float, within: float, force: str = "N") -> list[str]:
    """What makes a mount so many times as stiff as it is, within this logarithm: columns in other units than named.

    `force`: the unit that the force is said to be in.
    """
    ours, _ = CONVERSIONS["N"][force]
    ratios = {f"deformation_mm in {unit}": factor for unit, (factor, _) in CONVERSIONS["mm"].items() if unit != "mm"}
    ratios |= {f"force_N in {unit}": ours / factor for unit, (factor, _) in CONVERSIONS["N"].items() if unit != force}
    return [word for word, ratio in ratios.items() if times > 0.0 and abs(log(times / ratio)) < within]


def unit_said(theirs: str) -> str:
    """The unit that a column's name carries, spelled as here; empty when it says none."""
    said = unit_in_brackets(theirs) or (unit_of(theirs.strip()) if "_" in theirs else "")
    return SPELLED.get(said, said)


def unit_in_brackets(name: str) -> str:
    """`bar` of `pressure [bar]` or `pressure (bar)`, known or not."""
    found = _BRACKETS.search(name)
    return found.group(1).strip() if found else ""
