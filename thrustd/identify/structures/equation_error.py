"""Equation-error structures (thesis section 13.3): the force predicted from its own past, then run freely.

    arx    A(q) y = B(q) u + e, least squares
    armax  A(q) y = B(q) u + C(q) e, in two stages (Hannan & Rissanen 1982): residuals of a long ARX stand in for e

Both minimise the one-step prediction error; what they are good for is the next sample, not the free run.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.identify.regression.solve import Progress
from thrustd.identify.regression.table import valid_range
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, deformation, of_spec
from thrustd.model.artifact import ComplexMode, LinearBlock, ModelSpec, PiecewiseLinear, RealMode

LAGS = 4
LONG = 20  # lags of the ARX model whose residuals stand in for e
BLOCK = 100_000
RIDGE = 1e-12
TINY = 1e-9  # poles nearer to the real axis, to zero or to each other


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """y = offset-carrying B/A u: a (n,) from lag 1 on, b (n + 1,) from lag 0 on, constant per sample."""

    a: Floats
    b: Floats
    constant: float

    def simulate(self, segment: Segment) -> Floats:
        """Free run from rest; a growing output is what an unstable model gives."""
        u = deformation(segment)
        denominator, gain = np.concatenate(([1.0], -self.a)), 1.0 - float(self.a.sum())
        drive = lfilter(self.b, [1.0], u, zi=np.cumsum(self.b[::-1])[::-1][1:] * u[0])[0] + self.constant
        rest = drive[0] / gain if gain != 0.0 else 0.0
        past = np.array([rest * self.a[i:].sum() for i in range(len(self.a))])
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(lfilter([1.0], denominator, drive, zi=past)[0], float)

    def block(self, dt_s: float) -> LinearBlock | None:
        """The same as modes behind a zero-order hold; None with a pole that is unstable, negative or double."""
        poles = np.roots(np.concatenate(([1.0], -self.a)))
        if np.any(np.abs(poles) >= 1.0) or np.any((np.abs(poles.imag) < TINY) & (poles.real <= TINY)):
            return None
        numerator = self.b - self.b[0] * np.concatenate(([1.0], -self.a))  # what is left of b behind the direct part
        slopes = np.array([np.prod(np.delete(pole - poles, i)) for i, pole in enumerate(poles)])
        if np.any(np.abs(slopes) < TINY):
            return None
        gains = np.polyval(numerator[1:], poles) / slopes / (1.0 - poles)
        rates = np.log(poles.astype(complex)) / dt_s
        pairs = list(zip(rates, gains, strict=True))
        real = [RealMode(float(-1 / r.real), float(g.real)) for r, g in pairs if abs(r.imag) * dt_s < TINY]
        complex_modes = [
            ComplexMode(float(-r.real), float(r.imag), float(2 * g.real), float(2 * g.imag))
            for r, g in pairs
            if r.imag * dt_s >= TINY
        ]
        return LinearBlock(float(self.b[0]), real, complex_modes, "zoh")


def regression(segments: Sequence[Segment], lags: int, noise: Sequence[Floats] = ()) -> Floats:
    """Least squares of y(k) on its past, u with lags 0.., past noise and 1: (lags + lags + 1 + lags or 0 + 1,)."""
    n = 2 * lags + 2 + (lags if noise else 0)
    matrix, right = np.zeros((n, n)), np.zeros(n)
    for i, segment in enumerate(segments):
        for begin in range(0, len(segment) - lags, BLOCK):
            part = slice(begin, min(begin + BLOCK + lags, len(segment)))
            table, y = _rows(segment, part, lags, noise[i] if noise else None)
            good = np.isfinite(y) & np.isfinite(table).all(axis=1)
            matrix += table[good].T @ table[good]
            right += table[good].T @ y[good]
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + RIDGE * np.eye(n)
    found: Floats = np.linalg.solve(scaled, right / size) / size
    return found


def _rows(segment: Segment, part: slice, lags: int, noise: Floats | None) -> tuple[Floats, Floats]:
    u, y = deformation(segment)[part], segment.force_n[part]
    m = len(u) - lags
    past = [y[lags - k : lags - k + m] for k in range(1, lags + 1)]
    given = [u[lags - k : lags - k + m] for k in range(lags + 1)]
    kicks = [] if noise is None else [noise[part][lags - k : lags - k + m] for k in range(1, lags + 1)]
    return np.column_stack([*past, *given, *kicks, np.ones(m)]), y[lags:]


def innovations(segment: Segment, long: Floats) -> Floats:
    """Prediction error of the long ARX model (n,), zero where it cannot be formed."""
    a, b = long[:LONG], long[LONG : 2 * LONG + 1]
    u, y = deformation(segment), np.nan_to_num(segment.force_n)
    error = lfilter(np.concatenate(([1.0], -a)), [1.0], y) - lfilter(b, [1.0], u) - long[-1]
    error[:LONG] = 0.0
    return np.asarray(error, float)


def _arx(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    found = regression(segments, LAGS)
    model = TransferFunction(found[:LAGS], found[LAGS : 2 * LAGS + 1], float(found[-1]))
    return _fitted(model, segments, "arx", len(found))


def _armax(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    long = regression(segments, LONG)
    found = regression(segments, LAGS, [innovations(segment, long) for segment in segments])
    model = TransferFunction(found[:LAGS], found[LAGS : 2 * LAGS + 1], float(found[-1]))
    return _fitted(model, segments, "armax", len(found))


def _fitted(model: TransferFunction, segments: Sequence[Segment], name: str, numbers: int) -> Fitted:
    """With an artifact where the discrete model is one in continuous time that is stable."""
    block = model.block(segments[0].dt_s)
    if block is None:
        return Fitted(
            numbers, model.simulate, note="has poles that no stable model in continuous time has: no artifact"
        )
    u = np.concatenate([deformation(s) for s in segments])
    low, high = float(u.min()), float(u.max())
    level = model.constant / (1.0 - float(model.a.sum()))
    line, out = PiecewiseLinear([low, high], [low, high]), PiecewiseLinear([0.0, 1.0], [level, level + 1.0])
    return of_spec(ModelSpec("thrustd-model/1", name, name, line, block, out, valid_range(segments)), numbers)


STRUCTURES = (
    Structure("arx", f"ARX {LAGS}/{LAGS + 1}", "linear", _arx),
    Structure("armax", f"ARMAX {LAGS}/{LAGS + 1}/{LAGS}", "linear", _armax),
)
