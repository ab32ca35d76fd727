"""What a tethered run has told: the numbers of its regression as gains, zeros, friction and curves of the mounts.

The zero is known best at some reading, and the slope beyond the bench is what is not known from there: z + t b with the
t that leaves them nothing in common, so that a flight may take both for independent (`mounts.step`).
"""

from dataclasses import dataclass
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.commission.tether_run import Run, columns, places
from thrustd.core.calibration import MountCalibration
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.measures import SIGMAS_95
from thrustd.core.statics import carried
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation

ENGINE_STD = 0.03
BANDS_N = (1500.0, 3000.0, 5000.0)  # of a mount
SHARE = "share of "
HIGHEST = 95.0  # percentile of the force


@dataclass(frozen=True, slots=True)
class Fitted:
    """One number with its 95 % interval; `told` by the run, or else left at its prior."""

    what: str
    unit: str
    value: float
    half_width: float
    prior_half_width: float

    @property
    def told(self) -> bool:
        return self.half_width < 0.7 * self.prior_half_width


@dataclass(frozen=True, slots=True)
class TetherFit:
    gains: dict[str, tuple[float, float]]  # by mount: factor, sigma
    engine_stds: dict[str, float]  # by engine: sigma of the gain of all its mounts together
    zeros_mm: dict[str, tuple[float, float]]  # by mount: what is left of its zero, sigma
    lines: dict[str, "Line"]
    frictions: dict[str, float]  # by mount: factor
    beyond: dict[str, "Beyond"]  # by mount that the weight holds beyond its bench
    numbers: list[Fitted]
    before_n: float  # RMS of cell minus models
    after_n: float
    lag_s: float
    bands_n: list[tuple[str, float, float, float]]  # mount, force, sigma before and after
    remarks: list[str]


@dataclass(frozen=True, slots=True)
class Line:
    """What a mount's transducer does besides: growth with temperature, bow over its range."""

    expansion_mm_k: float
    expansion_std_mm_k: float
    reference_degc: float
    bow_mm: float
    range_mm: float


@dataclass(frozen=True, slots=True)
class Beyond:
    """A mount's curve beyond its bench."""

    factor: float  # slope over that of the other side
    std: float
    told_mm: float  # reading where its zero is known best
    zero_std_mm: float  # there


class Solved(NamedTuple):
    """Of the regression."""

    prior: Floats  # (n,) one sigma
    mean: Floats  # (n,)
    covariance: Floats  # (n, n)
    left_n: float  # RMS

    def sum_of(self, *numbers: int) -> tuple[float, float, float]:
        """Of these numbers: value, sigma, sigma before."""
        return self.along(np.isin(np.arange(len(self.mean)), numbers).astype(float))

    def along(self, row: Floats) -> tuple[float, float, float]:
        """Of as much of every number as `row` (n,) says: the same."""
        stds = sqrt(float(row @ self.covariance @ row)), sqrt(float(row**2 @ self.prior**2))
        return float(row @ self.mean), *stds

    def fitted(self, what: str, unit: str, *numbers: int) -> Fitted:
        scale, base = (1.0, 1.0) if unit == "-" else (1e3, 0.0)
        value, std, before = self.sum_of(*numbers)
        return Fitted(what, unit, base + scale * value, scale * SIGMAS_95 * std, scale * SIGMAS_95 * before)


def told_by(run: Run, installation: Installation, solved: Solved, before_n: float, lag_s: float) -> TetherFit:
    at, numbers = places(run), []
    gains, zeros, lines, frictions, beyond = {}, {}, {}, {}, {}
    for i, (name, e) in enumerate(zip(run.mounts, run.engine_of, strict=True)):
        gain, zero = (at["gain"] + e, at["own"] + i), at["zero"] + i
        value, std, _ = solved.sum_of(*gain)
        gains[name], zeros[name] = (1.0 + value, std), solved.sum_of(zero)[:2]
        grows, grows_std, _ = solved.sum_of(at["growth"] + e)
        bent_mm = solved.sum_of(at["bow"] + e)[0]
        frictions[name] = 1.0 + solved.sum_of(at["friction"] + e)[0]
        lines[name] = Line(grows, grows_std, run.reference_degc[i], bent_mm, run.range_mm[i])
        numbers += [solved.fitted(f"gain {name}", "-", *gain), solved.fitted(f"zero {name}", "um", zero)]
        if run.asks_slope(i):
            slope = at["beyond"] + i
            beyond[name] = _beyond(solved, zero, slope, run.begins_mm[i])
            zeros[name] = zeros[name][0], beyond[name].zero_std_mm
            numbers.append(solved.fitted(f"slope beyond its bench of {name}", "-", slope))
    for e, engine in enumerate(run.engines):
        numbers.append(solved.fitted(f"growth of {engine}", "um/K", at["growth"] + e))
        numbers += [] if run.straight[e] else [solved.fitted(f"bow of {engine}", "um", at["bow"] + e)]
        numbers.append(solved.fitted(f"friction of {engine}", "-", at["friction"] + e))
    together = [_together(run, e, solved) for e in range(len(run.engines))]
    engine_stds = {engine: one.half_width / SIGMAS_95 for engine, one in zip(run.engines, together, strict=True)}
    pairs = [e for e in range(len(run.engines)) if run.engine_of.count(e) == 2]
    numbers += [together[e] for e in pairs] + [_share(run, e, solved) for e in pairs]
    bands, remarks = _bands(run, installation, gains, zeros), _how_it_hangs(numbers, installation)
    known = gains, engine_stds, zeros, lines, frictions, beyond, numbers
    return TetherFit(*known, before_n, solved.left_n, lag_s, bands, remarks)


def _beyond(solved: Solved, zero: int, slope: int, begins_mm: float) -> Beyond:
    """`begins_mm`: reading where the bench begins; from there on a slope that is off is a zero that is."""
    shared = float(solved.covariance[zero, slope])
    (_, zero_std, _), (more, std, _) = solved.sum_of(zero), solved.sum_of(slope)
    told_mm = min(max(shared / std**2, 0.0), begins_mm)
    alone_mm2 = zero_std**2 - 2.0 * told_mm * shared + (told_mm * std) ** 2
    return Beyond(1.0 + more, std, told_mm, sqrt(alone_mm2))


def _together(run: Run, engine: int, solved: Solved) -> Fitted:
    """Gain of all its mounts at the run's highest power: the cell tells their sum, not each of them.

    Bow, friction and zero that go with it are not taken off: a flight does not go the run's way.
    """
    mine, at = [i for i, e in enumerate(run.engine_of) if e == engine], places(run)
    forces_n = np.array([_highest(run, i).model_n for i in mine])
    row = np.zeros(len(solved.mean))
    row[at["gain"] + engine] = 1.0
    row[[at["own"] + i for i in mine]] = forces_n / forces_n.sum()
    value, std, before = solved.along(row)
    return Fitted(f"both gains of {run.engines[engine]}", "-", 1.0 + value, SIGMAS_95 * std, SIGMAS_95 * before)


def _share(run: Run, engine: int, solved: Solved) -> Fitted:
    """Of the upper mount in its engine's load, at the run's highest power.

    The cell knows the sum alone: it tells neither how each mount differs from its bench, nor each transducer's line.
    """
    upper, lower = (_highest(run, i) for i, e in enumerate(run.engine_of) if e == engine)
    both_n2 = (upper.model_n + lower.model_n) ** 2
    row = (lower.model_n * upper.numbers_n - upper.model_n * lower.numbers_n) / both_n2
    line = hypot(lower.model_n * upper.line_n, upper.model_n * lower.line_n) / both_n2
    spread, wide = (hypot(sqrt(each), line) for each in (row @ solved.covariance @ row, row**2 @ solved.prior**2))
    a_n, b_n = (one.model_n + float(one.numbers_n @ solved.mean) for one in (upper, lower))
    name = f"{SHARE}{run.mounts[run.engine_of.index(engine)]}"
    return Fitted(name, "-", a_n / (a_n + b_n), SIGMAS_95 * spread, SIGMAS_95 * wide)


class _Highest(NamedTuple):
    """A mount at the run's highest power."""

    model_n: float
    numbers_n: Floats  # (n,) what a number of the regression makes of it
    line_n: float  # what a bow of its transducer may make of it, one sigma, wherever that is largest


def _highest(run: Run, mount: int) -> _Highest:
    model_n = run.force_n[:, mount]
    at = int(np.nanargmin(np.abs(model_n - np.nanpercentile(model_n, HIGHEST))))
    alone = np.zeros_like(run.runs)
    alone[at, mount] = True
    row = np.nan_to_num(np.column_stack(list(columns(run, alone).values()))[at])
    line_n = abs(float(run.slope_n_mm[at, mount])) * run.line_stds[mount][1]
    return _Highest(float(model_n[at]), np.append(row, [0.0, 0.0]), line_n)  # nothing of the cell's zero and clock


def _how_it_hangs(numbers: list[Fitted], installation: Installation) -> list[str]:
    """A line where the mounts share the load otherwise than the aircraft's file says: as a rigid body, or together."""
    aircraft = installation.aircraft()
    fronts = [each.thrust_share for each in carried(aircraft) if each.thrust_share > 0.0]
    shares = [(one.what.removeprefix(SHARE), one.value) for one in numbers if one.what.startswith(SHARE)]
    found = []
    for mount, share in shares if len(fronts) == 2 else []:
        rigid, together = fronts[0], aircraft.spring_n_mm[0] / sum(aircraft.spring_n_mm)
        shows = abs(share - rigid) < abs(share - together)
        if shows != aircraft.rigid_body:
            parts = f"a rigid body's {100 * rigid:.0f} % against {100 * together:.0f} %: expected rigid_body = "
            found.append(f"{mount}: {100 * share:.0f} % of its engine's load, {parts}{str(shows).lower()}")
    return found


def _bands(
    run: Run, installation: Installation, gains: dict[str, tuple[float, float]], zeros: dict[str, tuple[float, float]]
) -> list[tuple[str, float, float, float]]:
    """One sigma of every mount's force before and after, model and friction aside."""
    settings = section(installation.config.fusion, FusionSettings, "fusion")
    known = installation.calibration()
    rows = []
    for i, name in enumerate(run.mounts):
        old = known.of(name) if known else MountCalibration()
        k = float(np.nanmedian(run.slope_n_mm[:, i]))
        for force_n in BANDS_N:
            gain_std, zero_std = old.gain_std or ENGINE_STD, old.zero_std_mm or settings.mount_zero_std_mm
            before, after = (
                sqrt((gain * force_n) ** 2 + (k * zero) ** 2)
                for gain, zero in ((gain_std, zero_std), (gains[name][1], zeros[name][1]))
            )
            rows.append((name, force_n, before, after))
    return rows
