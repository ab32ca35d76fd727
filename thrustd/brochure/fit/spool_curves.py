"""Spool curves of a brochure deck: corrected fuel flow over corrected N1 or N2, from steady flight.

Over all flights and both engines at once,

    ln w = H_engine(n) + k M + e ln theta_t

with H piecewise linear between knots, held smooth by its second differences (one linear least-squares problem, every
flight of equal weight), then made a monotone cubic. k and e are common to all engines: they are the engine type's,
and one flight covers too little of them.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from thrustd.brochure.deck_data import SpoolCurve
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError

Spool = Literal["n1", "n2"]

KNOTS_PCT = {  # corrected spool speeds
    "n1": np.array([25.0, 31, 38, 46, 54, 61, 67, 73, 80, 88, 96, 105]),
    "n2": np.array([45.0, 50, 56, 62, 68, 73, 78, 82, 86, 90, 94, 98]),
}
SMOOTHNESS = 0.3  # weight of a second difference against one flight


class Steady(NamedTuple):
    """Steady samples of one engine in one flight, all (n,)."""

    flight: str
    engine: int
    corrected_pct: Floats
    log_flow: Floats  # of corrected fuel flow [kg/s]
    mach: Floats
    delta_t: Floats
    log_theta_t: Floats


def fit_curves(samples: Sequence[Steady], spool: Spool) -> list[SpoolCurve]:
    """One curve per engine; k and e shared by all of them."""
    engines = sorted({s.engine for s in samples})
    knots = KNOTS_PCT[spool]
    n = len(knots)
    width = n * len(engines) + 2
    rows, targets = [], []
    for s in samples:
        weight = 1.0 / np.sqrt(len(s.mach))
        block = np.zeros((len(s.mach), width))
        at = n * engines.index(s.engine)
        block[:, at : at + n] = _hats(knots, s.corrected_pct)
        block[:, -2], block[:, -1] = s.mach, s.log_theta_t
        rows.append(block * weight)
        targets.append(s.log_flow * weight)
    for i in range(len(engines)):
        bend = np.zeros((n - 2, width))
        bend[:, n * i : n * (i + 1)] = _second_differences(knots) * SMOOTHNESS
        rows.append(bend)
        targets.append(np.zeros(n - 2))
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=None)[0]
    return [
        _curve(engine, knots, solution[n * i : n * (i + 1)], solution[-2:], [s for s in samples if s.engine == engine])
        for i, engine in enumerate(engines)
    ]


def _hats(knots: Floats, speed_pct: Floats) -> Floats:
    """Weights (n, knots) of linear interpolation, carried on beyond the ends."""
    right = np.clip(np.searchsorted(knots, speed_pct, side="right"), 1, len(knots) - 1)
    part = (speed_pct - knots[right - 1]) / (knots[right] - knots[right - 1])
    weights = np.zeros((len(speed_pct), len(knots)))
    at = np.arange(len(speed_pct))
    weights[at, right - 1], weights[at, right] = 1.0 - part, part
    return weights


def _second_differences(knots: Floats) -> Floats:
    """Change of slope at every inner knot, per 10 % of speed."""
    steps = np.diff(knots) / 10.0
    rows = np.zeros((len(knots) - 2, len(knots)))
    for i in range(len(rows)):
        rows[i, i : i + 3] = 1 / steps[i], -1 / steps[i] - 1 / steps[i + 1], 1 / steps[i + 1]
    return rows


def _curve(engine: int, knots: Floats, values: Floats, shared: Floats, samples: Sequence[Steady]) -> SpoolCurve:
    secants = np.diff(values) / np.diff(knots)
    if not (secants > 0).all():
        where = knots[int(np.argmin(secants))]
        raise RecordingError(
            f"engine {engine}: fuel flow falls with spool speed above {where:g} %: not a usable flight"
        )
    # harmonic means of the neighbouring secants: Fritsch & Butland 1984, monotone
    inner = 2.0 / (1.0 / secants[:-1] + 1.0 / secants[1:])
    speeds = np.concatenate([s.corrected_pct for s in samples])
    return SpoolCurve(
        engine=engine,
        corrected_pct=tuple(knots.tolist()),
        log_fuel_flow=tuple(np.round(values, 6).tolist()),
        slope_per_pct=tuple(np.round([secants[0], *inner, secants[-1]], 7).tolist()),
        mach_slope=round(float(shared[0]), 5),
        temperature_exponent=round(float(shared[1]), 5),
        fitted_pct=(round(float(speeds.min()), 2), round(float(speeds.max()), 2)),
        relative_std=1.0,  # until it is measured on flights left out
    )
