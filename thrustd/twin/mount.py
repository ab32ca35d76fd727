"""The simulated mount: force in, deformation out. Its own physics, shared with no model under test.

Quasi-linear viscoelasticity (Fung) with internal friction. The rubber's deformation x [mm] obeys

    F / s = f(x) + sum_i g_i q_i + sum_j P_j(x) + D(x) + c dx/dt        f(x) = k1 x + k3 x^3
    dq_i/dt = df/dt - q_i / tau_i                                       relaxation (Prony series)
    P_j = clamp(P_j + k_j dx, -y_j, y_j)                                Jenkins elements: internal friction
    dD/dx = sigma (1 - sgn(dx) D / D_c)                                 Dahl element, off unless asked for

with s the stiffness factor (temperature, ageing, ...), and the transducer sees x + F / k_bracket + offset. Within one
step f(x) is taken as a ramp, so the relaxation terms are exact at any sample rate; the step is solved for x by Newton
on a monotone function. Forward thrust loads the mount positively.

Magnitudes: fore and aft spring rates of the thesis, table 4.1 (5079 and 5954 N/mm), dynamic ones of table 4.2
(28 and 24 % more at 20 Hz), friction that keeps a step ten minutes long from returning to the centre line (fig. 12.6).
"""

from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

REFERENCE_DEG_C = 20.0
SOLVED_MM = 1e-10  # Newton stops here: a thousandth of one LVDT count
MAX_NEWTON = 60
BRACKET_N_MM = 90e3


class MountPhysics(NamedTuple):
    """One mount. Times in s, forces in N, deformations in mm."""

    stiffness_n_mm: float  # k1, relaxed, at zero force
    cubic_n_mm3: float  # k3
    relaxation: tuple[float, ...]  # g_i, part of f(x)
    relaxation_s: tuple[float, ...]  # tau_i
    friction_n: tuple[float, ...]  # y_j, force at which the element slips
    friction_mm: tuple[float, ...]  # y_j / k_j, deformation at which it slips
    bracket_n_mm: float  # k_bracket, metal in series
    softening_per_k: float  # relative loss of stiffness per kelvin
    expansion_mm_k: float  # metal around the transducer
    weight_gain_per_g: float  # relative loss of deformation per g of normal load (thesis 12.1.2)
    offset_mm: float  # transducer reading at zero force
    damping_n_s_mm: float = 0.0  # c
    dahl_n: float = 0.0  # D_c
    dahl_n_mm: float = 1.0  # sigma


class MountState(NamedTuple):
    """What the rubber remembers; the arrays are changed in place by `advance`."""

    scalar: Floats  # (3,) x [mm], f(x) [N], D [N]
    relaxing: Floats  # (n_relaxation,) q_i [N]
    friction: Floats  # (n_friction,) P_j [N]


class Kernel(NamedTuple):
    """One mount at one sample rate, ready for the step."""

    k1: float
    k3: float
    gain: Floats  # g_i
    keep: Floats  # exp(-dt / tau_i)
    rise: Floats  # (1 - keep) tau_i / dt: what a ramp of f leaves in q_i
    slip_n: Floats
    slip_n_mm: Floats
    rate_n_mm: float  # c / dt
    dahl_n: float
    dahl_n_mm: float


def _isolator(secant_n_mm: float) -> MountPhysics:
    """A mount that settles at 0.8 mm under the force which its spring rate gives, bracket and all."""
    cubic = 0.21  # k3 (1 mm)^2 / k1
    force_n = 0.8 * secant_n_mm
    rubber_mm = 0.8 - force_n / BRACKET_N_MM
    k1 = force_n / (rubber_mm * (1 + cubic * rubber_mm**2))
    slips_mm = (0.004, 0.010, 0.025, 0.06, 0.14, 0.30)
    slips_n = (7.0, 12.0, 19.0, 27.0, 35.0, 40.0)
    return MountPhysics(
        stiffness_n_mm=k1,
        cubic_n_mm3=cubic * k1,
        relaxation=(0.12, 0.045, 0.035, 0.020),
        relaxation_s=(0.2, 15.0, 400.0, 20000.0),
        friction_n=slips_n,
        friction_mm=slips_mm,
        bracket_n_mm=BRACKET_N_MM,
        softening_per_k=2e-4,
        expansion_mm_k=1e-4,
        weight_gain_per_g=0.0097,
        offset_mm=0.0,
    )


UPPER = _isolator(5079.0)
LOWER = _isolator(5954.0)


def prepare(mount: MountPhysics, dt_s: float) -> Kernel:
    """Coefficients for steps of `dt_s`."""
    tau_s = np.array(mount.relaxation_s)
    keep = np.exp(-dt_s / tau_s)
    slip_n = np.array(mount.friction_n)
    return Kernel(
        k1=mount.stiffness_n_mm,
        k3=mount.cubic_n_mm3,
        gain=np.array(mount.relaxation),
        keep=keep,
        rise=-np.expm1(-dt_s / tau_s) * tau_s / dt_s,
        slip_n=slip_n,
        slip_n_mm=slip_n / np.array(mount.friction_mm),
        rate_n_mm=mount.damping_n_s_mm / dt_s,
        dahl_n=mount.dahl_n,
        dahl_n_mm=mount.dahl_n_mm,
    )


def at_rest(mount: MountPhysics) -> MountState:
    """Unloaded for ever."""
    return MountState(np.zeros(3), np.zeros(len(mount.relaxation)), np.zeros(len(mount.friction_n)))


@compiled
def step(kernel: Kernel, state: MountState, force_n: float) -> float:
    """One sample: the rubber's deformation [mm] under `force_n`; `state` moves on."""
    old_mm, old_n, old_dahl = state.scalar
    lost_n = -force_n
    slope = 1.0
    for i in range(kernel.gain.size):
        lost_n += kernel.gain[i] * (kernel.keep[i] * state.relaxing[i] - kernel.rise[i] * old_n)
        slope += kernel.gain[i] * kernel.rise[i]
    x = old_mm
    dahl = old_dahl
    for _ in range(MAX_NEWTON):
        elastic = (kernel.k1 + kernel.k3 * x * x) * x
        error = lost_n + slope * elastic + kernel.rate_n_mm * (x - old_mm)
        tangent = slope * (kernel.k1 + 3.0 * kernel.k3 * x * x) + kernel.rate_n_mm
        for j in range(kernel.slip_n.size):
            trial = state.friction[j] + kernel.slip_n_mm[j] * (x - old_mm)
            if trial > kernel.slip_n[j]:
                trial = kernel.slip_n[j]
            elif trial < -kernel.slip_n[j]:
                trial = -kernel.slip_n[j]
            else:
                tangent += kernel.slip_n_mm[j]
            error += trial
        if kernel.dahl_n > 0.0:
            limit = kernel.dahl_n if x >= old_mm else -kernel.dahl_n
            dahl = limit + (old_dahl - limit) * np.exp(-kernel.dahl_n_mm * abs(x - old_mm) / kernel.dahl_n)
            tangent += kernel.dahl_n_mm * (1.0 - dahl / limit)
            error += dahl
        move = error / tangent
        x -= move
        if abs(move) < SOLVED_MM:
            break
    _settle(kernel, state, x, dahl)
    return x


@compiled
def _settle(kernel: Kernel, state: MountState, x: float, dahl: float) -> None:
    elastic = (kernel.k1 + kernel.k3 * x * x) * x
    for i in range(kernel.gain.size):
        state.relaxing[i] = kernel.keep[i] * state.relaxing[i] + kernel.rise[i] * (elastic - state.scalar[1])
    for j in range(kernel.slip_n.size):
        trial = state.friction[j] + kernel.slip_n_mm[j] * (x - state.scalar[0])
        state.friction[j] = min(max(trial, -kernel.slip_n[j]), kernel.slip_n[j])
    state.scalar[0] = x
    state.scalar[1] = elastic
    state.scalar[2] = dahl


@compiled
def _run(kernel: Kernel, state: MountState, force_n: Floats, out_mm: Floats) -> None:
    for n in range(force_n.size):
        out_mm[n] = step(kernel, state, force_n[n])


def advance(
    mount: MountPhysics,
    state: MountState,
    force_n: Floats,
    dt_s: float,
    temperature_degc: Floats | float = REFERENCE_DEG_C,
    accel_z_g: Floats | float = 1.0,
) -> Floats:
    """Deformation at the transducer [mm], (n,), for the carried force (n,); `state` moves on.

    A heavier engine (accel_z_g > 1) makes the deformation smaller, in proportion: 5 um per 500 N at 6 kN on a mount
    that carries half of the 2162 N of the front at 1 g.
    """
    warmer_k = temperature_degc - REFERENCE_DEG_C
    effective_n = np.ascontiguousarray(force_n / (1 - mount.softening_per_k * warmer_k))
    rubber_mm = np.empty_like(effective_n)
    _run(prepare(mount, dt_s), state, effective_n, rubber_mm)
    loaded_mm = (rubber_mm + force_n / mount.bracket_n_mm) * (1 - mount.weight_gain_per_g * (accel_z_g - 1))
    return loaded_mm + mount.expansion_mm_k * warmer_k + mount.offset_mm
