"""Viscous damping that changes over the travel: a gap that opens or closes, a piston that leaves its port.

    force = core force + max(damping_n_s_mm + change_n_s_mm s, 0) r,    s = x / range_mm,  r = dx/dt low-passed

A variant of `viscous_damping`. A squeezed film resists with the inverse cube of its thickness, a hydraulic mount less
where its plate has left the gap: over one travel that is nearly a straight line. It never drives. Left out: how it
depends on the rate (`viscous_damping_orifice`, `viscous_damping_saturating`).
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
    return v + max(c[0] + c[3] * u[0], 0.0) * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["damping_n_s_mm"], decay, (1.0 - decay) / dt_s, p["change_n_s_mm"] / p["range_mm"]])


EFFECT = Effect(
    name="viscous_damping_travel",
    title="viscous damping that changes over the travel",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        DAMPING,
        Parameter("change_n_s_mm", "N s/mm", neutral=0.0, low=-1e6, high=1e6, starts=(100.0,),
                  meaning="damping at range_mm less that at zero"),
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.02, 0.1, 0.5),
                  meaning="low-pass of the rate", amplitude=False),
        Parameter("range_mm", "mm", neutral=1.0, low=1e-4, high=1000.0, starts=(1.0,),
                  meaning="travel over which it is told", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + max(c + b x / range, 0) dx/dt",
    source="Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication, 2nd ed., ch. 11 (squeeze films)",
    separating_test="sines of one frequency and small amplitude at idle and at full thrust",
    initial=begin_at_channel,
    variant_of="viscous_damping",
)  # fmt: skip
