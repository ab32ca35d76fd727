"""Viscous damping of a fluid pressed through gaps and orifices: laminar at small rates, turbulent at large ones.

    force = core force + (damping_n_s_mm + orifice_n_s2_mm2 |r|) r,        r = dx/dt low-passed with filter_s

A variant of `viscous_damping` for hydraulic mounts and dampers: leaks and narrow gaps resist in proportion to the rate,
an orifice with its square, and most have both. Two sizes, no exponent: where one of them is nothing, the other stands
alone. Left out: inertia of the fluid, its temperature, a valve that opens.
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
    return v + (c[0] + c[3] * abs(x[1])) * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["damping_n_s_mm"], decay, (1.0 - decay) / dt_s, p["orifice_n_s2_mm2"]])


EFFECT = Effect(
    name="viscous_damping_orifice",
    title="viscous damping with an orifice",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        DAMPING,
        Parameter("orifice_n_s2_mm2", "N s2/mm2", neutral=0.0, low=0.0, high=1e9, starts=(10000.0,),
                  meaning="force per square of the rate", expected="positive: an orifice takes energy out"),
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.02, 0.1, 0.5),
                  meaning="low-pass of the rate", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + (c + q |dx/dt|) dx/dt",
    source="Dixon, The Shock Absorber Handbook, 2007, ch. 5",
    separating_test="sines of one frequency and growing amplitude: the force in quadrature grows more than they do",
    initial=begin_at_channel,
    variant_of="viscous_damping",
)  # fmt: skip
