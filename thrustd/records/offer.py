"""What the columns of anyone's file may be, by their names, units and values: offered to a person, never taken unasked.

Time [s] -> time_s        Load [kN] -> force_N * 1000        LVDT (V) -> deformation_mm, its scale to be said
"""

import re
import shlex
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.records.recording import TIME, signal_of, unit_of
from thrustd.records.rename import spelled
from thrustd.records.units import CONVERSIONS, unit_said

FORCE, DEFORMATION, TEMPERATURE = "force_N", "deformation_mm", "temperature_degC"
EVEN = 2.0  # times: steps of a clock that trembles, half of them within
AGREE = 0.2  # correlation of force and deformation from which their signs are judged

# channel: words of its column's name, units that say so themselves
_WORDS: dict[str, tuple[str, tuple[str, ...]]] = {
    TIME: (r"t|time|zeit|tijd|temps|timestamp|elapsed|clock", ("s", "ms", "us", "ns", "min", "h")),
    FORCE: (r"f|fx|fz|force|load|loadcell|thrust|kraft|kracht|last", ("N", "kN", "daN", "kgf", "tonf", "lbf")),
    DEFORMATION: (
        r"d|x|u|s|disp|displacement|defl|deflection|def|deform|deformation|lvdt|travel|stroke|weg|position|pos|"
        r"extension|compression",
        ("mm", "um", "in", "mil"),
    ),
    TEMPERATURE: (r"temp|temperature|temperatur|thermo|tc|t", ("degC", "K", "degF")),
    "accel_x_g": (r"ax|nx|fx|accx|accelx", ("g", "m/s2")),
    "accel_y_g": (r"ay|ny|fy|accy|accely", ("g", "m/s2")),
    "accel_z_g": (r"az|nz|fz|accz|accelz", ("g", "m/s2")),
    "n1_pct": (r"n1", ("%",)),
    "n2_pct": (r"n2", ("%",)),
    "vibration_mm_s": (r"vib|vibration", ("mm/s", "cm/s", "m/s", "in/s")),
    "dynamic_pressure_Pa": (r"q|qbar|qc", ("Pa", "kPa", "hPa", "mbar", "psi")),
    "mach": (r"ma|mach", ("", "-")),
}
UNIT_ALONE = {TIME, FORCE, DEFORMATION, TEMPERATURE}  # a column in newtons is a force; one in per cent may be anything


class Offered(NamedTuple):
    """ours = theirs * factor + offset; `unit` as the column's name says it, empty when it says none."""

    ours: str
    unit: str
    factor: float
    offset: float


def offer(columns: Mapping[str, Floats]) -> dict[str, Offered]:
    """theirs -> what it may be, for columns that are not called as in the catalogue already; each channel once."""
    taken = {name for name in columns if name == TIME or signal_of(name)}
    found: dict[str, Offered] = {}
    for ours, (words, units) in _WORDS.items():
        if ours in taken:
            continue
        rest = [name for name in columns if name not in taken and name not in found]
        fits = {name: _fits(name, words, units) for name in rest if ours != TIME or _may_be_time(name, columns[name])}
        best = max(fits, key=lambda name: fits[name], default="")
        if best and fits[best] > (0 if ours in UNIT_ALONE else 2):  # 2: name and unit
            found[best] = _converted(best, ours)
    if TIME not in taken and not any(o.ours == TIME for o in found.values()):
        rising = [name for name, column in columns.items() if name not in found and _rises(column)]
        found |= {name: _converted(name, TIME) for name in rising[:1]}
    return _turned(found, columns)


def offered_renames(columns: Mapping[str, Floats]) -> list[str]:
    """As `--rename` and `td.read` take it, with FACTOR for a unit that has to be calibrated; empty without a time."""
    found = offer(columns)
    if not any(one.ours == TIME for one in found.values()):
        return []
    known = {name: one.unit in CONVERSIONS[unit_of(one.ours)] for name, one in found.items()}
    return [
        spelled(name, one.ours, one.factor, one.offset) if known[name] else f"{name}={one.ours}*FACTOR+OFFSET"
        for name, one in found.items()
    ]


def advised(columns: Mapping[str, Floats]) -> dict[str, str]:
    """ours -> how to name the column that says by its unit that it may be this channel."""
    found = {one.ours: (name, one) for name, one in offer(columns).items() if signal_of(one.ours) and one.unit}
    said = {ours: shlex.quote(spelled(name, ours, one.factor, one.offset)) for ours, (name, one) in found.items()}
    return {
        ours: f"{found[ours][0]} may be {ours}, which effects read: if so, --rename {how}" for ours, how in said.items()
    }


def _fits(name: str, words: str, units: tuple[str, ...]) -> int:
    """2 for the name, 1 for the unit; 0 where the unit is of something else."""
    unit = unit_said(name)
    kind = 1 if unit in units else 0
    known = any(unit in there for there in CONVERSIONS.values())
    if known and not kind:
        return 0
    stem = re.sub(r"[\[(].*", "", name).strip().lower()
    if unit and stem.endswith("_" + unit.lower()):
        stem = stem[: -len(unit) - 1]
    parts = {*re.split(r"[^a-zµ]+", stem), *re.split(r"[^a-z0-9]+", stem)}
    return 2 * any(re.fullmatch(words, part) for part in parts) + kind


def _converted(theirs: str, ours: str) -> Offered:
    unit = unit_said(theirs) or {TIME: "s", "mach": "-"}.get(ours, "")
    factor, offset = CONVERSIONS[unit_of(ours)].get(unit, (1.0, 0.0))
    return Offered(ours, unit, float(factor), float(offset))


def _rises(column: Floats) -> bool:
    return len(column) > 1 and bool((np.diff(column) > 0).all())


def _may_be_time(name: str, column: Floats) -> bool:
    """A lone `T` without a unit may be a temperature as well: a clock rises, mostly in even steps."""
    if unit_said(name) or not re.search(r"(?<![a-z])t(?![a-z])", name.lower()):
        return True
    low, high = np.quantile(np.diff(column), [0.25, 0.75]) if _rises(column) else (0.0, 1.0)
    return bool(high < EVEN * low)


def _turned(found: dict[str, Offered], columns: Mapping[str, Floats]) -> dict[str, Offered]:
    """Force and deformation rise together where both are + for forward thrust: else the one below zero is turned."""
    pair = [next((name for name, one in found.items() if one.ours == ours), "") for ours in (FORCE, DEFORMATION)]
    if not all(pair):
        return found
    force, deformation = (columns[name] for name in pair)
    good = np.isfinite(force) & np.isfinite(deformation)
    if good.sum() < 3 or not (np.ptp(force[good]) > 0 and np.ptp(deformation[good]) > 0):
        return found
    if float(np.corrcoef(force[good], deformation[good])[0, 1]) > -AGREE:
        return found
    name = pair[0] if np.median(force[good]) < 0 else pair[1]
    return found | {name: found[name]._replace(factor=-found[name].factor)}
