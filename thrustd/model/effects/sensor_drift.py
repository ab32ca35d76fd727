"""Sensor drift: the LVDT's zero walks away with time while nothing moves.

    true deformation = reading - drift_mm_h * hours,        hours = (time_s - reference_s) / 3600

Positive: the reading grows. The same shift at every force, which tells it from ageing (a gain) and from creep, that
follows the load. Linear drift over hours; warm-up that settles is better described by temperature. Typical of an LVDT
with its conditioner: 0.01 to 0.1 % of stroke per hour, 0.5 to 5 um/h on 5 mm. Left out: random walk.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (u[0] - c[1])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["drift_mm_h"] / 3600.0, p["reference_s"]])


EFFECT = Effect(
    name="sensor_drift",
    title="drift of the deformation sensor's zero",
    site="deformation",
    channels=("time_s",),
    parameters=(
        Parameter(
            "drift_mm_h",
            "mm/h",
            0.0,
            -1.0,
            1.0,
            (0.01,),
            "growth of the reading at rest",
            expected="up to 0.005 mm/h for a good LVDT and conditioner",
        ),
        Parameter(
            "reference_s",
            "s",
            0.0,
            -1000000000000.0,
            1000000000000.0,
            (0.0,),
            "time at which the zero was right",
            amplitude=False,
            estimate=False,
        ),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="x = x_read - d (t - t_0)",
    source="data sheets of LVDT conditioners; Nyce, Linear Position Sensors, ch. 3",
    separating_test="return to zero load at constant temperature every 30 min and read the zero",
)
