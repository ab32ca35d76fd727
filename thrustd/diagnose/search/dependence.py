"""How the residual follows a channel, whatever the law: the picture behind the verdict `unknown`."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.curves import Followed
from thrustd.diagnose.search.joint import Joint
from thrustd.identify.regression.record import Record
from thrustd.model.free_curve import CURVE_OF, column_of

DRAWN = 100_000  # samples at most


@dataclass(frozen=True, slots=True)
class Dependence:
    """What a free curve of one channel would remove, and the curve: residual against the channel, binned."""

    channel: str
    rmse_before_n: float
    rmse_after_n: float
    at: Floats  # (bins,) channel
    residual_n: Floats  # (bins,) mean residual
    low_n: Floats  # (bins,) 10 % and
    high_n: Floats  # (bins,) 90 % of the residual in the bin

    @property
    def name(self) -> str:
        """The free curve as `extend` takes it."""
        return CURVE_OF + self.channel


def dependences(
    base: Base, rows: Sequence[Record], fit: Joint, curves: Sequence[Followed], tremble: float
) -> list[Dependence]:
    """What a fit leaves along every channel that it follows; without `tremble` (see `Base`) the curves were found."""
    missed = np.concatenate(fit.solution.normal.residuals) * base.scale
    good = np.isfinite(missed)
    now, found = base.scale * float(np.sqrt(fit.mse)), []
    for one in curves:
        column = np.concatenate([column_of(one.channel, record.channels) for record in rows])
        after = min(base.scale * float(np.sqrt(one.leaves + tremble)), now)
        thin = slice(None, None, max(1, np.count_nonzero(good) // DRAWN))
        found.append(drawn(one.channel, column[good][thin], missed[good][thin], now, after))
    return found


def drawn(channel: str, column: Floats, residual_n: Floats, before: float, after: float, bins: int = 24) -> Dependence:
    """Binned means with an 80 % band, for the picture."""
    good = np.isfinite(residual_n)
    w, r = column[good], residual_n[good]
    edges = np.unique(np.quantile(w, np.linspace(0, 1, bins + 1)))
    number = np.clip(np.searchsorted(edges, w, side="right") - 1, 0, len(edges) - 2)
    order = np.argsort(number, kind="stable")
    parts = np.split(np.column_stack((w, r))[order], np.flatnonzero(np.diff(number[order])) + 1)
    table = np.array([[p[:, 0].mean(), p[:, 1].mean(), *np.quantile(p[:, 1], [0.1, 0.9])] for p in parts if len(p)])
    return Dependence(channel, before, after, table[:, 0], table[:, 1], table[:, 2], table[:, 3])
