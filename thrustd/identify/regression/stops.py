"""Friction of the rubber: Prandtl-Ishlinskii stops on a fixed set of radii, as columns of a regression.

    s_i <- clip(s_i + dx, -r_i, r_i),   friction = (1 + kappa |x| / r_n) sum_i c_i s_i / r_i,   c_i, kappa >= 0

Radii are shares of the travel, spaced by ratios, down to the noise of the reading. The same elements fly as the effect
`hysteresis_stops`. A negative radius turns an element's sign: it does not resist motion, the output follows late.
"""

import numpy as np

from thrustd.model.effects.hysteresis_stops import SHARES, USUAL, advance
from thrustd.model.stage import Floats, jit


def radii_of(travel: float, least: float = 0.0) -> Floats:
    """The usual radii, and finer ones that are not below `least`."""
    radii: Floats = travel * SHARES
    return radii[(radii >= least) | (USUAL[0] <= SHARES)]


def at_rest(radii: Floats, level: float) -> Floats:
    """State (1 + n,): the deformation, then stops in units of their radius, loaded from no deformation to `level`."""
    return np.concatenate(([level], np.clip(level / radii, -1.0, 1.0)))


@jit
def run_stops(radii: Floats, state: Floats, d: Floats, out: Floats) -> None:
    """Stops s_i / r_i (n, n_stops) of the deformations d (n,); `state` moves on."""
    for k in range(d.size):
        advance(state, radii, d[k])
        for i in range(radii.size):
            out[k, i] = state[1 + i]
