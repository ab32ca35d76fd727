"""Payne's softening by the mount's own oscillation: what its deformation did in the last seconds to minutes.

    w = f(x) (1 - softening * p),    p = (A / A_c)^(2m) / (1 + (A / A_c)^(2m)),    A = sqrt(2 <(x - x_slow)^2>)

Kraus' law as in `payne`, of which this is a variant, by the amplitude itself. x_slow is the deformation low-passed with
slow_s, < > an exponential mean that follows within breakdown_s where it rises, within recovery_s where it falls: of one
time for both it is the mean square, and A a sine's amplitude; where the network breaks at once and heals slowly, A is
nearer to the peaks. A step of the load counts until x_slow has followed. In front of the relaxation: what relaxes is
softened, friction beside it is not. Needs no channel; begins at rest. Left out: the loss that grows with A, a spectrum
of healing.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.payne import EFFECT as BY_VIBRATION
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] += c[3] * (u[0] - x[0])
    square = (u[0] - x[0]) * (u[0] - x[0])
    x[1] += (c[4] if square > x[1] else c[5]) * (square - x[1])
    broken = (math.sqrt(2.0 * x[1]) / c[1]) ** c[2]
    return v * (1.0 - c[0] * (broken / (1.0 + broken)))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    shares = [-math.expm1(-dt_s / p[name]) for name in ("slow_s", "breakdown_s", "recovery_s")]
    return np.array([p["softening"], p["amplitude_c_mm"], 2.0 * p["exponent_m"], *shares])


EFFECT = Effect(
    name="payne_own",
    title="softening by its own oscillation (Payne)",
    site="spring",
    channels=("deformation_mm",),
    parameters=(
        *(p for p in BY_VIBRATION.parameters if p.name != "vibration_c_mm_s"),
        Parameter("amplitude_c_mm", "mm", neutral=0.03, low=1e-9, high=1e9, starts=(0.03,),
                  meaning="amplitude that breaks half of the network", amplitude=False),
        Parameter("slow_s", "s", neutral=1.0, low=1e-3, high=1e3, starts=(1.0,),
                  meaning="time above which a motion is no oscillation", amplitude=False),
        Parameter("breakdown_s", "s", neutral=20.0, low=1e-3, high=1e4, starts=(20.0,),
                  meaning="time in which it breaks the network", amplitude=False),
        Parameter("recovery_s", "s", neutral=20.0, low=1e-3, high=1e5, starts=(20.0,),
                  meaning="time in which it heals", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="w = f(x) (1 - s p),  p = (A/Ac)^2m / (1 + (A/Ac)^2m),  A = (2 <(x - lag(x))^2>)^1/2",
    source=BY_VIBRATION.source,
    separating_test="sines of 0.01, 0.05 and 0.2 mm about one mean load, a minute each: the mean deformation grows",
    initial=begin_at_channel,
    variant_of="payne",
)  # fmt: skip
