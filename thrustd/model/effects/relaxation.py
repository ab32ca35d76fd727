"""Relaxation: further Maxwell branches in the linear block, on a fixed log-spaced set of time constants.

    x = w + sum_i g_i (w - lag_i(w)) beside the block's own,    lag_i: first-order, tau_i = 0.3, 1, 3, 10, ... 10 000 s

Each branch carries a share g_i of the force at once and lets it go with tau_i: short-time stiffness rises, the settled
force stays. The branches lie beside those of the model (w is the force at rest), as springs do in a mount: behind them
they would relax what has relaxed already. g_i positive: rubber dissipates. Where one mount of the same drawing relaxes
more than the one on the bench, this is what is missing; the ladder of time constants stands for any spectrum
(Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989, ch. 4). Left out: nonlinear branches.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter

TAUS_S = 10.0 ** (np.arange(10) / 2.0 - 0.5)  # 0.32 s to 10 000 s, two per decade


def lags(p: Mapping[str, float]) -> list[tuple[float, float]]:
    """Time constants, s, and gains of all branches."""
    return [(float(tau), p[name]) for tau, name in zip(TAUS_S, GAINS, strict=True)]


GAINS = tuple(f"gain_{tau:.2g}_s".replace("+0", "") for tau in TAUS_S)

EFFECT = Effect(
    name="relaxation",
    title="relaxation of the rubber (further Maxwell branches)",
    site="linear",
    channels=(),
    parameters=tuple(
        Parameter(name, "-", neutral=0.0, low=0.0, high=1e3, starts=(0.02,),
                  meaning=f"share of the force that relaxes with {tau:.2g} s",
                  expected="0.01 to 0.1 for filled natural rubber")
        for name, tau in zip(GAINS, TAUS_S, strict=True)
    ),
    step=None,
    prepare=None,
    n_state=0,
    equation="x = w + sum g_i (w - lag_i(w)) in the linear block",
    source="Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989, ch. 4",
    separating_test="steps between two levels, each held for 30 min: the force falls while the deformation is held",
    lags=lags,
)  # fmt: skip
