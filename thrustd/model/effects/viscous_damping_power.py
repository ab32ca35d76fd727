"""Viscous damping with a power of its rate: an orifice, a fluid that thins, a shock absorber's valve.

    force = core force + damping_n * sgn(r) |r / 1 mm/s|^exponent,      r = dx/dt low-passed with filter_s

A variant of `viscous_damping` for dampers whose force does not double with the rate: exponent 1 is the dashpot, below 1
a fluid that thins under shear or a valve that opens, 2 an orifice with turbulent flow. damping_n is the force at 1
mm/s, far above what a mount sees, so it goes with the exponent. Left out: frequency, temperature of the fluid.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (u[0] - x[0])
    x[0] = u[0]
    size = abs(x[1])
    return v + c[0] * math.copysign(size ** c[3], x[1]) if size > 0.0 else v


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["damping_n"], decay, (1.0 - decay) / dt_s, p["exponent"]])


EFFECT = Effect(
    name="viscous_damping_power",
    title="viscous damping with a power of the rate",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        Parameter("damping_n", "N", neutral=0.0, low=0.0, high=100000.0, starts=(500.0,),
                  meaning="force at 1 mm/s", expected="positive: a dashpot takes energy out"),
        Parameter("exponent", "-", neutral=1.0, low=0.2, high=3.0, starts=(0.5, 0.8, 1.2, 1.7),
                  meaning="1: a dashpot, 2: an orifice", amplitude=False),
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.05,),
                  meaning="low-pass of the rate", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + F_1 sgn(dx/dt) |dx/dt|^p",
    source="Makris & Constantinou, J. Struct. Eng. 117 (1991) 2708; Dixon, The Shock Absorber Handbook, 2007, ch. 5",
    separating_test="sine sweeps of one amplitude from 0.01 to 1 Hz: the force in quadrature grows with a power of it",
    initial=begin_at_channel,
    variant_of="viscous_damping",
)  # fmt: skip
