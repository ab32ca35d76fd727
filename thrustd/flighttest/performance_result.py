"""What `performance` says: polars, points and throttle steps; all of it is in JSON, tables and page."""

import msgspec

from thrustd.flighttest.steps import Gain, ThrottleStep
from thrustd.records.rows import Row


class Interval(msgspec.Struct, frozen=True):
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float
    random_u95: float
    systematic_u95: float


class PolarResult(msgspec.Struct, frozen=True):
    """One polar."""

    of: str
    zero_lift_drag: Interval  # C_D0
    oswald: Interval  # e
    best_lift_to_drag: Interval
    scatter_g: float  # of the excess thrust between points, beyond what each says of itself
    points: int
    budget_zero_lift_drag: dict[str, float]  # source -> change of C_D0 by one sigma of it


class PerformancePoint(msgspec.Struct, frozen=True):
    """One steady window."""

    flight: str
    name: str
    start_s: float
    end_s: float
    mach: float
    altitude_m: float
    weight_n: float
    thrust_n: float
    brochure_n: float
    c_l: float
    c_d: float
    c_d_u95: float  # random, as the first polar weighs it; NaN: left out
    missing_s: int  # seconds of it without all values; means are of the others
    energy_minus_accel_n: float  # excess thrust by air data minus by accelerometer (its zero taken out)
    thrust_error_n: float  # thrust minus what the polar and the excess thrust ask for
    thrust_error_n_u95: float  # random
    left_out: str  # empty, or why
    counts_pct: float  # weight in the first polar, of the point that counts most; 0: left out
    why: str  # what most of its variance is from; empty: what all points have in common


class BesideKnown(msgspec.Struct, frozen=True):
    """What somebody else found, and whether the first polar's intervals hold it."""

    zero_lift_drag: float
    oswald: float
    source: str
    zero_lift_drag_inside: bool
    oswald_inside: bool


class Performance(msgspec.Struct, frozen=True):
    """Everything."""

    polars: list[PolarResult]
    known: list[BesideKnown]
    points: list[PerformancePoint]
    excess_rms_n: float  # excess thrust by air data against accelerometer, over the points that are used
    steps: list[ThrottleStep]
    gains: dict[str, Gain]  # accel, air: thrust's changes over all steps against theirs
    accelerometer_zero_g: dict[str, list[float]]  # flight -> zero, its sigma
    notes: list[str]

    def rows(self) -> list[Row]:
        return [dict(msgspec.to_builtins(point)) for point in self.points]
