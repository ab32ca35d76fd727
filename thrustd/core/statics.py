"""An engine on its mounts: what each carries along the engine, by the statics of a rigid body on linear springs.

    K q = P,      K = sum over mounts of B' diag(k) B,   B = [I, -(r x)]      q: 3 displacements, 3 small rotations
    carried = k_x times the x displacement of the mount

r: mount from the engine's centre of gravity, at_mm - centre_of_gravity_mm (x forward, y inboard, z up), m; k: spring
rates in x, y, z. Springs are linear and have no stiffness against rotation; rubber stiffens under load, so a share is
that of small loads.

Without one mount the engine may turn about the line through the others, which hold nothing about it:  K q = P has no
solution. The forces f on the mounts that are left balance P but for a moment M about that line, B' f + M = P, which
whatever else the engine touches has to take.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.signals import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:
    from thrustd.core.aircraft import AircraftData, MountGeometry


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
    arms = _arms_m(data, places)
    rates = np.array([place.spring_n_mm for place in places]) * 1e3
    weight_n = data.engine_mass_kg * STANDARD_GRAVITY_M_S2
    thrust, weight = (_along(arms, rates, np.array(pull)) for pull in ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    relative = data.engine_mass_std_kg / data.engine_mass_kg
    found = []
    for place, share, per_n in zip(places, thrust.tolist(), weight.tolist(), strict=True):
        one_g_n = weight_n * per_n
        found.append(Carried(place.name, share, one_g_n, abs(one_g_n) * relative))
    return found


def held(data: "AircraftData") -> bool:
    """Whether the mounts leave an engine no motion."""
    stiff = np.array([place.spring_n_mm for place in data.mounts]).ravel() > 0.0
    return int(np.linalg.matrix_rank(_shape(_arms_m(data, data.mounts)).reshape(-1, 6)[stiff])) == 6


class Left(NamedTuple):
    """What one mount has to carry when another is lost, along the engine."""

    lost: str
    mount: str
    thrust_share: float
    thrust_turns_m: float  # moment about the line that nothing holds, per newton of thrust
    weight_turns_nm: float  # the same of the weight at 1 g


def left_over(data: "AircraftData") -> list[Left]:
    """By lost mount, those that carry thrust then; empty where the file has no geometry."""
    found = []
    weight_n = data.engine_mass_kg * STANDARD_GRAVITY_M_S2
    for lost in data.mounts if len(data.mounts) > 1 else ():
        kept = [place for place in data.mounts if place is not lost]
        held = np.array([place.spring_n_mm for place in kept]).ravel() > 0.0
        shape = _shape(_arms_m(data, kept)).reshape(-1, 6)[held]
        free = np.linalg.svd(shape)[2][np.linalg.matrix_rank(shape) :]
        turns = np.array([np.concatenate((np.zeros(3), one[3:])) / max(np.linalg.norm(one[3:]), 1e-9) for one in free])
        rows = np.vstack((shape, turns.reshape(-1, 6))).T
        pulls = np.zeros((6, 2))
        pulls[0, 0], pulls[2, 1] = 1.0, -weight_n
        forces = np.linalg.lstsq(rows, pulls, rcond=None)[0]
        along = np.zeros(held.size)
        along[held] = forces[: held.sum(), 0]
        moment, weight = np.abs(forces[held.sum() :]).max(axis=0, initial=0.0).tolist()
        shares = along.reshape(-1, 3)[:, 0].tolist()
        found += [Left(lost.name, place.name, s, moment, weight) for place, s in zip(kept, shares, strict=True) if s]
    return found


def _arms_m(data: "AircraftData", places: "Sequence[MountGeometry]") -> Floats:
    """From the centre of gravity (n, 3)."""
    return (np.array([place.at_mm for place in places]) - np.array(data.centre_of_gravity_mm)) / 1e3


def _shape(arms: Floats) -> Floats:
    """B of every mount (n, 3, 6)."""
    turned = [((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)) for x, y, z in arms.tolist()]
    return np.stack([np.hstack((np.eye(3), np.array(each))) for each in turned])


def _along(arms: Floats, rates: Floats, pull: Floats) -> Floats:
    """x force on every mount (n,) of a force at the centre of gravity."""
    shape = _shape(arms)
    stiff = np.einsum("mik,mi,mil->kl", shape, rates, shape)
    load = np.concatenate((pull, np.zeros(3)))
    motion = np.linalg.solve(stiff, load)
    return np.asarray(rates[:, 0] * (shape @ motion)[:, 0])
