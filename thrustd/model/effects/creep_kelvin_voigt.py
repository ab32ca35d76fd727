"""Creep with one retardation time (Kelvin-Voigt): under load rubber keeps yielding until it has come to its end.

    deformation = elastic deformation * (1 + s (1 - exp(-t / tau)))      under a load held from t = 0
    here:  x = v + retarded_share * lag(v),              v: elastic, x: read; lag: first order, time constant tau_s

A spring and a dashpot side by side, in series with the mount. A variant of `creep` for materials that settle within
hours, where the logarithmic law goes on for ever. retarded_share is what has grown in the end, as a share of the
elastic deformation, positive. What relaxed on the bench is in the linear block. `settled` says how a recording begins.
Left out: temperature (WLF), more than one time at once (see creep).
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    elastic = (v - c[1] * (1.0 - c[0]) * x[0]) / (1.0 + c[1] * c[0])
    x[0] += c[0] * (elastic - x[0])
    return elastic


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([-math.expm1(-dt_s / p["tau_s"]), p["retarded_share"], p["settled"]])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = c[2] * v / (1.0 + c[2] * c[1])


EFFECT = Effect(
    name="creep_kelvin_voigt",
    title="creep with one retardation time (Kelvin-Voigt)",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("retarded_share", "-", neutral=0.0, low=0.0, high=0.5, starts=(0.01,),
                  meaning="share of the elastic deformation that has crept in the end",
                  expected="0.02 to 0.15 for natural rubber"),
        Parameter("tau_s", "s", neutral=1500.0, low=1.0, high=20000.0, starts=(60.0, 500.0, 2000.0),
                  meaning="retardation time", amplitude=False),
        Parameter("settled", "-", neutral=1.0, low=0.0, high=1.0, starts=(1.0, 0.0),
                  meaning="1: the load of the first sample had been there for ever, 0: it comes at that moment",
                  amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="x = v + s lag(v),  v (1 + s (1 - exp(-t / tau))) under constant load,  v: elastic",
    source="Tschoegl, Linear Viscoelastic Behavior, 1989, ch. 3; Findley, Lai & Onaran, Creep and Relaxation, 1976",
    separating_test=(
        "hold 5 kN for two hours at constant temperature: it comes to its end, the logarithmic law does not"
    ),
    initial=initial,
    variant_of="creep",
)  # fmt: skip
