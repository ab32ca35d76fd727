"""How the twin's engines hang in their aircraft, by the twin's own statics, and what of it no model knows.

The engine is a rigid body on three linear springs: front upper, front lower, rear (thesis tables 4.1 and 4.4; origin
at the centre of gravity, x forward, y inboard, z up). Under a force through the centre of gravity and its moment it
settles where virtual displacements do no work; what each front mount then carries along x is its column of `loads`:

    carried_i = a_i (T - D q S) + b_i m g0 f_x + c_i n + d_i f_y

with f the specific force at the centre of gravity; transducers are rigged to zero at 1 g. The accelerometer sits
elsewhere in the aircraft and feels, besides,

    f_sensor = f + (omega_dot x r + omega x (omega x r)) / g0,      r: from centre of gravity to sensor
"""

from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats

ARMS_M = ((0.2639, -0.2891, 0.2355), (0.2761, -0.2631, -0.1090), (-0.3901, -0.3675, 0.0335))
RATES_N_M = ((5.079e6, 1.646e6, 1.646e6), (5.954e6, 1.926e6, 1.926e6), (0.0, 8.75e5, 8.75e5))
MASS_KG, G0_M_S2 = 373.0, 9.80665
BOW_RANGE_MM = 1.6


class Knobs(NamedTuple):
    """What may be different from what the models know; the plain installation has none of it."""

    statics: bool = False  # loads by the statics above; else the mounts move together and weight makes no couple
    thrust_line_mm: float = 0.0  # of thrust above the centre of gravity
    drag_m2: float = 0.0  # of a nacelle: drag area behind the mounts
    zero_mm: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    scale: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # of a transducer, relative
    bow_mm: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # a parabola in its line
    expansion_mm_k: float = 0.0  # between transducer and mount
    cant_deg: float = 0.0  # of the mounts' axis, nose up against the engine's
    share: float = 0.0  # added to the upper mount's part
    stiffness: float = 0.0  # of the mounts against those of the bench, relative
    arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the accelerometer
    accel_zero_g: float = 0.0


PLAIN = Knobs()


def hostile(seed: int) -> Knobs:
    """An installation nobody modelled, drawn from a seed: sizes as large as they were found or estimated."""
    rng = np.random.default_rng([seed, 6])

    def four(spread: float) -> tuple[float, float, float, float]:
        a, b, c, d = (spread * rng.standard_normal(4)).tolist()
        return a, b, c, d

    return Knobs(
        drag_m2=float(rng.uniform(0.0, 0.04)),
        zero_mm=four(0.015),
        scale=four(0.005),
        bow_mm=four(0.012),
        expansion_mm_k=float(0.0005 * rng.standard_normal()),
        cant_deg=float(rng.standard_normal()),
        share=float(0.01 * rng.standard_normal()),
        arm_m=(float(rng.uniform(0.0, 3.0)), 0.0, float(rng.uniform(-0.5, 0.5))),
        accel_zero_g=float(0.003 * rng.standard_normal()),
    )


def loads() -> Floats:
    """x force on the mounts (3, 4) per newton of: thrust, thrust's moment per mm above the CG, -z and y force."""
    virtual = []  # displacement of every mount under each of the six motions: (3, 3, 6)
    for x, y, z in ARMS_M:
        turn = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
        virtual.append(np.hstack((np.eye(3), -np.array(turn))))
    shape, rates = np.stack(virtual), np.array(RATES_N_M)
    stiff = np.einsum("mik,mi,mil->kl", shape, rates, shape)
    pulls = np.zeros((6, 4))
    pulls[0, 0] = 1.0
    pulls[4, 1] = 1e-3  # thrust times its arm: nose down for a line above the centre of gravity
    pulls[2, 2] = -1.0
    pulls[1, 3] = 1.0
    motion = np.linalg.solve(stiff, pulls)
    return np.asarray(rates[:, :1] * np.einsum("mk,kl->ml", shape[:, 0, :], motion))


def carried_parts(
    upper_share: float, knobs: Knobs, thrust_n: Floats, accel_g: Floats, pressure_pa: Floats | float
) -> Floats:
    """What the two mounts of an engine carry (2, n): thrust (n,), specific force (3, n), dynamic pressure (n,)."""
    weight_n = MASS_KG * G0_M_S2
    along_n = thrust_n - knobs.drag_m2 * pressure_pa
    lean = np.sin(np.radians(knobs.cant_deg))
    inertia_n = weight_n * (accel_g[0] + lean * accel_g[2])
    share = upper_share + knobs.share
    parts = np.array([[share], [1.0 - share]])
    out = parts * (along_n - inertia_n)
    if knobs.statics:
        column = loads()[:2]
        out = column[:, :1] * (along_n - inertia_n) + knobs.thrust_line_mm * column[:, 1:2] * along_n
        out = out + weight_n * (column[:, 2:3] * accel_g[2] - column[:, 3:4] * accel_g[1])
    return np.asarray(out)


def felt_g(accel_g: Floats, rates_deg_s: Floats, time_s: Floats, knobs: Knobs) -> Floats:
    """What the accelerometer feels (3, n), ICD signs, of specific force and body rates pitch, roll, yaw."""
    pitch, roll, yaw = np.radians(rates_deg_s)
    omega = np.stack((roll, pitch, yaw))  # forward, right, down: right-handed
    turning = np.gradient(omega, time_s, axis=1)
    x, y, z = knobs.arm_m
    arm = np.array([x, y, -z])[:, None] * np.ones_like(omega)
    extra = np.cross(turning, arm, axis=0) + np.cross(omega, np.cross(omega, arm, axis=0), axis=0)
    signs = np.array([[1.0], [1.0], [-1.0]])  # up is positive in what is sent
    felt = accel_g + signs * extra / G0_M_S2
    felt[0] += knobs.accel_zero_g
    return np.asarray(felt)


def seen_mm(mount: int, deformation_mm: Floats, temperature_degc: Floats, knobs: Knobs) -> Floats:
    """What stands between a mount's deformation (n,) and its transducer's zero and noise."""
    expanded = deformation_mm + knobs.expansion_mm_k * (temperature_degc - 20.0)
    along = expanded / BOW_RANGE_MM
    bowed = expanded + 4.0 * knobs.bow_mm[mount] * along * (1.0 - along)
    return np.asarray(bowed * (1.0 + knobs.scale[mount]) + knobs.zero_mm[mount])
