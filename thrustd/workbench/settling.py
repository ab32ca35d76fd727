"""How long a model remembers that it was started at rest, while the mount it models was already at work.

    share(t) = sum |gain_i| exp(-t / tau_i) / |DC gain|        Prony modes of the linear block, as in the artifact

is the largest part of the force that an unknown start can still be wrong by after t seconds. The diagnosis takes no
decay of these modes as evidence: what the lags remember at the starts is part of its prior (`diagnose.search.base`).
The page says where they may show.
"""

import numpy as np

from thrustd.model.artifact import LinearBlock

SHARE = 0.002  # of the force: below it a start is forgotten
TIMES_S = np.geomspace(0.1, 1e6, 281)  # looked at, 6 % apart


def settling_s(linear: LinearBlock) -> float:
    """Seconds after which the start is forgotten; 0 for a model without slow modes."""
    dc_gain = linear.direct + sum(mode.gain for mode in linear.real_modes)
    share = np.zeros(len(TIMES_S))
    for mode in linear.real_modes:
        share += abs(mode.gain / dc_gain) * np.exp(-TIMES_S / mode.tau_s) if dc_gain else 0.0
    late = np.flatnonzero(share > SHARE)
    return float(TIMES_S[late[-1]]) if len(late) else 0.0
