"""Bench programmes for the rig as CSV: random steps, multisine, sweep, weight steps.

The thesis shows why steps alone do not identify the dynamics: a model fitted on steps is 108 N wrong on a 0.003 Hz sine
where one fitted on it is 13 N (sections 14.1 and 14.7). A campaign that does: steps for the level, a multisine for
the dynamics, weight steps for the engine's weight.
"""

from dataclasses import dataclass

import numpy as np

from thrustd.bench.programme import HOLD_S, Levels, multisine, random_steps, sweep
from thrustd.core.columns import Floats
from thrustd.core.errors import UsageError
from thrustd.core.signals import CATALOGUE

PROGRAMMES = ("steps", "multisine", "sweep", "weight")
RAMP_S = (1.0, 1.0)  # of every step, half a cosine
PARTS = 10  # of the range, each visited once in ten holds, some 50 min; the ends are held exactly
STILL_S, LOAD_S = 60.0, 5.0  # every record begins at rest, then the load comes on: models start from rest, too
LOW_N, HIGH_N = 0.0, 9000.0  # from no load to what a lower mount carries at take-off: 8.6 kN by statics
REST = {"force_N": 0.0, "accel_z_g": CATALOGUE["accel_z_g"].rest}
SHORTEST_H, LONGEST_H = 0.05, 1000.0


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """What the rig may do. Forces in N, frequencies in Hz, times in s, load factor in g."""

    hours: float = 8.0
    sample_hz: float = 10.0  # of the programme file; the rig interpolates
    low_n: float = LOW_N
    high_n: float = HIGH_N
    hold_s: tuple[float, float] = HOLD_S
    band_hz: tuple[float, float] = (0.001, 1.0)
    lines: int = 40
    weight_g: tuple[float, float] = (0.0, 3.0)
    seed: int = 0

    def __post_init__(self) -> None:
        for field, low, high, limit in (
            ("force_N", self.low_n, self.high_n, CATALOGUE["force_N"]),
            ("accel_z_g", *self.weight_g, CATALOGUE["accel_z_g"]),
        ):
            if not limit.low <= low < high <= limit.high:
                raise UsageError(
                    f"test plan: {field} from {low:g} to {high:g}, expected low < high within {limit.low:g} to "
                    f"{limit.high:g}, all that thrustd takes for a measurement"
                )
        if not SHORTEST_H <= self.hours <= LONGEST_H:
            raise UsageError(f"test plan: {self.hours:g} h, expected {SHORTEST_H:g} to {LONGEST_H:g}")
        if not 0 < self.band_hz[0] < self.band_hz[1] <= self.sample_hz / 2:
            raise UsageError(
                f"test plan: {self.band_hz[0]:g} to {self.band_hz[1]:g} Hz at {self.sample_hz:g} Hz, expected low < "
                "high and a rate of at least twice the highest frequency"
            )


def programme(kind: str, plan: BenchPlan) -> dict[str, Floats]:
    """Columns time_s, force_N and, for weight steps, accel_z_g, each (n,)."""
    if kind not in PROGRAMMES:
        raise UsageError(f"test plan: programme '{kind}', expected one of {', '.join(PROGRAMMES)}")
    rng = np.random.default_rng(plan.seed)
    count, still, loading = (round(s * plan.sample_hz) for s in (plan.hours * 3600, STILL_S, LOAD_S))
    time_s = np.arange(count) / plan.sample_hz
    moving_s = time_s[-1] + 1.0 / plan.sample_hz - STILL_S - LOAD_S
    columns = {"force_N": _forces(kind, moving_s, plan, rng)}
    if kind == "weight":
        columns["accel_z_g"] = random_steps(
            moving_s, plan.sample_hz, rng, Levels(*plan.weight_g, plan.hold_s, RAMP_S, REST["accel_z_g"], PARTS)
        )
    return {"time_s": time_s} | {
        name: _from_rest(REST[name], values, still, loading) for name, values in columns.items()
    }


def _forces(kind: str, moving_s: float, plan: BenchPlan, rng: np.random.Generator) -> Floats:
    if kind == "multisine":
        return multisine(moving_s, plan.sample_hz, rng, plan.band_hz, plan.lines, plan.low_n, plan.high_n)
    if kind == "sweep":
        return sweep(moving_s, plan.sample_hz, plan.band_hz, plan.low_n, plan.high_n)
    return random_steps(
        moving_s, plan.sample_hz, rng, Levels(plan.low_n, plan.high_n, plan.hold_s, RAMP_S, parts=PARTS)
    )


def _from_rest(rest: float, values: Floats, still: int, loading: int) -> Floats:
    """`values` behind so many samples at rest and so many of a straight ramp to the first of them."""
    return np.concatenate((np.full(still, rest), np.linspace(rest, values[0], loading, endpoint=False), values))


def as_csv(columns: dict[str, Floats]) -> str:
    """Header of canonical names, then rows; milliseconds and tenths of a newton are enough for a rig."""
    formats = {"time_s": "{:.3f}", "force_N": "{:.1f}", "accel_z_g": "{:.3f}"}
    rows = zip(*columns.values(), strict=True)
    pattern = ",".join(formats[name] for name in columns)
    return "\n".join([",".join(columns), *(pattern.format(*row) for row in rows)]) + "\n"
