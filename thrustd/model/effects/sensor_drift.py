"""Sensor drift: the LVDT's zero walks away with time while nothing moves.

    true deformation = reading - drift_mm_h * settled hours
    settled hours = settling_h * (1 - exp(-hours / settling_h)),    hours = (time_s - reference_s) / 3600

Positive: the reading grows. The same shift at every force, which tells it from ageing (a gain) and from creep, that
follows the load. drift_mm_h is the rate at the reference time: a straight line while settling_h is far longer than
the recording, the warm-up of electronics when it is an hour or less. Typical of an LVDT with its conditioner: 0.01 to
0.1 % of stroke per hour, 0.5 to 5 um/h on 5 mm. Left out: random walk.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    since = (u[0] - c[1]) / c[2]
    return v + c[0] * math.expm1(-since) if since > 0.0 else v - c[0] * since


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["drift_mm_h"] * p["settling_h"], p["reference_s"], 3600.0 * p["settling_h"]])


EFFECT = Effect(
    name="sensor_drift",
    title="drift of the deformation sensor's zero",
    site="deformation",
    channels=("time_s",),
    parameters=(
        Parameter("drift_mm_h", "mm/h", neutral=0.0, low=-1.0, high=1.0, starts=(0.01,),
                  meaning="growth of the reading at rest", expected="up to 0.005 mm/h for a good LVDT and conditioner"),
        Parameter("settling_h", "h", neutral=1000.0, low=0.05, high=10000.0, starts=(1000.0, 1.0),
                  meaning="warm-up time of the electronics; much longer than the recording: a straight line",
                  amplitude=False),
        Parameter("reference_s", "s", neutral=0.0, low=-1000000000000.0, high=1000000000000.0, starts=(0.0,),
                  meaning="time at which the zero was right", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="x = x_read - d T (1 - exp(-(t - t_0) / T))",
    source="data sheets of LVDT conditioners; Nyce, Linear Position Sensors, ch. 3",
    separating_test="return to zero load at constant temperature every 30 min and read the zero",
)  # fmt: skip
