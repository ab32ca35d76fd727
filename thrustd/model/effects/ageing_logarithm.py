"""Ageing in proportion to the logarithm of time: every tenfold of time stiffens the rubber by as much again.

    force = core force * (1 + ageing_per_decade * log10(1 + (time_s - reference_s) / start_s))

Physical ageing and filler networks that form again after mixing or heat (Struik, Physical Aging in Amorphous Polymers
and Other Materials, 1978; Boehm & Nguyen, J. Appl. Polym. Sci. 55 (1995) 1041): a spectrum of times, no single one.
A variant of `ageing`, which settles or goes on in a straight line. Positive: hardening. Before reference_s nothing has
aged. Left out: temperature.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thrustd.model.effect import Parameter
from thrustd.model.effects.ageing import EFFECT as WHOLE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v * (1.0 + c[0] * math.log(1.0 + max(u[0] - c[1], 0.0) / c[2]))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["ageing_per_decade"] / math.log(10.0), p["reference_s"], p["start_s"]])


EFFECT = replace(
    WHOLE,
    name="ageing_logarithm",
    title="stiffness that changes with the logarithm of time",
    parameters=(
        Parameter("ageing_per_decade", "-", neutral=0.0, low=-0.5, high=0.5, starts=(0.01,),
                  meaning="relative change of stiffness per tenfold of time", expected="up to 0.03"),
        Parameter("start_s", "s", neutral=60.0, low=1.0, high=36000.0, starts=(60.0, 600.0),
                  meaning="time at which it begins to count", amplitude=False),
        *(p for p in WHOLE.parameters if p.name == "reference_s"),
    ),
    step=step,
    prepare=prepare,
    equation="F = F_core (1 + b log10(1 + (t - t_0) / s))",
    source="Struik, Physical Aging in Amorphous Polymers and Other Materials, 1978",
    variant_of="ageing",
)  # fmt: skip
