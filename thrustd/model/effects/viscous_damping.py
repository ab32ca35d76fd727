"""Viscous damping: a dashpot beside the spring, force in proportion to the rate of deformation.

    force = core force + damping_n_s_mm * dx/dt,        dx/dt low-passed with filter_s

Positive resists motion: more force than the spring while loading. The rate comes from the LVDT, whose steps of 5 mm /
2^16 at 20 Hz are 1.5 um/s; the first-order filter keeps that out. Kelvin-Voigt's element (thesis eq. 13.3).
Valid below a few hertz. Left out: damping which depends on amplitude (hysteresis) or that fades with frequency
(relaxation). A pure time delay of the LVDT looks alike, since x(t + T) is x + T dx/dt to first order.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (u[0] - x[0])
    x[0] = u[0]
    return v + c[0] * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["damping_n_s_mm"], decay, (1.0 - decay) / dt_s])


DAMPING = Parameter(
    "damping_n_s_mm", "N s/mm", neutral=0.0, low=0.0, high=100000.0, starts=(500.0,),
    meaning="force per rate of deformation", expected="positive: a dashpot takes energy out",
)  # fmt: skip
EFFECT = Effect(
    name="viscous_damping",
    title="viscous damping beside the spring",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        DAMPING,
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.02, 0.1, 0.5),
                  meaning="low-pass of the rate", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + c dx/dt",
    source="Brinson & Brinson, Polymer Engineering Science and Viscoelasticity, ch. 5; thesis eq. 13.3",
    separating_test="sine sweeps of one amplitude from 0.01 to 1 Hz: the force in quadrature grows with frequency",
    initial=begin_at_channel,
)  # fmt: skip
