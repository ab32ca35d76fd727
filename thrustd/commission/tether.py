"""A tethered static run: the aircraft pulls on one load cell, both engines' mounts are fitted to it together.

    cell = sum over mounts of (1 + G_e + s_m) f_m + h_e p_m - k_m (z_m + a_e (T_m - T_0) + 4 b_e u (1 - u))
           + q_m r_m + c + d dF/dt

f_m   force of the mount's model; u its deformation over its range
G_e   what the installation does to an engine's whole load (brackets, lines): prior 3 %
s_m   one mount against its bench, prior `fusion.mount_stiffness_std`, and the scale of its transducer, prior 0.5 %
      where no gauge blocks have measured it
h_e   the mounts' own friction against that of their bench, p_m in the model: prior `fusion.mount_friction_std_n` each.
      It adds while the load grows and takes off while it falls: what is left of it at idle looks like a zero, and
      under load like a gain. Elements of it that differ otherwise than by one factor are in the covariance
z_m   what is left of its transducer's zero under load: prior 17 um, because a reading at rest holds what friction kept
a_e   growth between transducers and mounts with their temperature, through all of the model: prior 0.5 um/K; load and
      heat come together in such a run, so that without it the gain takes the heat's part, and is wrong in cold air
b_e   bow of the transducers' lines: prior 10 um, 0 where gauge blocks have measured it
q_m   slope of a mount's curve beyond its bench against that of its other side, where the engine's weight holds it out
      there: prior 6.1 % (`mounts.step`). r_m grows from nothing at rest to where the bench begins and stays
      Where it is asked, what the numbers take on of the models' own errors is in their covariance: these repeat with
      the load, so no residual shows them (consider covariance; Schmidt 1966, Bierman 1977, ch. 8)
c     zero of the cell with the wheels' friction: prior 50 N
d     the cell's clock within a step of those it is looked for at, d dF/dt: else friction takes its part

The cell's own scale is none of these: a gain that is off by it fits as well. What its certificate leaves open is in all
gains alike (`cell_std`).

k_m   slope of the model at rest, where the mount stands (`tether_run`)

Engines that are shut down afterwards tell the zero of each mount, as well as its model knows friction.

Bayesian linear regression (Bishop, Pattern Recognition and Machine Learning, ch. 3.3); the noise that counts is slow,
so its variance is that of means of a minute. What the run does not tell apart stays at its prior: two mounts of one
engine move together, so their difference does.
"""

from dataclasses import replace
from math import hypot
from typing import NamedTuple

import numpy as np

from thrustd.commission.tether_cell import CLOCK_S, FORCE, at_times, check_unit, heard
from thrustd.commission.tether_models import GROWS_MM_K
from thrustd.commission.tether_run import NAMES, Run, columns, curve_errors_n, friction_errors_n, places, read_run
from thrustd.commission.tether_told import ENGINE_STD, Solved, TetherFit, told_by
from thrustd.core.calibration import BOW_STD_MM, HELD_STD_MM
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.measures import rms
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.mounts.step import IN_SHEAR_STD
from thrustd.records.recording import Recording, make_recording

CELL_ZERO_N, MOST_CELL_STD = 50.0, 0.05
STRAIGHT_MM = 1e-6
SLOW_S = 60.0  # as long as a level is held: creep that a model misses lasts so long
LAG_STEP_S = 0.1
LAGS_S = np.arange(-CLOCK_S, CLOCK_S + 0.01, LAG_STEP_S)  # the cell's clock against the log's
LEAST_S = 60.0
SAME = 1e-4  # of a variance, from one round to the next
MUCH = 3.0  # times what the models' own errors leave


class _Known(NamedTuple):
    """What is known beside the cell, as information: of the numbers, and of them times their values."""

    matrix: Floats  # (n, n)
    vector: Floats  # (n,)


def fit_tether(flight: Recording, cell: Recording, installation: Installation, cell_std: float = 0.0) -> TetherFit:
    """`flight`: columns of `flight_columns`; `cell`: time_s and force_N. RecordingError when they do not fit.

    cell_std: one sigma of the cell's own scale, relative.
    """
    if not 0.0 <= cell_std <= MOST_CELL_STD:
        raise UsageError(f"--cell-std {cell_std:g}: expected 0 to {MOST_CELL_STD:g}, one sigma of the cell's scale")
    run = read_run(flight, installation)
    design = _design(run)
    prior = _prior(run, installation, design)
    base_n = np.where(run.counts, (run.force_n * run.runs).sum(axis=1), np.nan)
    known = _known(run, prior)
    cell, silent = _with_a_number(cell)
    cell, remarks = heard(cell, flight.time_s, base_n, np.sqrt(np.square(design) @ np.square(prior)))
    trials = [(lag, at_times(cell, flight.time_s + lag)) for lag in LAGS_S.tolist()]
    trials = [(lag, cell_n) for lag, cell_n in trials if np.isfinite(cell_n).sum() > LEAST_S * run.rate_hz]
    if not trials:
        span = f"{flight.time_s[0]:.0f} to {flight.time_s[-1]:.0f} s"
        raise RecordingError(
            f"{cell.name}: less than {LEAST_S:g} s within the log's {span}; expected one clock for both"
        )
    check_unit(cell, base_n, trials[len(trials) // 2][1])
    errors_n = np.hstack((curve_errors_n(run), friction_errors_n(run)))
    fits = [
        (lag, cell_n, Solved(prior, *_fit(design, known, cell_n - base_n, run.rate_hz, errors_n)))
        for lag, cell_n in trials
    ]
    lag, cell_n, solved = min(fits, key=lambda fit: fit[2].left_n)
    good = np.isfinite(cell_n) & np.isfinite(base_n)
    before_n = rms((cell_n - base_n)[good])
    fit = told_by(run, installation, _of_the_cell(solved, run, cell_std), before_n, lag)
    untold = not any(one.told for one in fit.numbers if one.what.startswith("gain"))
    if untold or lag in (trials[0][0], trials[-1][0]):
        said = "tells no gain" if untold else f"fits best {lag:+.1f} s off the log's clock or farther"
        said += f", {fit.after_n:.0f} N RMS from the mounts"
        raise RecordingError(f"{cell.name}: {said}; expected this run's load cell, pull +, its clock within 3 s")
    return replace(fit, remarks=[*silent, *remarks, *_more_left(cell, run, fit), *fit.remarks])


def _with_a_number(cell: Recording) -> tuple[Recording, list[str]]:
    """The samples that have one, and what is said of the others: between neighbours a straight line stands for them."""
    there = np.isfinite(cell[FORCE])
    seconds = there.mean() * (cell.time_s[-1] - cell.time_s[0])
    if seconds < LEAST_S:
        raise RecordingError(f"{cell.name}: less than {LEAST_S:g} s with a number in {FORCE}: {seconds:.0f} s")
    if there.all():
        return cell, []
    columns = {"time_s": cell.time_s[there], FORCE: cell[FORCE][there]}
    said = f"{cell.name}: {np.count_nonzero(~there)} of {len(cell)} samples have no number and are left out"
    return make_recording(cell.name, columns), [said]


def _more_left(cell: Recording, run: Run, fit: TetherFit) -> list[str]:
    """A line where the numbers leave far more than the models' errors: the record is not all of this run."""
    own_n = float(np.linalg.norm(run.model_std_n))
    if fit.after_n < MUCH * own_n:
        return []
    said = f"{fit.after_n:.0f} N RMS left, of the mounts' own errors {own_n:.0f} N"
    return [f"{cell.name}: {said}: did the rope slip, or the cell, and is it this run's? The intervals may not hold"]


def _of_the_cell(solved: Solved, run: Run, cell_std: float) -> Solved:
    """With what its scale may be off by: every engine's gain by the same."""
    first, covariance = places(run)["gain"], solved.covariance.copy()
    gains = slice(first, first + len(run.engines))
    covariance[gains, gains] += cell_std**2
    return solved._replace(covariance=covariance)


def _design(run: Run) -> Floats:
    """Columns of NAMES."""
    moves_n_s = np.gradient(np.nansum(run.force_n * run.runs, axis=1)) * run.rate_hz
    return np.column_stack((*columns(run, run.runs).values(), np.ones(len(run.force_n)), moves_n_s))


def _known(run: Run, prior: Floats) -> _Known:
    """The priors, and every mount whose engine was shut down: it carries nothing."""
    known = _Known(np.diag(prior**-2.0), np.zeros(len(prior)))
    for i, std_n in enumerate(run.model_std_n):
        rows = run.stopped[:, i] & np.isfinite(run.force_n[:, i])
        if rows.any():
            alone = np.zeros_like(run.runs)
            alone[rows, i] = True
            stood = np.column_stack((*columns(run, alone).values(), np.zeros((len(alone), 2))))
            row = np.nansum(stood, axis=0) / rows.sum() / std_n
            known.matrix[:] += np.outer(row, row)
            known.vector[:] -= row * run.force_n[rows, i].mean() / std_n
    return known


def _prior(run: Run, installation: Installation, design: Floats) -> Floats:
    """One sigma of every column's number."""
    settings = section(installation.config.fusion, FusionSettings, "fusion")
    n_e, n_m, at = len(run.engines), len(run.mounts), places(run)
    rubs_n = settings.mount_friction_std_n * np.sqrt(np.bincount(run.engine_of))
    most_n = np.nanmax(np.abs(design[:, at["friction"] : at["beyond"]]), axis=0)
    stds = {
        "gain": [ENGINE_STD] * n_e, "own": [hypot(settings.mount_stiffness_std, scale) for scale, _ in run.line_stds],
        "zero": [HELD_STD_MM] * n_m, "growth": [GROWS_MM_K] * n_e,
        "bow": [STRAIGHT_MM if each else BOW_STD_MM for each in run.straight],
        "friction": (rubs_n / np.maximum(most_n, rubs_n)).tolist(), "beyond": [IN_SHEAR_STD] * n_m,
        "cell": [CELL_ZERO_N], "clock": [LAG_STEP_S],
    }  # fmt: skip
    return np.concatenate([stds[name] for name in NAMES])


def _fit(
    design: Floats, known: _Known, wanted_n: Floats, rate_hz: float, errors_n: Floats
) -> tuple[Floats, Floats, float]:
    """(numbers, their covariance, RMS of what is left); `wanted_n`: cell minus models, NaN where it does not count.

    `errors_n` (n, k): what the numbers take on and the residuals do not show, one sigma each. The noise is what is
    left and what the numbers may be wrong by, or they take for theirs what is noise (EM: Bishop, ch. 9.3.4).
    """
    good = np.isfinite(wanted_n) & np.isfinite(design).all(axis=1)
    a, y = design[good], wanted_n[good]
    n_slow = max(round(SLOW_S * rate_hz), 1)
    levels = max(len(y) // n_slow, 1)
    slow_a, slow_y = (np.array([part.mean(axis=0) for part in np.array_split(each, levels)]) for each in (a, y))
    squares, moments = a.T @ a, a.T @ y
    variance, before = float(np.var(y)), np.inf
    while abs(variance - before) > SAME * variance:
        before = variance
        covariance = np.asarray(np.linalg.inv(squares / variance + known.matrix))
        mean = np.asarray(covariance @ (moments / variance + known.vector))
        left = y - a @ mean
        fast = float(np.mean(left**2) + np.sum(squares * covariance) / len(y))
        slow = float(np.mean((slow_y - slow_a @ mean) ** 2) + np.sum((slow_a @ covariance) * slow_a) / levels)
        variance = max(fast, n_slow * slow, 1.0)
    taken = covariance @ (a.T @ errors_n[good]) / variance
    scattered = as_blocks_scatter(covariance, a * left[:, None] / variance, n_slow)
    return mean, scattered + taken @ taken.T, rms(left)


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
