"""An engine on its mounts: what each carries along the engine, by the statics of a rigid body on linear springs.

    K q = P,      K = sum over mounts of B' diag(k) B,   B = [I, -(r x)]      q: 3 displacements, 3 small rotations
    carried = k_x times the x displacement of the mount

r: mount from the engine's centre of gravity (x forward, y inboard, z up), m; k: spring rates in x, y, z. Springs are
linear and have no stiffness against rotation; rubber stiffens under load, so a share is that of small loads.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.signals import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:
    from thrustd.core.aircraft import AircraftData


class Carried(NamedTuple):
    """Of one mount, along the engine, forward +."""

    mount: str
    thrust_share: float  # of a thrust through the centre of gravity
    weight_n: float  # at 1 g, engine level
    weight_std_n: float  # by the engine's mass


def carried(data: "AircraftData") -> list[Carried]:
    """By mount of `data.mounts`, front ones first as in the file; empty where the file has no geometry."""
    places = data.mounts
    if not places:
        return []
    arms = np.array([place.at_mm for place in places]) / 1e3
    rates = np.array([place.spring_n_mm for place in places]) * 1e3
    weight_n = data.engine_mass_kg * STANDARD_GRAVITY_M_S2
    thrust, weight = (_along(arms, rates, np.array(pull)) for pull in ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    relative = data.engine_mass_std_kg / data.engine_mass_kg
    found = []
    for place, share, per_n in zip(places, thrust.tolist(), weight.tolist(), strict=True):
        one_g_n = weight_n * per_n
        found.append(Carried(place.name, share, one_g_n, abs(one_g_n) * relative))
    return found


def _along(arms: Floats, rates: Floats, pull: Floats) -> Floats:
    """x force on every mount (n,) of a force at the centre of gravity."""
    rows = []
    for x, y, z in arms:
        rows.append(np.hstack((np.eye(3), np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]))))
    shape = np.stack(rows)
    stiff = np.einsum("mik,mi,mil->kl", shape, rates, shape)
    load = np.concatenate((pull, np.zeros(3)))
    motion = np.linalg.solve(stiff, load)
    return np.asarray(rates[:, 0] * (shape @ motion)[:, 0])
