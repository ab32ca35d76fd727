"""Relaxation: further Maxwell branches beside the linear block, on a fixed log-spaced set of time constants.

    force = F + sum_i g_i (F - lag_i(F)),    lag_i: first-order, tau_i = 0.3, 1, 3, 10, ... 10 000 s

Each branch carries a share g_i of the force at once and lets it go with tau_i: short-time stiffness rises, the settled
force stays. g_i positive: rubber dissipates. Where one mount of the same drawing relaxes more than the one on the
bench, this is what is missing; the ladder of time constants stands for any spectrum (Tschoegl, The Phenomenological
Theory of Linear Viscoelastic Behavior, 1989, ch. 4). Starts settled at the first force. Left out: nonlinear branches.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

TAUS_S = 10.0 ** (np.arange(10) / 2.0 - 0.5)  # 0.32 s to 10 000 s, two per decade


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = x.size
    out = v
    for i in range(n):
        x[i] += c[i] * (v - x[i])
        out += c[n + i] * (v - x[i])
    return out


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.concatenate((-np.expm1(-dt_s / TAUS_S), [p[name] for name in GAINS]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[:] = v


GAINS = tuple(f"gain_{tau:.2g}_s".replace("+0", "") for tau in TAUS_S)

EFFECT = Effect(
    name="relaxation",
    title="relaxation of the rubber (further Maxwell branches)",
    site="gain",
    channels=(),
    parameters=tuple(
        Parameter(name, "-", neutral=0.0, low=0.0, high=2.0, starts=(0.02,),
                  meaning=f"share of the force that relaxes with {tau:.2g} s",
                  expected="0.01 to 0.1 for filled natural rubber")
        for name, tau in zip(GAINS, TAUS_S, strict=True)
    ),
    step=step,
    prepare=prepare,
    n_state=len(TAUS_S),
    equation="F = F_core + sum g_i (F_core - lag_i(F_core))",
    source="Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989, ch. 4",
    separating_test="steps between two levels, each held for 30 min: the force falls while the deformation is held",
    initial=initial,
)  # fmt: skip
