"""What would tell a drift sooner than one engine's own sources: looks that the bank does not have, each at its best.

    the other engine    its deck's shape errs by the same as this one's, in a part of the variance
    body acceleration   m g0 f_x = T + T_other - D, from the take-off roll on: the other engine's thrust is known, the
                        mass to a part of it, and what a polar leaves of the drag is a Gauss-Markov error

Sigmas of the polar are the least that recordings have shown of it (docs/accuracy.md), or less.
"""

from typing import NamedTuple

import numpy as np

from thrustd.core.aircraft import Installed
from thrustd.core.columns import Floats
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.sensors.errors import ENGINE, ENGINE_S, LEAST_DECK_N, REACH, REACH_MACH, THRUST_N2, covariance
from thrustd.sensors.past import (
    ALONG_G,
    COUNTS,
    DECK_N,
    FUEL_FLOW,
    LEVEL_N,
    LOG_FLOW,
    MACH,
    N_SOURCES,
    T_S,
)  # fmt: skip

MASS_KG = 6000.0  # of the aircraft, within what its file has
WHITE_N = 84.0  # least RMS of what f_x says within 0.4 s while the throttle rests
ROLLS_MACH = 0.05  # below, brakes hold it
BRAKES_N2 = 1e9


class Look(NamedTuple):
    name: str
    alike: float = 0.0  # part of the variance of the deck's shape that both engines share
    mass: float | None = None  # sigma of the mass, relative; None: nobody asks f_x
    drag_n: float = 0.0  # sigma of what a polar leaves
    drag_s: float = 100.0


ALONE = Look("its own sources")
LOOKS = (
    ALONE,
    Look("decks half alike", alike=0.5),
    Look("decks 0.9 alike", alike=0.9),
    Look("decks alike", alike=1.0),
    Look("f_x, mass 3 %, drag 430 N", mass=0.03, drag_n=430.0),
    Look("f_x, mass 1 %, drag 300 N", mass=0.01, drag_n=300.0),
)


class Rows(NamedTuple):
    """Of one engine: what its bank remembers."""

    rows: Floats  # (n, WIDTH)
    share: float


def own_errors(seen: Rows, installed: Installed) -> Floats:
    """Of all that an engine's rows say (5 n, 5 n); its installation is as on the bench."""
    bench = Installed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, installed.share, installed.couple_n_g)
    parts = seen.share, 1.0 - seen.share, 1.0, 1.0, 1.0
    return np.asarray(covariance(seen.rows, len(seen.rows), parts, bench))


def heard(seen: Rows) -> Floats:
    """(5 n,) 1 of what counts."""
    return np.asarray(seen.rows[:, COUNTS : COUNTS + N_SOURCES] != 0.0, np.float64).ravel()


def errors_of(look: Look, engine: Rows, other: Rows, installed: Installed) -> Floats:
    """Covariance of all that a look sees; what the engine's own sources say comes first."""
    if look.mass is not None:
        return _with_acceleration(look, engine, installed)
    own = own_errors(engine, installed)
    if look.alike == 0.0:
        return own
    across = look.alike * _alike(engine, other)
    return np.block([[own, across], [across.T, own_errors(other, installed)]])


def _shape_n(rows: Floats) -> Floats:
    """One sigma of the deck's shape (n,), as the bank has it."""
    engine_n = ENGINE * np.abs(rows[:, LEVEL_N])
    return np.sqrt(np.maximum(rows[:, DECK_N] ** 2 - engine_n**2, LEAST_DECK_N**2))


def _alike(engine: Rows, other: Rows) -> Floats:
    """Covariance of what both decks' shapes do, (5 n, 5 n of the other)."""
    a, b = engine.rows, other.rows
    far = sum(np.abs(a[:, None, at] - b[None, :, at]) / by for at, by in ((LOG_FLOW, REACH), (MACH, REACH_MACH)))
    here = np.exp(-far - np.abs(a[:, None, T_S] - b[None, :, T_S]) / ENGINE_S)
    both = np.zeros((len(a), N_SOURCES, len(b), N_SOURCES))
    both[:, FUEL_FLOW:, :, FUEL_FLOW:] = (here * np.outer(_shape_n(a), _shape_n(b)))[:, None, :, None]
    whole = both.reshape(len(a) * N_SOURCES, -1)
    return np.asarray(whole * np.outer(heard(engine), heard(other)))


def _with_acceleration(look: Look, engine: Rows, installed: Installed) -> Floats:
    """With a sixth source, f_x in each row (6 n, 6 n)."""
    assert look.mass is not None
    rows, n = engine.rows, len(engine.rows)
    own_n = look.mass * MASS_KG * STANDARD_GRAVITY_M_S2 * rows[:, ALONG_G]
    lasts = np.exp(-np.abs(rows[:, None, T_S] - rows[None, :, T_S]) / look.drag_s)
    of_each = np.where(rows[:, MACH] < ROLLS_MACH, BRAKES_N2, 0.0) + WHITE_N**2 + THRUST_N2
    fx = np.outer(own_n, own_n) + look.drag_n**2 * lasts + np.diag(of_each)
    parts = np.array((engine.share, 1.0 - engine.share, 1.0, 1.0, 1.0)) * THRUST_N2
    across = np.zeros((n, N_SOURCES, n))
    across[np.arange(n), :, np.arange(n)] = parts  # the row's thrust, which may be anything
    shown = across.reshape(n * N_SOURCES, n) * heard(engine)[:, None]
    return np.block([[own_errors(engine, installed), shown], [shown.T, fx]])
