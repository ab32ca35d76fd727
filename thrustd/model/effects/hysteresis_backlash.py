"""Dry friction behind a free play: a friction damper or a link whose joints are loose.

    force = core force + friction_n * sgn(e) max(|e| - play_mm, 0) / yield_mm
    e <- clip(e + dx, -r, r),    r = play_mm + yield_mm

A spring in series with a dry slider (Jenkins' element) and a gap of twice play_mm: when the motion turns, the spring
lets go within yield_mm, the joint crosses its gap without force, and the slider is loaded the other way. A variant of
`hysteresis`; a sum of stops (`hysteresis_stops`) holds its force where this one has none. Positive friction_n resists
motion. Starts in the middle of the gap. Left out: impact at its ends.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.hysteresis import FRICTION_N
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    reach = c[1] + c[2]
    x[1] = min(max(x[1] + u[0] - x[0], -reach), reach)
    x[0] = u[0]
    taken = max(abs(x[1]) - c[2], 0.0) / c[1]
    return v + c[0] * (taken if x[1] > 0.0 else -taken)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["friction_n"], p["yield_mm"], p["play_mm"]])


EFFECT = Effect(
    name="hysteresis_backlash",
    title="dry friction behind a free play",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        Parameter("yield_mm", "mm", neutral=0.03, low=1e-9, high=1e9, starts=(0.1,),
                  meaning="deformation of the spring in series when it slides", amplitude=False),
        Parameter("play_mm", "mm", neutral=0.05, low=1e-9, high=1e9, starts=(0.05,),
                  meaning="half the gap that is crossed without force when the motion turns", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + F_f sgn(e) max(|e| - g, 0) / x_y,  e = clip(e + dx, +-(g + x_y))",
    source="Nordin & Gutman, Automatica 38 (2002) 1633; Iwan, J. Appl. Mech. 33 (1966) 893",
    separating_test="slow triangles: at every reversal the force stays near that of the spring for twice the play",
    initial=begin_at_channel,
    variant_of="hysteresis",
)  # fmt: skip
