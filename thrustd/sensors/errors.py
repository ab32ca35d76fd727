"""What the sources of an engine's thrust may be wrong by when all is well: one covariance for all rows of the past.

    mounts    of one mount and of both, as large as the mounts say themselves; the share that each one carries
    deck      the engine's own deviation; the deck's shape
    lines     ln w(N1), ln w(N2) against the fuel flow w: an engine's appetite, which both show, and each one's own
    lag       of a thrust that moves; a fuel flow that leads it; mounts that see a cut before any spool is read

Each is a Gaussian process, exp(-time / its own - travel / its reach), with its prior sigma: nothing is learnt beyond.
What no bench shows of an installation acts on both mounts alike: a zero, a scale, the drag of a nacelle, a cant, mass.

    a(r1, r2) = zero^2 + scale^2 F1 F2 + drag^2 q1 q2 + cant^2 (f_z1 - 1)(f_z2 - 1) + mass^2 f_x1 f_x2
              + rest^2 [r1 = r2]

and to opposite sides: the share that each carries, and of a mass that is off the couple of the weight.

Sizes: docs/fusion.md, those of the installation: the aircraft's file.
"""

from math import exp, sqrt

import numpy as np

from thrustd.core.aircraft import UNKNOWN, Installed
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.past import (
    ALONG_G,
    COMMON_N,
    COUNTS,
    DECK_N,
    FUEL_FLOW,
    FUEL_RATE_N_S,
    LEVEL_N,
    LOG_FLOW,
    MACH,
    MORE_G,
    MOUNT_RATE_N_S,
    N1,
    N_SOURCES,
    OWN_N,
    PER_FUEL_N,
    PRESSURE_PA,
    RATE_N_S,
    T_S,
)  # fmt: skip

Parts = tuple[float, float, float, float, float]
AS_ON_THE_BENCH = Installed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, UNKNOWN.share, 0.0)
THRUST_N2 = 1e9  # prior variance of the thrust of a row: anything, and no thrust is likelier than another
SILENT_N2 = 1e9
# errors of all that is well; mounts' sigmas and the deck's come with the row
REST_S, REACH_N = 600.0, 3000.0  # as the filter's: friction is another at another thrust
ENGINE, ENGINE_S = 0.02, 7200.0  # of the thrust: engine against deck
# of ln w, by maximum likelihood from six recorded flights, each against the other engine's lines fitted without it
APPETITE, LINE = 0.048, (0.024, 0.024)
REACH, REACH_MACH = (
    0.6,
    0.6,
)  # in ln w and Mach: a deck and its lines err otherwise at another operating point, not later
LEAST_DECK_N = 40.0
WHITE_N = (10.0, 10.0, 20.0, 20.0, 30.0)  # of a row
LAG_S, LAG_LASTS_S = (0.15, 0.15, 2.5, 0.6, 1.0), 4.0  # lead or lag of a thrust that moves
FUEL_LEADS_S = 0.5  # of its own rate
MOUNTS_LEAD_S = 0.7  # of theirs, against all of the brochure


@compiled
def _fill_pair(rows: Floats, a: int, b: int, installed: Installed, block: Floats) -> None:
    """Covariance (5, 5) of the errors that last, of two rows."""
    dt_s, moved_n = abs(rows[a, T_S] - rows[b, T_S]), abs(rows[a, LEVEL_N] - rows[b, LEVEL_N])
    rest = exp(-dt_s / REST_S - moved_n / REACH_N)
    level_a, level_b = abs(rows[a, LEVEL_N]), abs(rows[b, LEVEL_N])
    shared_n2 = installed.share**2 * level_a * level_b
    shared_n2 += installed.couple_n_g**2 * rows[a, MORE_G] * rows[b, MORE_G]
    block[:] = 0.0
    for i in range(2):
        for j in range(2):
            block[i, j] = rest * rows[a, COMMON_N + i] * rows[b, COMMON_N + j]
            block[i, j] += shared_n2 if i == j else -shared_n2
        block[i, i] += rest * rows[a, OWN_N + i] * rows[b, OWN_N + i]
    engine_n2 = ENGINE**2 * level_a * level_b
    shape_a = sqrt(max(rows[a, DECK_N] ** 2 - (ENGINE * level_a) ** 2, LEAST_DECK_N**2))
    shape_b = sqrt(max(rows[b, DECK_N] ** 2 - (ENGINE * level_b) ** 2, LEAST_DECK_N**2))
    far = abs(rows[a, LOG_FLOW] - rows[b, LOG_FLOW]) / REACH + abs(rows[a, MACH] - rows[b, MACH]) / REACH_MACH
    here = exp(-far - dt_s / ENGINE_S)
    block[FUEL_FLOW:, FUEL_FLOW:] = engine_n2 * exp(-dt_s / ENGINE_S) + here * shape_a * shape_b
    line_n2 = here * rows[a, PER_FUEL_N] * rows[b, PER_FUEL_N]
    for i in range(2):
        for j in range(2):
            block[N1 + i, N1 + j] += APPETITE**2 * line_n2
        block[N1 + i, N1 + i] += LINE[i] ** 2 * line_n2


@compiled
def _add_lag(rows: Floats, a: int, b: int, block: Floats) -> None:
    """Of a thrust that moves."""
    lasts = exp(-abs(rows[a, T_S] - rows[b, T_S]) / LAG_LASTS_S)
    for i in range(N_SOURCES):
        block[i, i] += LAG_S[i] ** 2 * lasts * rows[a, RATE_N_S] * rows[b, RATE_N_S]
    block[FUEL_FLOW, FUEL_FLOW] += FUEL_LEADS_S**2 * lasts * rows[a, FUEL_RATE_N_S] * rows[b, FUEL_RATE_N_S]
    lead_n2 = MOUNTS_LEAD_S**2 * lasts * rows[a, MOUNT_RATE_N_S] * rows[b, MOUNT_RATE_N_S]
    for i in range(FUEL_FLOW, N_SOURCES):
        for j in range(FUEL_FLOW, N_SOURCES):
            block[i, j] += lead_n2


@compiled
def as_on_the_bench(installed: Installed) -> Installed:
    """Without all that no bench shows."""
    return Installed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, installed.share, installed.couple_n_g, 0.0, 0.0, 0.0)


@compiled
def as_unmeasured(installed: Installed) -> Installed:
    """With zeros and scales as unsure as before a run told them: rubber softens, a gap grows, no nacelle changes."""
    zero_n, scale = max(installed.zero_n, installed.zero_before_n), max(installed.scale, installed.scale_before)
    return Installed(
        zero_n, scale, installed.drag_m2, installed.rest_n, installed.cant_n_g, installed.inertia_n_g,
        installed.share, installed.couple_n_g, installed.told_scale, zero_n, scale,
    )  # fmt: skip


@compiled
def installed_n2(rows: Floats, a: int, b: int, installed: Installed) -> float:
    """Covariance of what an installation does to both mounts of an engine in two rows."""
    of_load_n2 = installed.scale**2 * abs(rows[a, LEVEL_N] * rows[b, LEVEL_N])
    of_air_n2 = installed.drag_m2**2 * rows[a, PRESSURE_PA] * rows[b, PRESSURE_PA]
    of_weight_n2 = installed.cant_n_g**2 * rows[a, MORE_G] * rows[b, MORE_G]
    of_mass_n2 = installed.inertia_n_g**2 * rows[a, ALONG_G] * rows[b, ALONG_G]
    rest_n2 = installed.rest_n**2 if a == b else 0.0
    return installed.zero_n**2 + of_load_n2 + of_air_n2 + of_weight_n2 + of_mass_n2 + rest_n2


@compiled
def covariance(rows: Floats, n: int, parts: Parts, installed: Installed) -> Floats:
    """Of all that n rows say, (5 n, 5 n); the thrust of a row, of which a source shows its part, may be anything."""
    c, block = np.empty((n * N_SOURCES, n * N_SOURCES)), np.empty((N_SOURCES, N_SOURCES))
    for a in range(n):
        for b in range(a + 1):
            _fill_pair(rows, a, b, installed, block)
            _add_lag(rows, a, b, block)
            of_both_n2 = installed_n2(rows, a, b, installed)
            for i in range(2):
                for j in range(2):
                    block[i, j] += parts[i] * parts[j] * of_both_n2
            for i in range(N_SOURCES):
                for j in range(N_SOURCES):
                    if rows[a, COUNTS + i] == 0.0 or rows[b, COUNTS + j] == 0.0:
                        block[i, j] = 0.0
                    elif a == b:
                        block[i, j] += parts[i] * parts[j] * THRUST_N2
                    c[a * N_SOURCES + i, b * N_SOURCES + j] = c[b * N_SOURCES + j, a * N_SOURCES + i] = block[i, j]
        for i in range(N_SOURCES):
            at = a * N_SOURCES + i
            c[at, at] += WHITE_N[i] ** 2 if rows[a, COUNTS + i] != 0.0 else SILENT_N2
    return c
