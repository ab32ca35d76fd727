"""Lateness by a first-order filter: the reading follows the deformation as a low-pass does, not by a fixed time.

    reading' = (x - reading) / T,  so    x = reading + T * rate,    rate = d reading / dt, low-passed with filter_s

A variant of `time_delay` for a conditioner or an ADC with a slow filter. Unlike a transport delay it can be undone
sample by sample. It equals viscous damping with c = K T as far as the stiffness K of the mount is constant; where the
mount stiffens the two part. The low-pass keeps the steps of the LVDT out. Left out: filters of higher order.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_signal
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (v - x[0])
    x[0] = v
    return v + c[0] * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["delay_s"], decay, (1.0 - decay) / dt_s])


EFFECT = Effect(
    name="time_delay_lag",
    title="lag of the deformation signal behind a filter",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("delay_s", "s", neutral=0.0, low=0.0, high=5.0, starts=(0.1,),
                  meaning="time constant of the filter", expected="below 0.02 s: one frame of the ADC and its filter"),
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.02, 0.1),
                  meaning="low-pass of the rate", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="x = x_read + T dx_read/dt",
    source="Astrom & Wittenmark, Computer-Controlled Systems, ch. 2",
    separating_test="one sharp step of force with both channels sampled at 1 kHz: read the time constant",
    initial=begin_at_signal,
    variant_of="time_delay",
)  # fmt: skip
