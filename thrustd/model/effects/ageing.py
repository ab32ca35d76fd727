"""Ageing: the rubber stiffens (or softens) with time in service, so its gain walks away.

    force = core force * (1 + ageing_1_h * settled hours)
    settled hours = settling_h * (1 - exp(-hours / settling_h)),    hours = (time_s - reference_s) / 3600

Positive: hardening, as after-curing and oxidation do; softening by chain scission is negative. Scales with force: at
zero load it shows nothing, unlike sensor drift. ageing_1_h is the rate at the reference time; with a settling time
far longer than the recording it stays that, a straight line. Arrhenius' law makes the real rate double per 10 K or
so. A healthy mount changes by a few per cent per 1000 h; a much larger figure points at something else that grows in
time (warming of the mount, load-cell gain). Left out: recovery at rest, dependence on temperature.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    since = (u[0] - c[1]) / c[2]
    return v * (1.0 - c[0] * math.expm1(-since)) if since > 0.0 else v * (1.0 + c[0] * since)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["ageing_1_h"] * p["settling_h"], p["reference_s"], 3600.0 * p["settling_h"]])


EFFECT = Effect(
    name="ageing",
    title="stiffness that changes with time in service",
    site="gain",
    channels=("time_s",),
    parameters=(
        Parameter("ageing_1_h", "1/h", neutral=0.0, low=-1.0, high=1.0, starts=(0.01,),
                  meaning="relative change of stiffness per hour",
                  expected="below 1e-4 1/h in service; more in accelerated tests"),
        Parameter("settling_h", "h", neutral=1000.0, low=0.05, high=10000.0, starts=(1000.0, 1.0),
                  meaning="time in which it comes to its end; much longer than the recording: a straight line",
                  amplitude=False),
        Parameter("reference_s", "s", neutral=0.0, low=-1000000000000.0, high=1000000000000.0, starts=(0.0,),
                  meaning="time at which the model was identified", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="F = F_core (1 + k T (1 - exp(-(t - t_0) / T)))",
    source="Gent, Engineering with Rubber, 3rd ed., ch. 7",
    separating_test="the same force cycle (0 to 5 kN) at the start and at the end, at the same temperature",
)  # fmt: skip
