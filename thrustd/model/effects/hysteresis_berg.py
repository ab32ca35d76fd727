"""Friction of rubber springs that slips all the sooner, the more it was loaded when the motion turned (Berg).

    force = core force + friction_n * z,    z = z_s + sgn(dx) r s / (yield_mm r + s),    r = 1 - sgn(dx) z_s

s: travel since the last reversal, at which z was z_s. A variant of `hysteresis`: after a reversal every branch begins
with the same stiffness friction_n / yield_mm and creeps up to full friction as a hyperbola, which it never quite
reaches, where Bouc-Wen's exponential and Dahl's power do. The form that vehicle dynamics uses for primary springs,
bushes and engine mounts. Positive friction_n resists motion. Starts at z = 0. As z depends on where the motion turned,
it would lose its memory with every tremble of the reading: x is the reading with a play of deadband_mm around it (see
`hysteresis`). Left out: many scales at once, friction growing with load.
"""

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.hysteresis import DEADBAND_MM, FRICTION_N
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    away = u[0] - x[0]
    dx = away - min(max(away, -c[2]), c[2])
    x[0] += dx
    if dx != 0.0:
        sign = 1.0 if dx > 0.0 else -1.0
        if sign != x[3]:
            x[2], x[3] = x[1], sign
        room = max(1.0 - sign * x[2], 1e-9)
        reach = c[1] * room * room  # what is left to slip is this, over the yield and the travel so far
        x[1] = sign * (1.0 - reach / (reach / max(1.0 - sign * x[1], 1e-12) + abs(dx)))
    return v + c[0] * x[1]


EFFECT = Effect(
    name="hysteresis_berg",
    title="friction of rubber springs (Berg)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        Parameter("yield_mm", "mm", neutral=0.03, low=1e-9, high=1e9, starts=(0.01, 0.03, 0.1),
                  meaning="deformation from rest that takes half of the friction", amplitude=False),
        DEADBAND_MM,
    ),
    step=step,
    prepare=None,
    n_state=4,
    equation="F = F_core + F_f z,  z = z_s + sgn(dx) r s / (x_y r + s),  r = 1 - sgn(dx) z_s",
    source="Berg, Veh. Syst. Dyn. 30 (1998) 197; Bruni et al., Veh. Syst. Dyn. 49 (2011) 1021",
    separating_test="slow triangles (0.001 and 0.01 Hz) of two amplitudes: a loop of the same width at both speeds",
    initial=begin_at_channel,
    variant_of="hysteresis",
)  # fmt: skip
