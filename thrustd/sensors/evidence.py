"""How likely each hypothesis makes what the sources said, and the thrust that it says: one Gaussian for all rows.

    y = H T + e,  T of every row anything;  e ~ N(0, C) of errors that last, each with its own prior sigma, time and
                                            reach in thrust: mounts' own and common ones, deck, lines of N1 and N2
    hypothesis    y = H T + e + V b,  b ~ N(0, B):  what its sensors say besides, in the rows since its onset

No error is a state that readings are averaged for: a sigma is that of the error however long it is looked at, so
nothing is learnt beyond its prior. With A = C^-1, z = A y, G = V' A V, g = V' z, B = L L' and M = 1 + L' G L

    ln p(y | hypothesis) - ln p(y | all well) = (w' w - ln det M) / 2,     w = M^-1/2 L' g
    T0 = c' (z - A V L M^-1 L' g),   c = cov(T0, y)                        (Woodbury)

summed over onsets (the newest row, the newest two, ... all) and sizes, gradual or sudden. No thrust jumps (see
`jumps`): what mounts jumped by at the onset is one more reading, d = pattern b + noise, of a sudden fault alone, unless
the aircraft was shaken, which is as likely as the fault. Reference: Rasmussen & Williams, Gaussian
Processes for Machine Learning, ch. 2.7 and A.3; Brown & Hwang, ch. 9.3 (multiple model adaptive estimation).
"""

from math import erfc, exp, log, sqrt
from typing import Any

import numpy as np

from thrustd.core.aircraft import Installed
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.core.measures import SIGMAS_95
from thrustd.sensors.errors import THRUST_N2, Parts, as_on_the_bench, as_unmeasured, covariance, installed_n2
from thrustd.sensors.fault_shape import FAULT_S, LASTING_S, by_mounts_n, fault_shape, installed_shape
from thrustd.sensors.motion import SILENT, Motion, beside
from thrustd.sensors.onsets import (
    BLED,
    INSTALLED_OFF,
    LEAST_P,
    MORE,
    N_ALONE,
    N_HYPOTHESES,
    SCALE_OFF,
    SOMEBODY,
    STAYS,
    UNFAILED,
    WELL,
    Scene,
    Told,
    leave,
    of_installation,
    of_onsets,
    of_scale,
    of_stretches,
)
from thrustd.sensors.past import COUNTS, FUEL_FLOW, LEVEL_N, N_SOURCES, PRESSURE_PA, SAID
from thrustd.sensors.positive import factor_large, forward, inverse

# of an engine that turns: ram drag of 10 kg/s at flight idle, less what is left of the gross thrust; of one that burns
# nothing 0.045 m2 of dynamic pressure (see `brochure.windmilling`) and twice its sigma
LEAST_N, WINDMILLS_M2 = -200.0, 0.08


@compiled
def _solve(
    rows: Floats, n: int, parts: Parts, installed: Installed, motion: Motion, out: Floats
) -> tuple[Floats, Floats, Floats]:
    """All is well: A, z = A y and A c; its thrust and variance go into `out`."""
    c = covariance(rows, n, parts, as_on_the_bench(installed))
    y, to_n2 = np.empty(n * N_SOURCES), np.zeros(n * N_SOURCES)
    for i in range(len(y)):
        y[i] = rows[i // N_SOURCES, SAID + i % N_SOURCES]
    for s in range(N_SOURCES):
        to_n2[s] = parts[s] * THRUST_N2 if rows[0, COUNTS + s] != 0.0 else 0.0
    if motion.weight_n > 0.0:
        c, y, to_n2 = beside(c, y, to_n2, rows, n, parts, motion)
    a = inverse(c)
    z, ac = np.zeros(len(y)), np.zeros(len(y))
    for i in range(len(y)):
        for j in range(len(y)):
            z[i] += a[i, j] * y[j]
            ac[i] += a[i, j] * to_n2[j]
    out[WELL] = 0.0, np.sum(to_n2 * z), max(THRUST_N2 - np.sum(to_n2 * ac), 1.0)
    return a, z, ac


@compiled
def log_pushes(thrust_n: float, variance_n2: float, pressure_pa: float) -> float:
    """ln of the probability that this is a thrust: an engine that turns does not pull by more than its drag."""
    least_n = LEAST_N - WINDMILLS_M2 * pressure_pa
    return log(max(0.5 * erfc((least_n - thrust_n) / sqrt(2.0 * variance_n2)), LEAST_P))


@compiled
def sum_up(logs: Floats, said: Floats, row: Floats) -> None:
    """Onsets and sizes (k,) of one hypothesis, what they say (k, 2): ln of its evidence, thrust, variance."""
    most, total, mean_n, mean_n2 = logs.max(), 0.0, 0.0, 0.0
    for i in range(len(logs)):
        p = exp(logs[i] - most)
        total += p
        mean_n += p * said[i, 0]
        mean_n2 += p * (said[i, 1] + said[i, 0] ** 2)
    mean_n, mean_n2 = mean_n / total, mean_n2 / total
    row[0], row[1], row[2] = most + log(total), mean_n, max(mean_n2 - mean_n**2, 1.0)


@compiled
def _said(rows: Floats, n: int, parts: Parts, off: Floats, installed: Installed) -> tuple[float, float]:
    """All is well: thrust of the newest row, its variance. `off` (N_SOURCES,): 1 of a source that is excluded."""
    seen, size = rows[:n].copy(), n * N_SOURCES
    for s in range(N_SOURCES):
        if off[s] != 0.0:
            seen[:, COUNTS + s] = 0.0
    low, y, c = covariance(seen, n, parts, installed), np.zeros(size), np.zeros(size)
    factor_large(low)
    for i in range(size):
        y[i] = seen[i // N_SOURCES, SAID + i % N_SOURCES]
    for s in range(N_SOURCES):
        c[s] = parts[s] * THRUST_N2 if seen[0, COUNTS + s] != 0.0 else 0.0
    forward(low, y)
    forward(low, c)
    return float(np.sum(c * y)), float(THRUST_N2 - np.sum(c * c))


@compiled
def uncorrected_n2(rows: Floats, n: int, share: float, off: Floats, installed: Installed, said: Floats) -> float:
    """What the thrust that leads may be wrong by because nobody corrected the installation: a variance more.

        u(m, v) = v + (m - thrust)^2 - variance      m, v: thrust, variance if the installation errs as its prior
        max(u of all sources, min(u of the brochure alone, what the installation does to the mounts), u of a change,
            u of a fault of both mounts)

    of all sources    v max(1, d^2 / var d) for v, d: the thrust by the mounts alone less that by the brochure alone
    of a change       ((|m - thrust| + 1.96 sqrt(v)) / 3)^2 - variance, m and v as before a tethered run
    of a fault        ((|m - thrust| + sqrt(v)) / 3)^2 - variance, m and v by the brochure alone

    Mounts and brochure that agree prove no more than the better of both: nobody knows how their errors go together.
    Where they differ by more than they should, somebody's sigma is too small, and a mean of both has no smaller one.
    Agreement within the deck's own error proves no nacelle without drag: the prior is not weighed against the bench's.
    Nor does it prove that nothing has changed since it was measured. That is a fault, so rare that no mixture holds it;
    but it is there for the whole flight, so three sigmas hold the 95 % that were there before a run told the mounts.
    A fault of both mounts since then is as rare (`onsets.NEW`), and only the brochure sees it: three sigmas hold one of
    its own around it, beyond which one such fault in six is. Without a brochure nobody says.
    `off` (N_SOURCES,): 1 of a source that is excluded; `said`: thrust and variance as installed on the bench.
    Reference: JCGM 100:2008 (GUM), F.2.4.5, uncorrected systematic effects; Julier & Uhlmann 1997 (covariance
    intersection); Birge, Phys. Rev. 40 (1932) 207 (means of what does not agree); Brown & McBurney, Navigation 35
    (1988) 41 (solution separation).
    """
    parts = share, 1.0 - share, 1.0, 1.0, 1.0
    by_mounts, by_brochure = off.copy(), off.copy()
    by_mounts[FUEL_FLOW:], by_brochure[:FUEL_FLOW] = 1.0, 1.0
    mean_n, all_n2 = _said(rows, n, parts, off, installed)
    mounts_n, mounts_n2 = _said(rows, n, parts, by_mounts, installed)
    brochure_n, brochure_n2 = _said(rows, n, parts, by_brochure, installed)
    apart2 = max((mounts_n - brochure_n) ** 2 / (mounts_n2 + brochure_n2), 1.0)
    together_n2 = all_n2 * apart2 + (mean_n - said[0]) ** 2 - said[1]
    alone_n2 = brochure_n2 + (brochure_n - said[0]) ** 2 - said[1]
    changed_n, changed_n2 = _said(rows, n, parts, off, as_unmeasured(installed))
    changed_n2 = ((abs(changed_n - said[0]) + SIGMAS_95 * sqrt(changed_n2)) / 3.0) ** 2 - said[1]
    failed_n2 = ((abs(brochure_n - said[0]) + sqrt(brochure_n2)) / 3.0) ** 2 - said[1]
    if not np.any(rows[0, COUNTS + FUEL_FLOW : COUNTS + N_SOURCES] * (1.0 - off[FUEL_FLOW:]) > 0.0):
        failed_n2 = 0.0
    return max(together_n2, min(installed_n2(rows, 0, 0, installed), alone_n2), changed_n2, failed_n2, 0.0)


@compiled
def evidence(
    rows: Floats, n: int, share: float, found: int, installed_as: Installed, motion: Motion, out: Floats
) -> Scene:
    """By hypothesis that an engine has alone ln of its evidence, prior included, thrust, variance: `out` (n, 3).

    `found`: the hypothesis that led so far, or SOMEBODY; a fault stays unless it is refuted. `motion`: SILENT, or see
    `beside`.
    """
    parts = share, 1.0 - share, 1.0, 1.0, 1.0
    a, z, ac = _solve(rows, n, parts, installed_as, motion, out)
    is_one = WELL < found < N_ALONE or found == SOMEBODY
    out[WELL, 0] = log(1.0 - STAYS) if is_one else 0.0  # a fault that was found leaves all others less
    pressure_pa = rows[0, PRESSURE_PA]
    well = log_pushes(out[WELL, 1], out[WELL, 2], pressure_pa)
    level_n = rows[:n, LEVEL_N].copy()
    since, always = fault_shape(rows, level_n, FAULT_S), fault_shape(rows, level_n, LASTING_S)
    stands = fault_shape(rows, by_mounts_n(rows, n), FAULT_S)
    scene = Scene(rows, n, parts, a, z, ac, since, stands, always, installed_shape(rows, n, installed_as), found)
    most = max(6 * n, n * (n + 1) // 2)
    told = Told(np.empty(most), np.empty((most, 2)), np.zeros(1, np.int64))
    for which in range(1, N_ALONE):
        told.n[0] = 0
        if which == BLED:
            of_stretches(scene, told)
        elif which == SCALE_OFF:
            of_scale(scene, installed_as, told)
        elif which == INSTALLED_OFF:
            of_installation(scene, told)
        else:
            of_onsets(which, scene, told)
        logs, said = told.logs[: told.n[0]], told.said[: told.n[0]]
        others = log(MORE) if found == SOMEBODY and which not in UNFAILED else out[WELL, 0]
        for i in range(told.n[0]):
            logs[i] += 0.0 if which == found else others
            said[i, 0], said[i, 1] = out[WELL, 1] + said[i, 0], out[WELL, 2] + said[i, 1]
            logs[i] += log_pushes(said[i, 0], said[i, 1], pressure_pa)
        sum_up(logs, said, out[which])
    out[WELL, 0] += well
    return scene


@compiled
def weigh(rows: Floats, n: int, share: float, found: int, installed_as: Installed, heard: Any, out: Floats) -> None:
    """By hypothesis its probability, the thrust of the newest row and its variance: `out` (N_HYPOTHESES, 3).

    `heard`: of the engine, see `leave`. Of what all engines may have at once nothing is said here: see `shared`.
    """
    leave(evidence(rows, n, share, found, installed_as, SILENT, out), out, heard)
    for which in range(N_ALONE):
        out[which, 0] = exp(out[which, 0] - heard.log_alone)
    for which in range(N_ALONE, N_HYPOTHESES):
        out[which] = 0.0, out[WELL, 1], out[WELL, 2]
