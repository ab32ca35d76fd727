"""Viscous damping that saturates: a valve that opens, a fluid that yields, joints that creep before they slide.

    force = core force + damping_n_s_mm * r / (1 + |r / v_s|^q)^(1/q),        r = dx/dt low-passed with filter_s

At q = 2 it turns over about as gradually as a hyperbolic tangent, far above that at once, as a fluid does that yields
(biviscous). A variant of `viscous_damping`: a dashpot at rates far below v_s, a force of one size far above. What is
estimated is the dashpot that it is at small rates, so it saturates above the usual rate of a record: below that it is
dry friction, `hysteresis_coulomb`, which is the same law from the other end. Left out: frequency, temperature of the
fluid, a force that stands when the motion stops.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.viscous_damping import DAMPING
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (u[0] - x[0])
    x[0] = u[0]
    return v + c[0] * x[1] / (1.0 + abs(x[1] / c[3]) ** c[4]) ** (1.0 / c[4])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["damping_n_s_mm"], decay, (1.0 - decay) / dt_s, p["saturates_mm_s"], p["sharpness"]])


EFFECT = Effect(
    name="viscous_damping_saturating",
    title="viscous damping that saturates",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        DAMPING,
        Parameter("saturates_mm_s", "mm/s", neutral=0.05, low=1e-9, high=1e9, starts=(0.05,),
                  meaning="rate of deformation at which the dashpot would have the largest force", amplitude=False,
                  e_folds=1.0),
        Parameter("sharpness", "-", neutral=2.0, low=0.5, high=20.0, starts=(2.0,),
                  meaning="how suddenly it turns over", amplitude=False, e_folds=1.5),
        Parameter("filter_s", "s", neutral=0.05, low=1e-4, high=10.0, starts=(0.05,),
                  meaning="low-pass of the rate", amplitude=False, e_folds=5.0),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + c v / (1 + |v / v_s|^q)^(1/q),  v = dx/dt",
    source="Kwok, Ha, Nguyen, Li & Samali, Sens. Actuators A 132 (2006) 441, whose hysteresis is left out",
    separating_test="sines of one frequency and growing amplitude: the force in quadrature grows less than they do",
    initial=begin_at_channel,
    variant_of="viscous_damping",
)  # fmt: skip
