"""Which channel the residual follows, whatever the law: the question behind the verdict `unknown`.

For one channel w the residual is regressed on a free curve of w and on the model force times a free curve of w (broken
lines through quantiles of w). No physics in it: it bounds what any effect of that channel could remove, and an effect
of the library that removes much less is not the explanation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.diagnose.search.candidates import moves
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.gram import BlockGram, Fit, held_out_fit
from thrustd.model.stage import Floats

KNOTS = 5  # inner knots of a free curve
RIDGE = 0.01
BESIDE = 1e-6
RATE_S = 1.0  # over which the rate of deformation is taken
OWN = ("force_model_N", "deformation_mm", "deformation_rate_mm_s")  # what the model itself reads


@dataclass(frozen=True, slots=True)
class FreeCurve:
    """Columns of one channel in the table of `block_gram`."""

    channel: str
    columns: Floats  # (n, 2 * (KNOTS + 2))


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


def free_curves(evidence: Evidence, output_n: Floats) -> list[FreeCurve]:
    """One for every moving channel of the data, the model's own force and rate included."""
    scale = max(float(np.sqrt(np.mean(output_n**2))), 1e-9)
    found = [FreeCurve("(constant)", np.column_stack((np.ones(len(output_n)), output_n / scale)))]
    for name, column in channels_of(evidence, output_n).items():
        if not moves(column):
            continue
        base = _broken_lines(column)
        found.append(FreeCurve(name, np.column_stack((base, base * (output_n / scale)[:, None]))))
    return found


def channels_of(evidence: Evidence, output_n: Floats) -> dict[str, Floats]:
    """Every column of the data by row, with the model's force and the rate of deformation."""
    step = max(1, round(RATE_S / evidence.row_s))
    deformation = evidence.channels["deformation_mm"]
    rate = np.zeros_like(deformation)
    rate[step:] = (deformation[step:] - deformation[:-step]) / (step * evidence.row_s)
    rate[np.flatnonzero(np.diff(evidence.segment)) + 1] = 0.0
    return dict(evidence.channels) | {"time_s": evidence.time_s, OWN[0]: output_n, OWN[2]: rate}


def _broken_lines(column: Floats) -> Floats:
    """1, w and hinges max(0, w - knot) at quantiles, w scaled to its spread (n, KNOTS + 2)."""
    low, high = np.quantile(column, [0.005, 0.995])
    w = np.clip((column - low) / max(high - low, 1e-12), -0.2, 1.2)
    knots = np.unique(np.quantile(w, np.linspace(0, 1, KNOTS + 2)[1:-1]))
    return np.column_stack([np.ones_like(w), w, *(np.maximum(0.0, w - knot) for knot in knots)])


def curve_fit(gram: BlockGram, at: Sequence[int], others: Sequence[int]) -> Fit:
    """Held-out fit of a free curve beside columns `others`."""
    return held_out_fit(gram, [*others, *at], [BESIDE] * len(others) + [RIDGE] * len(at), schemes=1)


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
