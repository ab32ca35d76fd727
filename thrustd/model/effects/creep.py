"""Creep: under load rubber keeps yielding, in proportion to the logarithm of time (Rivin's eq. in thesis 4.2).

    deformation = elastic deformation * (1 + b log10(t / 1 min))      under a load held from t = 0
    here:  x = v + creep_per_decade / 2 * sum_i exp(-start_s / tau_i) lag_i(v),    v: elastic, x: read
    lag_i: first-order lags of time constant tau_i, two per decade from start_s / 10 on

The weights are the retardation spectrum of log10(1 + t / start_s), exp(-start / tau) / ln 10 per unit of ln tau, so it
holds for any load history and runs causally. It is solved for v at every sample, so that b is the share however much
has crept: lags of x in place of v are 1.5 % off in b where 3 % have crept. b = creep_per_decade: share of deformation
added per tenfold of time, positive; typical 0.01 to 0.05 for natural rubber. It takes away the slowly grown part of the
reading before the core sees it. `settled` says how a recording begins. What relaxed on the bench is in the linear
block; this goes on for hours. Left out: temperature (WLF) and load dependence of b.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

LAGS_PER_DECADE = 2
N_LAGS = 14  # seven decades


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    held, share = 0.0, 1.0  # what the lags keep, and what they take on of the elastic deformation of this sample
    for i in range(x.shape[0]):
        held += c[x.shape[0] + i] * (1.0 - c[i]) * x[i]
        share += c[x.shape[0] + i] * c[i]
    elastic = (v - held) / share
    for i in range(x.shape[0]):
        x[i] += c[i] * (elastic - x[i])
    return elastic


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    tau_s = p["start_s"] * 10.0 ** ((np.arange(N_LAGS) + 0.5) / LAGS_PER_DECADE - 1.0)
    weights = p["creep_per_decade"] / LAGS_PER_DECADE * np.exp(-p["start_s"] / tau_s)
    return np.concatenate((-np.expm1(-dt_s / tau_s), weights, [p["settled"]]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    share = 1.0
    for i in range(x.shape[0]):
        share += c[-1] * c[x.shape[0] + i]
    x[:] = c[-1] * v / share


EFFECT = Effect(
    name="creep",
    title="creep in proportion to log time",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("creep_per_decade", "-", neutral=0.0, low=0.0, high=0.3, starts=(0.01,),
                  meaning="share of the deformation added per tenfold of time",
                  expected="0.01 to 0.05 for natural rubber (b of thesis eq. 4.2)"),
        Parameter("start_s", "s", neutral=60.0, low=0.1, high=3600.0, starts=(60.0, 2.0),
                  meaning="time at which it begins to count", amplitude=False),
        Parameter("settled", "-", neutral=1.0, low=0.0, high=1.0, starts=(1.0, 0.0),
                  meaning="1: the load of the first sample had been there for ever, 0: it comes at that moment",
                  amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=14,
    equation="x = v + b sum lag_i(v) / 2,  about v (1 + b log10(1 + t / t_0)),  v: elastic",
    source=(
        "Rivin, Passive Vibration Isolation, 2003 (thesis eq. 4.2); Tschoegl, Linear Viscoelastic Behavior, 1989, ch. 6"
    ),
    separating_test="hold 5 kN for 30 min at constant temperature, then 0 N for 30 min: it creeps back",
    initial=initial,
)  # fmt: skip
