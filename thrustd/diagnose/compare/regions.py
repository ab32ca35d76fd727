"""Regions of operation: where a model is good and where it is not.

Every sample belongs to one region of each dimension: load; direction and speed of the motion, how far and how long ago
it turned, how long it has been held and after which movement, whether it is farther out than ever, how far it has come
in all; and the channels that move. What slow and far are the record says itself (`motion`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import FULL_N, order_of
from thrustd.diagnose.compare.motion import Motion, motion_of, thinned
from thrustd.diagnose.search.candidates import moves
from thrustd.records.recording import unit_of
from thrustd.records.roles import Roles

FORCE_EDGES_N = (2000.0, 4000.0)
BOTH_WAYS = 0.2  # of the largest load to the other side: a record that goes both ways
RATE_S = 1.0  # rates of the map are taken over this long
TURN_SHARES = (0.1, 0.5)  # of a typical stroke
MOST_CHANNELS = 12
LOAD = "force"
MOTION = (
    "direction", "speed", "last movement", "travel since reversal", "time since reversal", "time held", "travel",
    "history",
)  # fmt: skip
ELSEWHERE = {  # samples that have no region of a dimension
    "speed": "holding", "travel since reversal": "holding", "last movement": "moving", "time held": "moving",
}  # fmt: skip
SHORT = 0.05  # s: decades of time begin here
CHANNELS = {  # in words; others by their name
    "temperature_degC": "temperature",
    "accel_z_g": "load factor",
    "vibration_mm_s": "vibration",
    "mach": "Mach",
    "accel_x_g": "longitudinal acceleration",
    "dynamic_pressure_Pa": "dynamic pressure",
    "n1_pct": "N1",
    "n2_pct": "N2",
}


@dataclass(frozen=True, slots=True)
class Region:
    """Samples that have something in common."""

    dimension: str
    label: str  # in words
    mask: Flags  # (n,)


@dataclass(frozen=True, slots=True)
class RegionError:
    """How a model does in one region; shares are of the whole recording."""

    dimension: str
    label: str
    rmse_n: float
    bias_n: float
    share_of_time: float
    share_of_squared_error: float


def regions_of(
    force_n: Floats,
    dt_s: float,
    channels: Mapping[str, Floats],
    roles: Roles | None = None,
    stride: int = 1,
    sizes_n: Floats | None = None,
) -> list[Region]:
    """All regions of one recording with a uniform step; force_n (n,) is the model's or the reference.

    Motion is that of `deformation_mm` among the channels, of the force where there is none. `stride`: only so many-th
    samples are told apart, the motion between them counts. `sizes_n`: the loads that edges are made for, the
    reference's, so that models are told apart alike.
    """
    roles = roles or Roles()
    driven = channels.get("deformation_mm", force_n)
    unit = _dimensional(roles.input_unit if "deformation_mm" in channels else roles.output_unit)
    motion = thinned(motion_of(driven, dt_s), stride)
    found = _load(force_n[::stride], force_n if sizes_n is None else sizes_n, _dimensional(roles.output_unit))
    found += _moving(motion, _goes_both_ways(driven), unit) + _turned(motion, unit) + _held(motion)
    found += _past(motion)
    others = [n for n in channels if n != "deformation_mm" and moves(channels[n])]
    for name in sorted(others, key=lambda n: n not in CHANNELS)[:MOST_CHANNELS]:
        column = channels[name][::stride]
        edges = tuple(map(float, np.unique(np.quantile(column, [1 / 3, 2 / 3]))))
        found += _cut(CHANNELS.get(name, name), column, edges, _dimensional(unit_of(name)))
    return [region for region in found if region.mask.any()]


def _dimensional(unit: str) -> str:
    return "" if unit == "-" else unit


def _goes_both_ways(column: Floats) -> bool:
    low, high = np.nanquantile(column, [0.001, 0.999])
    return bool(min(-low, high) > BOTH_WAYS * max(-low, high))


def _load(force_n: Floats, sizes_n: Floats, unit: str) -> list[Region]:
    scale = order_of(float(np.nanquantile(np.abs(sizes_n), 0.999)), FULL_N)
    edges = [float(f"{scale * edge:.1g}") for edge in FORCE_EDGES_N]
    if _goes_both_ways(sizes_n):
        edges = [-edges[0], edges[0]]
    kilo = unit == "N" and max(edges) >= 1000.0
    shown = [edge * 1e-3 for edge in edges] if kilo else edges
    words = _between(shown, "kN" if kilo else unit)
    prefix = "" if unit else "output "
    number = np.searchsorted(np.array(edges), force_n, side="right")
    return [Region(LOAD, prefix + word, number == i) for i, word in enumerate(words)]


def _moving(motion: Motion, both: bool, unit: str) -> list[Region]:
    up, down = ("moving up", "moving down") if both else ("loading", "unloading")
    at = f"{motion.typical:.2g} {unit}/s".replace(" /s", " per s")
    fast = np.abs(motion.velocity) >= motion.typical
    return [
        Region("direction", up, motion.moving & (motion.velocity > 0)),
        Region("direction", down, motion.moving & (motion.velocity < 0)),
        Region("direction", "holding", ~motion.moving),
        Region("speed", f"moving slower than {at}", motion.moving & ~fast),
        Region("speed", f"moving faster than {at}", motion.moving & fast),
        Region("last movement", f"holding after {up}", ~motion.moving & (motion.direction > 0)),
        Region("last movement", f"holding after {down}", ~motion.moving & (motion.direction < 0)),
    ]


def _turned(motion: Motion, unit: str) -> list[Region]:
    """By travel and by time since the last reversal."""
    near, far = (share * motion.stroke for share in TURN_SHARES)
    words = [
        f"{word} {unit}".strip() for word in (f"within {near:.2g}", f"{near:.2g} to {far:.2g}", f"more than {far:.2g}")
    ]
    number = np.digitize(motion.since_travel, [near, far])
    found = [
        Region("travel since reversal", f"{word} of travel since a reversal", motion.moving & (number == i))
        for i, word in enumerate(words)
    ]
    return found + _decades("time since reversal", motion.since_s, "since a reversal")


def _held(motion: Motion) -> list[Region]:
    return _decades("time held", np.where(motion.moving, np.nan, motion.held_s), "into a hold")


def _decades(dimension: str, seconds: Floats, tail: str) -> list[Region]:
    """Seconds by the decades that they visit."""
    known = np.isfinite(seconds)
    if not known.any():
        return []
    longest = float(np.nanmax(seconds))
    edges = [10.0**k for k in range(int(np.ceil(np.log10(SHORT))), 6) if 10.0**k < 0.5 * longest]
    words = [f"{word} s {tail}" for word in _between(edges, "")] if edges else []
    number = np.digitize(np.where(known, seconds, 0.0), edges)
    return [Region(dimension, word, known & (number == i)) for i, word in enumerate(words)]


def _past(motion: Motion) -> list[Region]:
    thirds = np.minimum((3 * motion.travel / max(float(motion.travel[-1]), 1e-300)).astype(int), 2)
    words = ("first", "second", "last")
    found = [Region("travel", f"{word} third of all travel", thirds == i) for i, word in enumerate(words)]
    return [
        *found,
        Region("history", "at a new extreme", motion.newest),
        Region("history", "within the range reached before", ~motion.newest),
    ]


def force_rate(force_n: Floats, dt_s: float) -> Floats:
    """Change of force over about a second, centred (n,), N/s."""
    half = max(1, round(RATE_S / 2 / dt_s))
    rate = np.zeros_like(force_n)
    if len(force_n) > 2 * half:
        rate[half:-half] = (force_n[2 * half :] - force_n[: -2 * half]) / (2 * half * dt_s)
    return rate


def _cut(dimension: str, column: Floats, edges: Sequence[float], unit: str) -> list[Region]:
    number = np.searchsorted(np.array(edges), column, side="right")
    words = [f"{dimension} {word}" for word in _between(edges, unit)]
    return [Region(dimension, word, number == i) for i, word in enumerate(words)]


def _between(edges: Sequence[float], unit: str) -> list[str]:
    """`below 2 kN`, `2 to 4 kN`, `above 4 kN`."""
    shown, end = [f"{float(f'{edge:.3g}'):g}" for edge in edges], f" {unit}" if unit else ""
    middle = [f"{low} to {high}{end}" for low, high in pairwise(shown)]
    return [f"below {shown[0]}{end}", *middle, f"above {shown[-1]}{end}"]


def errors_by_region(regions: list[Region], residual_n: Floats) -> list[RegionError]:
    """One line per region; samples without reference are left out of everything."""
    good = np.isfinite(residual_n)
    total, count = float(np.sum(residual_n[good] ** 2)), int(good.sum())
    lines = []
    for region in regions:
        inside = residual_n[region.mask & good]
        if inside.size:
            squares = float(np.sum(inside**2))
            rmse, bias = (squares / inside.size) ** 0.5, float(inside.mean())
            share = squares / total if total > 0 else 0.0
            lines.append(RegionError(region.dimension, region.label, rmse, bias, inside.size / count, share))
    return lines
