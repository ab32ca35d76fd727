"""Regions of operation: where a model is good and where it is not.

Every sample belongs to one region of each dimension: force level, rate, loading or unloading, time since the last
step, and temperature, load factor, vibration and Mach number where the data have them and they move. Limits of force
and rate are those of a PH-LAB mount; where loads are of another order of magnitude, they go with the load.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thrustd.diagnose.search.candidates import moves, order_of
from thrustd.model.stage import Floats

Mask = NDArray[np.bool_]
FULL_N = 6500.0  # load for which these limits are made
RATE_S = 1.0  # rates are taken over this long
HOLDING_N_S = 20.0  # slower than this is holding: a fraction of the load cell's noise per second
STEP_N_S = 100.0  # faster than this is a step
FORCE_EDGES_N = (2000.0, 4000.0)
SINCE_EDGES_S = (5.0, 30.0, 300.0)
CHANNELS = {  # by terciles of what the data visit
    "temperature_degC": ("temperature", "degC"),
    "accel_z_g": ("load factor", "g"),
    "vibration_mm_s": ("vibration", "mm/s"),
    "mach": ("Mach", ""),
}


@dataclass(frozen=True, slots=True)
class Region:
    """Samples that have something in common."""

    dimension: str
    label: str  # in words
    mask: Mask  # (n,)


@dataclass(frozen=True, slots=True)
class RegionError:
    """How a model does in one region; shares are of the whole recording."""

    dimension: str
    label: str
    rmse_n: float
    bias_n: float
    share_of_time: float
    share_of_squared_error: float


def regions_of(force_n: Floats, dt_s: float, channels: Mapping[str, Floats]) -> list[Region]:
    """All regions of one recording with a uniform step; force_n (n,) is the model's or the reference."""
    rate, scale = force_rate(force_n, dt_s), order_of(float(np.nanquantile(np.abs(force_n), 0.999)), FULL_N)
    edges_n, holding_n_s = [_round(scale * edge) for edge in FORCE_EDGES_N], _round(scale * HOLDING_N_S)
    found = _cut("force", force_n, edges_n, *(("kN", 1e-3) if edges_n[0] >= 1000.0 else ("N", 1.0)))
    found += _cut("rate", np.abs(rate), (holding_n_s, 10 * holding_n_s), "N/s", 1.0)
    found += [
        Region("direction", "loading", rate > holding_n_s),
        Region("direction", "unloading", rate < -holding_n_s),
        Region("direction", "holding", np.abs(rate) <= holding_n_s),
    ]
    found += _since_step(rate / scale, dt_s)
    for name, (words, unit) in CHANNELS.items():
        if name in channels and moves(channels[name]):
            edges = np.unique(np.quantile(channels[name], [1 / 3, 2 / 3]))
            found += _cut(words, channels[name], tuple(map(float, edges)), unit, 1.0)
    return [region for region in found if region.mask.any()]


def _round(value: float) -> float:
    return float(f"{value:.1g}")


def force_rate(force_n: Floats, dt_s: float) -> Floats:
    """Change of force over about a second, centred (n,), N/s."""
    half = max(1, round(RATE_S / 2 / dt_s))
    rate = np.zeros_like(force_n)
    if len(force_n) > 2 * half:
        rate[half:-half] = (force_n[2 * half :] - force_n[: -2 * half]) / (2 * half * dt_s)
    return rate


def _since_step(rate: Floats, dt_s: float) -> list[Region]:
    index = np.arange(len(rate))
    last = np.maximum.accumulate(np.where(np.abs(rate) > STEP_N_S, index, -1))
    since_s = np.where(last >= 0, (index - last) * dt_s, np.inf)
    edges = (0.0, *SINCE_EDGES_S, np.inf)
    words = ["first 5 s after a step", "5 to 30 s after a step", "30 to 300 s after a step", "long after a step"]
    return [
        Region("time since step", word, (since_s >= low) & (since_s < high) if high < np.inf else since_s >= low)
        for word, low, high in zip(words, edges[:-1], edges[1:], strict=True)
    ]


def _cut(dimension: str, column: Floats, edges: Sequence[float], unit: str, factor: float) -> list[Region]:
    shown = [f"{edge * factor:.3g}" for edge in edges]
    end = f" {unit}" if unit else ""
    prefix = "" if dimension == "force" else f"{dimension} "
    words = [f"{prefix}below {shown[0]}{end}"]
    words += [f"{prefix}{low} to {high}{end}" for low, high in pairwise(shown)]
    words += [f"{prefix}above {shown[-1]}{end}"]
    number = np.searchsorted(np.array(edges), column, side="right")
    return [Region(dimension, word, number == i) for i, word in enumerate(words)]


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
