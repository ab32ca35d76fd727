"""Creep by many retardation times: a ladder of Kelvin-Voigt elements, of which the data say how much each has.

    x = v + sum_i s_i lag_i(v),    v: elastic, x: read;  lag_i: first-order, tau_i = 3.2, 10, 32, ... 10 000 s

Springs and dashpots side by side, one behind the other and all in series with the mount: any retardation spectrum is
such a sum, one time (`creep_kelvin_voigt`) and the logarithm (`creep`) as well. s_i is the share of the elastic
deformation that element i has added in the end, positive. `settled` says how a recording begins. Left out: temperature.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.creep_kelvin_voigt import EFFECT as ONE
from thrustd.model.stage import Floats, jit

TAUS_S = 10.0 ** (np.arange(8) / 2.0 + 0.5)  # 3.2 s to 10 000 s, two per decade
SHARES = tuple(f"share_{tau:.2g}_s".replace("+0", "") for tau in TAUS_S)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n, held, share = x.size, 0.0, 1.0
    for i in range(n):
        held += c[n + i] * (1.0 - c[i]) * x[i]
        share += c[n + i] * c[i]
    elastic = (v - held) / share
    for i in range(n):
        x[i] += c[i] * (elastic - x[i])
    return elastic


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.concatenate((-np.expm1(-dt_s / TAUS_S), [p[name] for name in SHARES], [p["settled"]]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    share = 1.0
    for i in range(x.size):
        share += c[-1] * c[x.size + i]
    x[:] = c[-1] * v / share


EFFECT = Effect(
    name="creep_spectrum",
    title="creep by many retardation times",
    site="deformation",
    channels=(),
    parameters=(
        *(
            Parameter(name, "-", neutral=0.0, low=0.0, high=0.5, starts=(0.01,),
                      meaning=f"share of the elastic deformation that creeps with {tau:.2g} s",
                      expected="0.02 to 0.15 for natural rubber, all together")
            for name, tau in zip(SHARES, TAUS_S, strict=True)
        ),
        *(p for p in ONE.parameters if p.name == "settled"),
    ),
    step=step,
    prepare=prepare,
    n_state=len(TAUS_S),
    equation="x = v + sum s_i lag_i(v),  v: elastic",
    source=ONE.source,
    separating_test="hold 5 kN for two hours at constant temperature, then nothing for two hours",
    initial=initial,
    variant_of="creep",
)  # fmt: skip
