"""Time delay: deformation and reference are not stamped at the same instant (filters, buses, clocks).

    delay_s > 0, the reading is late:   v = x + T * rate + T^2 / 2 * change of rate (a causal look ahead)
    delay_s < 0, the reading is early:  v = x(t - |T|) (an exact delay line, linear between samples)

In flight a late reading can only be caught up by extrapolation: right for motion slower than T, wrong for a jump within
T; rate and its change are low-passed with filter_s, chosen for that. On a record it is put back to its time exactly
(`ahead`), so there filter_s does nothing. Early readings, or a force that is recorded late, are simply held back, to
400 samples at most. To first
order a late reading equals viscous damping with c = K T. Left out: a delay that changes in flight (jitter).
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

N_LINE = 400  # longest delay line, samples
_HEAD = 6  # x: 0 last v, 1 rate, 2 last rate, 3 change of rate, 4 write index, 5 unused; then the line


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[2] * x[1] + c[3] * (v - x[0])
    x[3] = c[2] * x[3] + c[3] * (x[1] - x[2])
    x[0] = v
    x[2] = x[1]
    at = int(x[4])
    x[6 + at] = v
    x[4] = (at + 1) % 400
    if c[0] >= 0.0:
        return v + c[0] * x[1] + c[4] * x[3]
    newer = x[6 + (at - int(c[1]) + 400) % 400]
    older = x[6 + (at - int(c[1]) + 399) % 400]
    return newer + (c[1] - math.floor(c[1])) * (older - newer)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    lead_s = p["delay_s"]
    decay = np.exp(-dt_s / p["filter_s"])
    line = min(max(-lead_s / dt_s, 0.0), N_LINE - 2.0)
    return np.array([lead_s, line, decay, (1.0 - decay) / dt_s, 0.5 * lead_s**2])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[:] = 0.0
    x[0] = v
    x[_HEAD:] = v


EFFECT = Effect(
    name="time_delay",
    title="time delay of the deformation signal",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("delay_s", "s", neutral=0.0, low=-20.0, high=5.0, starts=(0.1, -0.1),
                  meaning="lateness of the deformation reading",
                  expected="below 0.02 s: one frame of the ADC and its filter"),
        Parameter("filter_s", "s", neutral=0.05, low=0.005, high=10.0, starts=(0.1, 0.02, 0.05, 0.2, 0.4, 0.8, 1.6),
                  meaning="low-pass of the rate where the reading is late, in flight", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=406,
    equation="x_now = x + T dx/dt + T^2/2 d2x/dt2 (late);  x(t - |T|) (early)",
    source="Taylor's series; Astrom & Wittenmark, Computer-Controlled Systems, ch. 2",
    separating_test="one sharp step of force with both channels sampled at 1 kHz: read the shift",
    initial=initial,
    ahead="delay_s",
)  # fmt: skip
