"""Viscous damping that thins or thickens with its rate: a dashpot at small rates, a power of the rate at large ones.

    force = core force + damping_n * (r / r_u) * ((r^2 + r_s^2) / (r_u^2 + r_s^2))^((exponent - 1) / 2)
    r = dx/dt low-passed with filter_s,  r_u = usual_mm_s,  r_s = slow_mm_s

A variant of `viscous_damping` for dampers whose force does not double with the rate. exponent 1 is the dashpot, below 1
a fluid that thins under shear or a valve that opens, near 0 a damper that saturates, 2 an orifice with turbulent flow.
No damper resists steeper than a dashpot near rest, and what noise the reading has makes every law one: below slow_mm_s.
The size is the force at the usual rate of the record that it was estimated on, so it does not go with the exponent.
Left out: frequency, temperature of the fluid, a force that stands when the motion stops.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (u[0] - x[0])
    x[0] = u[0]
    return v + c[0] * x[1] * (x[1] * x[1] + c[3]) ** c[4]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    slow, power = p["slow_mm_s"] ** 2, (p["exponent"] - 1.0) / 2.0
    size = p["damping_n"] / (p["usual_mm_s"] * (p["usual_mm_s"] ** 2 + slow) ** power)
    return np.array([size, decay, (1.0 - decay) / dt_s, slow, power])


EFFECT = Effect(
    name="viscous_damping_carreau",
    title="viscous damping that thins or thickens with its rate",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        Parameter("damping_n", "N", neutral=0.0, low=0.0, high=1e9, starts=(20.0,),
                  meaning="force at usual_mm_s", expected="positive: a dashpot takes energy out"),
        Parameter("usual_mm_s", "mm/s", neutral=0.015, low=1e-9, high=1e9, starts=(0.015,),
                  meaning="usual rate of deformation, at which the size is given", amplitude=False, estimate=False),
        Parameter("exponent", "-", neutral=1.0, low=0.05, high=3.0, starts=(0.3, 0.7, 1.5),
                  meaning="1: a dashpot, 2: an orifice, near 0: it saturates", amplitude=False),
        Parameter("slow_mm_s", "mm/s", neutral=0.01, low=1e-9, high=1e9, starts=(0.0015,),
                  meaning="rate below which it is a dashpot", amplitude=False),
        Parameter("filter_s", "s", neutral=0.05, low=1e-3, high=10.0, starts=(0.05,),
                  meaning="low-pass of the rate", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + F_u r / r_u ((r^2 + r_s^2) / (r_u^2 + r_s^2))^((p - 1) / 2),  r = dx/dt",
    source="Carreau, Trans. Soc. Rheol. 16 (1972) 99; Makris & Constantinou, J. Struct. Eng. 117 (1991) 2708",
    separating_test="sine sweeps of one amplitude from 0.01 to 1 Hz: the force in quadrature grows with a power of it",
    initial=begin_at_channel,
    variant_of="viscous_damping",
)  # fmt: skip
