"""Lateness by a bus and a filter: the reading follows the deformation as a low-pass does, and arrives later still.

    reading(t + D)' = (x - reading(t + D)) / T,  so    w = reading + T * d reading / dt,    x(t) = w(t + D)

A variant of `time_delay` for what most loggers do: a conditioner's filter of time constant T = lag_s, and a latency
D = delay_s of conversion, bus and clock. The rate that undoes the filter is low-passed with rate_s. What arrives late
is put back exactly on a record (`ahead`) and extrapolated in flight, as in `time_delay`. Left out: filters of higher
order.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects import time_delay
from thrustd.model.stage import Floats, jit

_late, _begin_late = time_delay.step, jit(time_delay.initial)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[1] * x[1] + c[2] * (v - x[0])
    x[0] = v
    return _late(x[2:], c[3:], u, v + c[0] * x[1])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["rate_s"])
    return np.concatenate(([p["lag_s"], decay, (1.0 - decay) / dt_s], time_delay.prepare(p, dt_s)))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = v
    x[1] = 0.0
    _begin_late(x[2:], c[3:], u, v)


EFFECT = Effect(
    name="time_delay_filter",
    title="delay of the deformation signal behind a bus and a filter",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("delay_s", "s", neutral=0.0, low=0.0, high=5.0, starts=(0.05,),
                  meaning="latency of the deformation reading",
                  expected="below 0.02 s: one frame of the ADC and its filter"),
        Parameter("lag_s", "s", neutral=0.0, low=0.0, high=5.0, starts=(0.05,),
                  meaning="time constant of its filter", expected="below 0.02 s"),
        Parameter("rate_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.02, 0.1),
                  meaning="low-pass of the rate that undoes the filter", amplitude=False),
        *(p for p in time_delay.EFFECT.parameters if not p.amplitude),
    ),
    step=step,
    prepare=prepare,
    n_state=408,
    equation="x = w(t + D),  w = x_read + T dx_read/dt",
    source="Astrom & Wittenmark, Computer-Controlled Systems, ch. 2",
    separating_test="one sharp step of force with both channels sampled at 1 kHz: when it begins, and how it rounds",
    initial=initial,
    ahead="delay_s",
    variant_of="time_delay",
)  # fmt: skip
