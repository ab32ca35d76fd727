"""A tethered static run: the aircraft pulls on one load cell, both engines' mounts are fitted to it together.

    cell = sum over mounts of (1 + G_e + s_m) f_m + h_e p_m - k_m (z_m + a_e (T_m - T_0) + 4 b_e u (1 - u))
           + c + d dF/dt

f_m   force of the mount's model; u its deformation over its range
G_e   what the installation does to an engine's whole load (brackets, lines): prior 3 %
s_m   one mount against its bench: prior `fusion.mount_stiffness_std`
h_e   the mounts' own friction against that of their bench, p_m in the model: prior `fusion.mount_friction_std_n` each.
      It adds while the load grows and takes off while it falls: what is left of it at idle looks like a zero, and
      under load like a gain
z_m   what is left of its transducer's zero under load: prior 17 um, because a reading at rest holds what friction kept
a_e   growth between transducers and mounts with their temperature: prior 0.5 um/K; load and heat come together in such
      a run, so that without it the gain takes the heat's part, and is wrong in cold air
b_e   bow of the transducers' lines: prior 10 um, 0 where gauge blocks have measured it
c     zero of the cell with the wheels' friction: prior 50 N
d     the cell's clock within a step of those it is looked for at, d dF/dt: else friction takes its part

k_m   slope of the model at rest, where the mount stands (`tether_run`)

Engines that are shut down afterwards tell the zero of each mount, as well as its model knows friction.

Bayesian linear regression (Bishop, Pattern Recognition and Machine Learning, ch. 3.3); the noise that counts is slow,
so its variance is that of means of a minute. What the run does not tell apart stays at its prior: two mounts of one
engine move together, so their difference does.
"""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from thrustd.commission.tether_run import Run, columns, read_run
from thrustd.core.calibration import HELD_STD_MM, MountCalibration
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import RecordingError
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.statics import carried
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.records.recording import Recording

ENGINE_STD, CELL_ZERO_N = 0.03, 50.0
EXPANSION_STD_MM_K, BOW_STD_MM, STRAIGHT_MM = 5e-4, 0.01, 1e-6
SLOW_S = 60.0  # as long as a level is held: creep that a model misses lasts so long
LAG_STEP_S = 0.1
LAGS_S = np.arange(-3.0, 3.01, LAG_STEP_S)  # the cell's clock against the log's
UNITS = {"kN": 1e-3, "kgf": 0.102, "lbf": 0.2248}  # per newton
RATIO = (0.5, 2.0)  # of the cell's range over the models'; outside it is another unit or another load path
LEAST_S = 60.0
HOLE = 5.0  # times the usual step of the cell's record
BANDS_N = (1500.0, 3000.0, 5000.0)  # of a mount
SHARE = "share of "


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
    zeros_mm: dict[str, tuple[float, float]]  # by mount: what is left of its zero, sigma
    lines: dict[str, "Line"]
    frictions: dict[str, float]  # by mount: factor
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


class _Known(NamedTuple):
    """What is known beside the cell, as information: of the numbers, and of them times their values."""

    matrix: Floats  # (n, n)
    vector: Floats  # (n,)


class _Solved(NamedTuple):
    """Of the regression."""

    prior: Floats  # (n,) one sigma
    mean: Floats  # (n,)
    covariance: Floats  # (n, n)
    left_n: float  # RMS


def fit_tether(flight: Recording, cell: Recording, installation: Installation) -> TetherFit:
    """`flight`: columns of `flight_columns`; `cell`: time_s and force_N. RecordingError when they do not fit."""
    run = read_run(flight, installation)
    design = _design(run)
    prior = _prior(run, installation, design)
    base_n = np.where(run.counts, (run.force_n * run.runs).sum(axis=1), np.nan)
    known = _known(run, prior)
    trials = [(lag, _at(cell, flight.time_s + lag)) for lag in LAGS_S.tolist()]
    trials = [(lag, cell_n) for lag, cell_n in trials if np.isfinite(cell_n).sum() > LEAST_S * run.rate_hz]
    if not trials:
        span = f"{flight.time_s[0]:.0f} to {flight.time_s[-1]:.0f} s"
        raise RecordingError(
            f"{cell.name}: less than {LEAST_S:g} s within the log's {span}; expected one clock for both"
        )
    _check_unit(cell, base_n, trials[len(trials) // 2][1])
    fits = [(lag, cell_n, _Solved(prior, *_fit(design, known, cell_n - base_n, run.rate_hz))) for lag, cell_n in trials]
    lag, cell_n, solved = min(fits, key=lambda fit: fit[2].left_n)
    good = np.isfinite(cell_n) & np.isfinite(base_n)
    before_n = rms((cell_n - base_n)[good])
    fit = _told(run, installation, solved, before_n, lag)
    untold = not any(one.told for one in fit.numbers if one.what.startswith("gain"))
    if untold or lag in (trials[0][0], trials[-1][0]):
        said = "tells no gain" if untold else f"fits best {lag:+.1f} s off the log's clock or farther"
        said += f", {fit.after_n:.0f} N RMS from the mounts"
        raise RecordingError(f"{cell.name}: {said}; expected this run's load cell, pull +, its clock within 3 s")
    return fit


def _design(run: Run) -> Floats:
    """Columns of `columns`, c and d."""
    moves_n_s = np.gradient(np.nansum(run.force_n * run.runs, axis=1)) * run.rate_hz
    return np.column_stack((columns(run, run.runs), np.ones(len(run.force_n)), moves_n_s))


def _known(run: Run, prior: Floats) -> _Known:
    """The priors, and every mount whose engine was shut down: it carries nothing."""
    known = _Known(np.diag(prior**-2.0), np.zeros(len(prior)))
    for i, std_n in enumerate(run.model_std_n):
        rows = run.stopped[:, i] & np.isfinite(run.force_n[:, i])
        if rows.any():
            alone = np.zeros_like(run.runs)
            alone[rows, i] = True
            row = np.append(np.nansum(columns(run, alone), axis=0) / rows.sum(), (0.0, 0.0)) / std_n
            known.matrix[:] += np.outer(row, row)
            known.vector[:] -= row * run.force_n[rows, i].mean() / std_n
    return known


def _prior(run: Run, installation: Installation, design: Floats) -> Floats:
    """One sigma of every column's number."""
    settings = section(installation.config.fusion, FusionSettings, "fusion")
    zero = [HELD_STD_MM] * len(run.mounts)
    stiffness = [settings.mount_stiffness_std] * len(run.mounts)
    bow = [STRAIGHT_MM if straight else BOW_STD_MM for straight in run.straight]
    grows = [EXPANSION_STD_MM_K] * len(run.engines)
    rubs_n = settings.mount_friction_std_n * np.sqrt(np.bincount(run.engine_of))
    friction = rubs_n / np.maximum(np.nanmax(np.abs(design[:, -2 - len(run.engines) : -2]), axis=0), rubs_n)
    return np.array(
        [ENGINE_STD] * len(run.engines) + stiffness + zero + grows + bow + [*friction, CELL_ZERO_N, LAG_STEP_S]
    )


def _at(cell: Recording, at_s: Floats) -> Floats:
    """The cell at these times; NaN where it said nothing, nor around."""
    read_n = np.interp(at_s, cell.time_s, cell["force_N"], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(cell.time_s, at_s), 1, len(cell) - 1)
    hole = np.diff(cell.time_s)[after - 1] > HOLE * np.median(np.diff(cell.time_s))
    return np.asarray(np.where(hole, np.nan, read_n))


def _check_unit(cell: Recording, base_n: Floats, cell_n: Floats) -> None:
    good = np.isfinite(cell_n) & np.isfinite(base_n)
    spans = [float(np.ptp(np.percentile(each[good], (1, 99)))) for each in (cell_n, base_n)]
    ratio = spans[0] / max(spans[1], 1e-9)
    if not RATIO[0] < ratio < RATIO[1]:
        near = next((f" is it {unit}?" for unit, one in UNITS.items() if one / 1.5 < ratio < 1.5 * one), "")
        raise RecordingError(
            f"{cell.name}: force_N spans {spans[0]:.4g}, the models of all mounts {spans[1]:.4g} N;{near} expected N"
        )


def _fit(design: Floats, known: _Known, wanted_n: Floats, rate_hz: float) -> tuple[Floats, Floats, float]:
    """(numbers, their covariance, RMS of what is left); `wanted_n`: cell minus models, NaN where it does not count."""
    good = np.isfinite(wanted_n) & np.isfinite(design).all(axis=1)
    a, y = design[good], wanted_n[good]
    n_slow = max(round(SLOW_S * rate_hz), 1)
    variance = float(np.var(y))
    for _ in range(5):
        covariance = np.asarray(np.linalg.inv(a.T @ a / variance + known.matrix))
        mean = np.asarray(covariance @ (a.T @ y / variance + known.vector))
        left = y - a @ mean
        blocks = left[: len(left) // n_slow * n_slow].reshape(-1, n_slow).mean(axis=1)
        variance = max(float(np.var(left)), n_slow * float(np.mean(blocks**2)), 1.0)
    return mean, as_blocks_scatter(covariance, a * left[:, None] / variance, n_slow), rms(left)


def as_blocks_scatter(covariance: Floats, scores: Floats, n_slow: int) -> Floats:
    """As unsure as blocks of the run disagree, where that is more: friction and creep of another shape last for levels.

    Scores of what is left, summed over one to four levels (White, Econometrica 50 (1982) 1; Kuensch, Ann. Statist. 17
    (1989) 1217).
    """
    std = np.sqrt(np.diag(covariance))
    wider = std.copy()
    for n in (n_slow, 2 * n_slow, 4 * n_slow):
        moved = np.add.reduceat(scores, np.arange(0, len(scores), n)) @ covariance
        wider = np.maximum(wider, np.sqrt(np.sum(moved**2, axis=0)))
    return np.asarray(covariance * np.outer(wider / std, wider / std))


def _told(run: Run, installation: Installation, solved: _Solved, before_n: float, lag_s: float) -> TetherFit:
    prior, mean, covariance, after_n = solved
    n_e, n_m = len(run.engines), len(run.mounts)
    gains, zeros, lines, frictions, numbers = {}, {}, {}, {}, []
    at = n_e + 2 * n_m
    for i, name in enumerate(run.mounts):
        row = np.zeros(len(mean))
        row[run.engine_of[i]] = row[n_e + i] = 1.0
        gains[name] = 1.0 + float(row @ mean), sqrt(float(row @ covariance @ row))
        k = n_e + n_m + i
        zeros[name] = float(mean[k]), sqrt(float(covariance[k, k]))
        e = run.engine_of[i]
        grows, bent_mm = float(mean[at + e]), float(mean[at + n_e + e])
        grows_std = sqrt(float(covariance[at + e, at + e]))
        frictions[name] = 1.0 + float(mean[at + 2 * n_e + e])
        lines[name] = Line(grows, grows_std, run.reference_degc[i], bent_mm, run.range_mm[i])
        wide = sqrt(float(row**2 @ prior**2))
        numbers.append(Fitted(f"gain {name}", "-", gains[name][0], SIGMAS_95 * gains[name][1], SIGMAS_95 * wide))
        numbers.append(Fitted(f"zero {name}", "um", 1e3 * zeros[name][0], 1960 * zeros[name][1], 1960 * prior[k]))
    for e, engine in enumerate(run.engines):
        bow = [] if run.straight[e] else [(at + n_e + e, "bow of", "um")]
        for k, what, unit in [(at + e, "growth of", "um/K"), *bow, (at + 2 * n_e + e, "friction of", "-")]:
            scale, base = (1.0, 1.0) if unit == "-" else (1e3, 0.0)
            wide, left = scale * SIGMAS_95 * prior[k], scale * SIGMAS_95 * sqrt(float(covariance[k, k]))
            numbers.append(Fitted(f"{what} {engine}", unit, base + scale * float(mean[k]), left, wide))
    numbers += [_share(run, e, mean, covariance, prior) for e in range(n_e) if run.engine_of.count(e) == 2]
    bands, remarks = _bands(run, installation, gains, zeros), _how_it_hangs(numbers, installation)
    return TetherFit(gains, zeros, lines, frictions, numbers, before_n, after_n, lag_s, bands, remarks)


def _share(run: Run, engine: int, mean: Floats, covariance: Floats, prior: Floats) -> Fitted:
    """Of the upper mount in its engine's load, at the run's highest power."""
    upper, lower = (i for i, e in enumerate(run.engine_of) if e == engine)
    top = np.nanpercentile(run.force_n, 95, axis=0)
    a, b = float(top[upper]), float(top[lower])
    n_e = len(run.engines)
    a_now, b_now = a * (1 + mean[engine] + mean[n_e + upper]), b * (1 + mean[engine] + mean[n_e + lower])
    row = np.zeros(len(mean))
    row[n_e + upper], row[n_e + lower] = a_now * b_now / (a_now + b_now) ** 2, -a_now * b_now / (a_now + b_now) ** 2
    spread, wide = sqrt(float(row @ covariance @ row)), sqrt(float(row**2 @ prior**2))
    return Fitted(f"{SHARE}{run.mounts[upper]}", "-", a_now / (a_now + b_now), SIGMAS_95 * spread, SIGMAS_95 * wide)


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
