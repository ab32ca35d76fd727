"""What a free function of the motion and its memory leaves of a residual: nothing that a law of it could be told by.

The motion is seen as a law could remember it: where it is, stops of several radii, what is faster than several times.
Where it comes back to the same place in all of these, as in repeated cycles, neighbours elsewhere in the records say
what it was there (k nearest); where it never does, a smooth function says it (cosines of random directions, which are a
Gaussian process: Rahimi & Recht, NIPS 20 (2007) 1177). Both are judged on blocks that they have not seen, and a
function that explains nothing leaves all of it.
"""

from collections.abc import Iterator

import numpy as np
from scipy.signal import lfilter
from scipy.spatial import cKDTree

from thrustd.core.columns import Floats
from thrustd.core.measures import held_out_groups, rms
from thrustd.diagnose.search.blocks import BLOCKS, FOLDS
from thrustd.diagnose.search.joint import Joint
from thrustd.identify.regression.record import Indices, Record
from thrustd.identify.regression.stops import at_rest, run_stops

ROWS = 8000  # at most
RADII = 0.5 ** np.arange(1, 5)  # of the half travel
TIMES = 2.0 * 4.0 ** np.arange(4)  # samples
NEIGHBOURS = 4, 8, 16, 32
COSINES, WIDTHS, RIDGES = 300, (1.0, 2.0, 4.0), (1e-6, 1e-4, 1e-2)  # their number, in sigmas of the motion, per row


def unexplained(fit: Joint) -> float:
    """Rms on held-back blocks, in units of the base's output scale."""
    residual = np.concatenate(fit.solution.normal.residuals)
    there = np.flatnonzero(np.isfinite(residual))
    there = there[:: -(-len(there) // ROWS)]
    seen, left = np.concatenate([_seen(record) for record in fit.records])[there], residual[there]
    seen = seen / np.maximum(seen.std(axis=0), 1e-12 * np.abs(seen).max())
    fold = held_out_groups(BLOCKS, FOLDS)[np.arange(len(left)) * BLOCKS // len(left)]
    guesses = [*_by_neighbours(seen, left, fold), *_smooth(seen, left, fold), 0.0 * left]
    return min(rms(left - guess) for guess in guesses)


def _seen(record: Record) -> Floats:
    """The motion of one record (n, k)."""
    d, radii = record.d, RADII * np.ptp(record.d) / 2.0
    stops = np.empty((len(d), len(radii)))
    run_stops(radii, at_rest(radii, d[0]), d, stops)
    keeps = np.exp(-1.0 / TIMES)
    fast = [d - d[0] - lfilter([1.0 - keep], [1.0, -keep], d - d[0]) for keep in keeps]
    return np.column_stack([d, stops, *fast])


def _by_neighbours(seen: Floats, left: Floats, fold: Indices) -> Iterator[Floats]:
    near = np.empty((len(left), max(NEIGHBOURS)))
    for k in range(FOLDS):
        mine = fold == k
        near[mine] = left[~mine][cKDTree(seen[~mine]).query(seen[mine], k=max(NEIGHBOURS))[1]]
    for count in NEIGHBOURS:
        yield near[:, :count].mean(axis=1)


def _smooth(seen: Floats, left: Floats, fold: Indices) -> Iterator[Floats]:
    rng, n = np.random.default_rng(0), seen.shape[1]
    ways, phases = rng.normal(size=(n, COSINES)) * 2.0 / np.sqrt(n), rng.uniform(0.0, 2.0 * np.pi, COSINES)
    for width in WIDTHS:
        table = np.column_stack([np.cos(2.0 * seen @ ways / width + phases), seen, np.ones(len(seen))])
        parts = [(table[fold == k], left[fold == k]) for k in range(FOLDS)]
        squares, right = [rows.T @ rows for rows, _ in parts], [rows.T @ own for rows, own in parts]
        for ridge in RIDGES:
            guess, held = np.empty(len(left)), ridge * len(left) * np.eye(table.shape[1])
            for k in range(FOLDS):
                found = np.linalg.solve(sum(squares) - squares[k] + held, sum(right) - right[k])
                guess[fold == k] = parts[k][0] @ found
            yield guess
