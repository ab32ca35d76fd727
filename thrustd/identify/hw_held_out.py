"""How rough the curves may be: what blocks of data that were held back say.

Curves of ten segments follow forty numbers; an hour of steps holds thirty levels. So the search stands on smooth curves
first (cubics), then frees the knots, held to the cubics by reins of several strengths and without. Whatever predicts
held-back blocks best wins, where "held back" means: the model runs through the block freely, but its samples carry no
weight. From long records, a model without reins that predicts them as well as it fits the others is taken at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from thrustd.identify.hw_prior import LOOSE, Reins
from thrustd.identify.hw_problem import Point, Signal, residuals_of, slow_variance

BLOCKS, MIDDLE = 5, 3  # of all data; the first is never held back, as it shows the initial state
EACH = tuple(range(1, BLOCKS))  # held back one after the other
PLENTY = 1.1  # error on held-back blocks over the error on the others, with which no reins are needed
TIGHTNESS = (0.002, 0.01, 0.05)  # of the output's range: one sigma of a knot about the smooth curve
APART = 0.01  # of the curve's range: knots on reins come no nearer

Search = Callable[[Point, list[Signal], Reins], Point]


class Fold(NamedTuple):
    train: list[Signal]
    held: list[Signal]


def folds_of(signals: Sequence[Signal], blocks: Sequence[int]) -> list[Fold]:
    """Data with one block held back each; where none of them shows the output, all data once and nothing held back."""
    total = sum(len(signal.u) for signal in signals)
    folds = []
    for block in blocks:
        low, high = block * total // BLOCKS, (block + 1) * total // BLOCKS
        train, held, at = [], [], 0
        for signal in signals:
            inside = (signal.chosen + at >= low) & (signal.chosen + at < high)
            train.append(replace(signal, chosen=signal.chosen[~inside]))
            held.append(replace(signal, chosen=signal.chosen[inside]))
            at += len(signal.u)
        folds.append(Fold(train, held))
    return [fold for fold in folds if _rows(fold.held) > 0 and _rows(fold.train) > 0] or [Fold([*signals], [*signals])]


class Choice(NamedTuple):
    """Reins, where the search ended with them on the last fold, and what they did there.

    held: mean squared error on the blocks held back; ratio: error on these over that on the others.
    """

    reins: Reins
    point: Point
    held: float
    ratio: float


def choose_reins(
    smooth: Point, starts: Sequence[Point], folds: Sequence[Fold], search: Search, like: Reins, plenty: bool
) -> Choice:
    """The reins that predict held-back blocks best.

    smooth: the fitted smooth model; starts: the same with free knots, and others to be tried without reins; like:
    carries the smooth curves; plenty: data so long that no reins are tried when the model without predicts as well as
    it fits.
    """
    start, *others = starts
    best = _tried(start, folds, search, LOOSE)
    if best.ratio <= PLENTY and plenty:
        return best
    variance = slow_variance(residuals_of(smooth, folds[-1].train))
    tighter = [replace(like, bend_std=bend, closest=APART, variance=variance) for bend in TIGHTNESS]
    choices = [best, *(_tried(start, folds, search, reins) for reins in tighter)]
    choices += [_tried(other, folds, search, LOOSE) for other in others]
    return min(choices, key=lambda choice: choice.held)


def rescaled(reins: Reins, smooth: Point, signals: Sequence[Signal]) -> Reins:
    """The same reins on other samples: colour makes more samples of the same data no more telling."""
    return reins if reins.variance is None else replace(reins, variance=slow_variance(residuals_of(smooth, signals)))


def _tried(start: Point, folds: Sequence[Fold], search: Search, reins: Reins) -> Choice:
    held, seen, point = [], [], start
    for fold in folds:
        point = search(start, fold.train, reins)
        held.append(mean_square(point, fold.held))
        seen.append(mean_square(point, fold.train))
    error = float(np.mean(held))
    return Choice(reins, point, error, float(np.sqrt(error / np.mean(seen))))


def mean_square(point: Point, signals: Sequence[Signal]) -> float:
    return float(np.mean(residuals_of(point, signals) ** 2))


def _rows(signals: Sequence[Signal]) -> int:
    return sum(len(signal.chosen) for signal in signals)
