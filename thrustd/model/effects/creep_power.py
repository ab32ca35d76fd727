"""Creep as a power of time (Andrade): under load rubber keeps yielding, each tenfold of time by more than the last.

    deformation = elastic deformation * (1 + s (t / 1 min)^n)      under a load held from t = 0
    here:  x = v + sum_i w_i lag_i(v),    w_i = s n / Gamma(1 - n) (tau_i / 1 min)^n ln(10) / 2,    v: elastic, x: read
    lag_i: first-order lags of time constant tau_i, two per decade from 0.1 s to twelve days

The weights are the retardation spectrum of a power of time, n / Gamma(1 - n) tau^n per unit of ln tau, so it holds for
any load history and runs causally. What is faster than 0.1 s is in the first lag, what is slower than twelve days in
the last. A variant of `creep`, whose n is 0: there each tenfold adds as much. n is 1/3 in Andrade's law and 0.1 to 0.5
for polymers, glued layers and filled rubber. creep_at_minute is positive. It is solved for v at every sample, as in
`creep`. Left out: temperature (WLF), steady flow.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.creep import LAGS_PER_DECADE, N_LAGS, initial, step
from thrustd.model.stage import Floats

FASTEST_S = 0.1
SLOWEST_S = FASTEST_S * 10.0 ** (N_LAGS / LAGS_PER_DECADE)
TAUS_S = FASTEST_S * 10.0 ** ((np.arange(N_LAGS) + 0.5) / LAGS_PER_DECADE)
MINUTE_S = 60.0


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    n = p["power"]
    whole = p["creep_at_minute"] / math.gamma(1.0 - n)
    weights = whole * n * (TAUS_S / MINUTE_S) ** n * math.log(10.0) / LAGS_PER_DECADE
    weights[0] += whole * (FASTEST_S / MINUTE_S) ** n
    weights[-1] += whole * n / (1.0 - n) * (SLOWEST_S / MINUTE_S) ** n * TAUS_S[-1] / SLOWEST_S
    return np.concatenate((-np.expm1(-dt_s / TAUS_S), weights, [p["settled"]]))


EFFECT = Effect(
    name="creep_power",
    title="creep as a power of time (Andrade)",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("creep_at_minute", "-", neutral=0.0, low=0.0, high=0.3, starts=(0.005,),
                  meaning="share of the elastic deformation that has crept after a minute",
                  expected="0.002 to 0.02 for natural rubber"),
        Parameter("power", "-", neutral=1.0 / 3.0, low=0.03, high=0.9, starts=(1.0 / 3.0,),
                  meaning="of time", amplitude=False, spread=0.15),
        Parameter("settled", "-", neutral=1.0, low=0.0, high=1.0, starts=(1.0, 0.0),
                  meaning="1: the load of the first sample had been there for weeks, 0: it comes at that moment",
                  amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=14,
    equation="x = v + sum w_i lag_i(v),  about v (1 + s (t / 1 min)^n),  v: elastic",
    source="Andrade, Proc. R. Soc. A 84 (1910) 1; Tschoegl, Linear Viscoelastic Behavior, 1989, ch. 6",
    separating_test="hold 5 kN for two hours at constant temperature: against log time the deformation bends up",
    initial=initial,
    variant_of="creep",
)  # fmt: skip
