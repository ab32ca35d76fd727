"""Hysteresis by internal friction, Bouc-Wen's model: loading takes more force than unloading, however slowly.

    force = core force + friction_n * z,    dz/dx = (1 - |z| (1 + sgn(z dx)) / 2) / yield_mm,    -1 < z < 1

Bouc-Wen with A = 1 / yield, beta = gamma = 1 / (2 yield), n = 1, integrated exactly over one sample of dx (an
exponential), so that no rate and no step size enters. Under a reading that trembles the equation forgets: every tremble
back costs z a whole step, every one forth gives nearly nothing.
So x is the reading with a play of deadband_mm around it, which is estimated: a few times the noise of the transducer
where only the reading trembles, less where the mount does; within a factor of seven of its start, for a gap is
`free_play`. Friction is late by that much. Positive friction resists motion: a loop run clockwise in force over
deformation, half width friction_n. After a reversal the loop turns over within a few yield_mm.
Prandtl-Ishlinskii and Preisach stand in files of their own as variants. Starts at z = 0: the first loading branch is
the virgin one. Valid for one scale of friction; left out: many scales at once (see the variants), friction growing with
load.
"""

import math

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    away = u[0] - x[0]
    dx = away - min(max(away, -c[2]), c[2])
    x[0] += dx
    if dx != 0.0:
        sign = 1.0 if dx > 0.0 else -1.0
        q, h = sign * x[1], abs(dx) / c[1]
        before_zero = min(h, max(-q, 0.0))  # straight while z opposes the motion, then exponential towards 1
        q += before_zero
        if h > before_zero:
            q = 1.0 - (1.0 - q) * math.exp(before_zero - h)
        x[1] = sign * q
    return v + c[0] * x[1]


FRICTION_N = Parameter(
    "friction_n", "N", neutral=0.0, low=0.0, high=1e6, starts=(50.0,),
    meaning="friction force, half the width of the loop", expected="positive; 30 to 150 N: 1 to 2 % of full load",
)  # fmt: skip

YIELD_MM = Parameter(
    "yield_mm", "mm", neutral=0.03, low=1e-9, high=1e9, starts=(0.01, 0.03, 0.1, 0.3), amplitude=False,
    meaning="deformation over which the loop turns over",
)  # fmt: skip

DEADBAND_MM = Parameter(
    "deadband_mm", "mm", neutral=0.0, low=0.0, high=1e9, starts=(0.0005,), amplitude=False, e_folds=2.0,
    meaning="play around the reading that keeps its noise out",
)  # fmt: skip

EFFECT = Effect(
    name="hysteresis",
    title="hysteresis by internal friction (Bouc-Wen)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        YIELD_MM,
        DEADBAND_MM,
    ),
    step=step,
    prepare=None,
    n_state=2,
    equation="F = F_core + F_f z,  dz/dx = (1 - |z| (1 + sgn(z dx)) / 2) / x_y",
    source="Wen, J. Eng. Mech. 102 (1976) 249; Ikhouane & Rodellar, Systems with Hysteresis, 2007",
    separating_test="slow triangles (0.001 and 0.01 Hz) of two amplitudes: a loop of the same width at both speeds",
    initial=begin_at_channel,
)  # fmt: skip
