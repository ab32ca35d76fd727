"""Hysteresis by internal friction, Bouc-Wen's model with an exponent and a skew of its own.

    force = core force + friction_n * z,    dz/dx = (1 - |z|^exponent ((1 - |gamma|) sgn(z dx) + gamma)) / yield_mm

A variant of `hysteresis`, which has exponent 1 and gamma 0.5 and is exact over a sample; this one steps through it by
tenths of yield_mm at most (Heun). gamma below 0.5 unloads more steeply than it began to load, so the loop bulges; above
0.5 it is slender. An exponent above 1 keeps the friction elastic for longer and lets go at once. For gamma >= 0, z
stays within +-1 and friction_n is the half width of the loop; below 0 it grows beyond 1, without end below -0.5, where
the element hardens as far as the data go: it is held at TOP. Positive friction_n resists motion. Deadband as in
`hysteresis`. Starts at z = 0. Left out: many scales at once (see the other variants), decay with the energy spent.
"""

import math

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.hysteresis import DEADBAND_MM, FRICTION_N, YIELD_MM
from thrustd.model.stage import Floats, jit

FINE = 0.1  # of yield_mm, one step of the integration
MOST = 100.0  # steps in one sample: a sample that moves by ten yield_mm has forgotten where it began
TOP = 100.0  # of |z|, where nothing else bounds it


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    away = u[0] - x[0]
    dx = away - min(max(away, -c[4]), c[4])
    x[0] += dx
    if dx != 0.0:
        sign = 1.0 if dx > 0.0 else -1.0
        count = min(1.0 + math.floor(abs(dx) / (c[1] * FINE)), MOST)
        h = min(abs(dx) / c[1], FINE * MOST) / count
        q, done = sign * x[1], 0.0
        while done < count:
            first = slope(q, c)
            q = min(max(q + 0.5 * h * (first + slope(q + h * first, c)), -TOP), TOP)
            done += 1.0
        x[1] = sign * q
    return v + c[0] * x[1]


@jit
def slope(q: float, c: Floats) -> float:
    """dz/dx of a motion upwards, in yield_mm."""
    turn = 1.0 - abs(c[2])
    return 1.0 - abs(q) ** c[3] * (c[2] + turn if q >= 0.0 else c[2] - turn)


EFFECT = Effect(
    name="hysteresis_bouc_wen",
    title="hysteresis by internal friction (Bouc-Wen with exponent and skew)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        YIELD_MM,
        Parameter("gamma", "-", neutral=0.5, low=-0.9, high=0.9, starts=(0.3, -0.5),
                  meaning="Bouc-Wen's gamma, where beta + |gamma| = 1", amplitude=False, spread=0.2),
        Parameter("exponent", "-", neutral=1.0, low=0.3, high=8.0, starts=(1.5,),
                  meaning="Bouc-Wen's n: how suddenly it lets go", amplitude=False, e_folds=1.5),
        DEADBAND_MM,
    ),
    step=step,
    prepare=None,
    n_state=2,
    equation="F = F_core + F_f z,  dz/dx = (1 - |z|^n ((1 - |g|) sgn(z dx) + g)) / x_y",
    source="Wen, J. Eng. Mech. 102 (1976) 249; Ismail et al., Arch. Comput. Methods Eng. 16 (2009) 161",
    separating_test="slow triangles (0.001 and 0.01 Hz) of two amplitudes: a loop of the same width at both speeds",
    initial=begin_at_channel,
    variant_of="hysteresis",
)  # fmt: skip
