"""Creep by many retardation times: a ladder of Kelvin-Voigt elements, of which the data say how much each has.

    x = v + sum_i s_i lag_i(w),    w = v (1 + h min((v / range)^2, 1)),    v: elastic, x: read
    lag_i: first-order, tau_i = 3.2, 10, 32, ... 10 000 s

Springs and dashpots side by side, one behind the other and all in series with the mount: any retardation spectrum is
such a sum, one time (`creep_kelvin_voigt`) and the logarithm (`creep`) as well. s_i is the share of the elastic
deformation that element i has added in the end, positive. What drives it is the load: behind a spring that hardens it
grows faster than the deformation, which h, the hardening at the end of the range, allows for; solved for v by Newton's
method. `settled` says how a recording begins. Left out: temperature.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.creep_kelvin_voigt import EFFECT as ONE
from thrustd.model.stage import Floats, jit

TAUS_S = 10.0 ** (np.arange(8) / 2.0 + 0.5)  # 3.2 s to 10 000 s, two per decade
STEPS = 3  # of Newton's method: from where a spring that does not harden would be
SHARES = tuple(f"share_{tau:.2g}_s".replace("+0", "") for tau in TAUS_S)


@jit
def elastic_of(v: float, held: float, share: float, bend: Floats) -> float:
    """What is elastic of a reading v, where `held` has crept and a share of the load does now."""
    elastic = (v - held) / (1.0 + share)
    for _ in range(STEPS):
        square = bend[0] * elastic * elastic
        hard = min(square, 1.0) * bend[1]
        missed = elastic + share * elastic * (1.0 + hard) + held - v
        elastic -= missed / (1.0 + share * (1.0 + (3.0 * hard if square < 1.0 else hard)))
    return elastic


@jit
def load_of(elastic: float, bend: Floats) -> float:
    """What drives it, as a deformation; beyond the range it hardens no further."""
    return elastic * (1.0 + min(bend[0] * elastic * elastic, 1.0) * bend[1])


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n, held, share = x.size, 0.0, 0.0
    for i in range(n):
        held += c[n + i] * (1.0 - c[i]) * x[i]
        share += c[n + i] * c[i]
    elastic = elastic_of(v, held, share, c[2 * n + 1 :])
    load = load_of(elastic, c[2 * n + 1 :])
    for i in range(n):
        x[i] += c[i] * (load - x[i])
    return elastic


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    bend = 1.0 / p["range_mm"] ** 2, p["hardening"]
    return np.concatenate((-np.expm1(-dt_s / TAUS_S), [p[name] for name in SHARES], [p["settled"], *bend]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    settled, share = c[2 * x.size], 0.0
    for i in range(x.size):
        share += settled * c[x.size + i]
    elastic = elastic_of(v, 0.0, share, c[2 * x.size + 1 :])
    x[:] = settled * load_of(elastic, c[2 * x.size + 1 :])


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
        Parameter("hardening", "-", neutral=0.0, low=-0.3, high=5.0, starts=(0.0,),
                  meaning="by how much more it creeps at the end of the range", amplitude=False, spread=0.3,
                  expected="that of the spring: its force there over what its slope at no load would give, less 1"),
        Parameter("range_mm", "mm", neutral=1.0, low=1e-3, high=1e9, starts=(1.0,),
                  meaning="end of the range", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=len(TAUS_S),
    equation="x = v + sum s_i lag_i(v (1 + h min((v / range)^2, 1))),  v: elastic",
    source=ONE.source,
    separating_test="hold 5 kN for two hours at constant temperature, then nothing for two hours",
    initial=initial,
    variant_of="creep",
)  # fmt: skip
