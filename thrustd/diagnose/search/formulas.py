"""Where the free names of a user's formula begin, and how far they may go: by what stands beside them on these records.

Of the sum or product in which a name stands, up to the next function or power, the part without it is `rest` and what
it multiplies is `part`. It has the unit of rest / part: p0 in k * (pressure_bar - p0) is a pressure, of the level and
spread of that channel, w in tanh(speed / w) a speed. An amplitude is of the size that makes the formula as large as
the force is. All are wide, so that the data decide.
"""

import ast
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Flags
from thrustd.core.errors import ModelError
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term, at_start
from thrustd.model.effect import Effect
from thrustd.model.expression import PREFIX, along
from thrustd.model.stage import Floats

WIDE = 10.0  # times the force's spread: sigma of what an amplitude adds
FURTHER = 3.0  # times its size: sigma of a factor, which may have either sign
MANY = 3  # names that are begun at several places: every one more would multiply the starts
NEAR = 0.05  # sigmas around a start where the formula has to be a number, too: elsewhere no search can leave it
MOST = 0.995  # of the rows: the others may be outliers
CONSTANT = 1e-9  # of its size: what varies less does not


@dataclass(frozen=True, slots=True)
class _Begin:
    """Starts of a name, the first the likeliest, and its sigma where it moves by adding; 0: by factors."""

    starts: tuple[float, ...] = (1.0,)
    std: float = 0.0


def formula_terms(effect: Effect, records: Sequence[Record], spread_n: float) -> list[Term]:
    """A formula from every start of its names at which it is a number on all rows; ModelError where there is none.

    spread_n: one standard deviation of the force, N.
    """
    tree = ast.parse(effect.name.removeprefix(PREFIX), mode="eval").body
    channels = {
        name: np.concatenate([record.seen.channels[name][record.stood :] for record in records])
        for name in dict.fromkeys((*effect.channels, "time_s"))
    }
    begins = _begins(effect, tree, channels)
    std = {name: one.std for name, one in begins.items() if one.std > 0.0}
    likely = {name: one.starts[0] for name, one in begins.items()}
    std |= _amplitudes(effect, tree, channels, likely, spread_n)
    starts = [one.starts if i < MANY else one.starts[:1] for i, one in enumerate(begins.values())]
    terms = [at_start(effect, std, dict(zip(begins, values, strict=True))) for values in itertools.product(*starts)]
    missing = [_missing(term, tree, channels) for term in terms]
    able = [term for term, rows in zip(terms, missing, strict=True) if not rows.any()]
    if not able:
        raise ModelError(_undefined(effect, channels, min(missing, key=np.count_nonzero)))
    return able


def _undefined(effect: Effect, channels: Mapping[str, Floats], rows: Flags) -> str:
    first = int(np.argmax(rows))
    values = " and ".join(f"{name} is {channels[name][first]:.4g}" for name in effect.channels if name != "time_s")
    place = f"where {values} at" if values else "at"
    return (
        f"{effect.name}: no value on {np.count_nonzero(rows)} of {len(rows)} rows, e.g. {place}"
        f" {channels['time_s'][first]:.1f} s; expected a formula that is a number everywhere"
    )


def _missing(term: Term, tree: ast.expr, channels: Mapping[str, Floats]) -> Flags:
    """Rows (n,) on which a formula is no number at its start or near it."""
    near = [term.values(np.full(len(term.free), number)) for number in (NEAR, -NEAR)]
    return ~np.all([np.isfinite(along(tree, channels, values)) for values in near], axis=0)


def _begins(effect: Effect, tree: ast.expr, channels: Mapping[str, Floats]) -> dict[str, _Begin]:
    """Of every name that is no amplitude. Twice: the size of one may follow from the start of another."""
    shapes = [p.name for p in effect.parameters if not p.amplitude]
    places = dict(reversed(list(_places(tree, tree))))  # where it stands first
    values, begins = {p.name: 1.0 for p in effect.parameters}, dict[str, _Begin]()
    for _ in range(2):
        begins = {name: _begin(places[name], name, channels, values) for name in shapes}
        values |= {name: one.starts[0] for name, one in begins.items()}
    return begins


def _places(node: ast.AST, region: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """Every name with the sum or product in which it stands."""
    if isinstance(node, ast.Name):
        yield node.id, region
    elif isinstance(node, ast.Call):
        yield from _places(node.args[0], node.args[0])
    elif isinstance(node, ast.BinOp):
        power = isinstance(node.op, ast.Pow)
        for side in (node.left, node.right):
            yield from _places(side, side if power else region)
    elif isinstance(node, ast.UnaryOp):
        yield from _places(node.operand, region)


def _begin(region: ast.expr, name: str, channels: Mapping[str, Floats], values: Mapping[str, float]) -> _Begin:
    at = [along(region, channels, {**values, name: number}) for number in (0.0, 1.0, 2.0)]
    if not np.any(np.isfinite(at[0])):  # it divides
        part = 2.0 * (at[1] - at[2])
        size = _most(part) / (_middle(np.abs(at[1] - part), part) or 1.0)
        return _Begin(tuple(dict.fromkeys((size, 1.0)))) if size > 0.0 else _Begin()
    rest, part = at[0], at[1] - at[0]
    level, most = _middle(np.abs(rest), at[1]), _most(part)
    still = bool(np.all(np.abs(part - part[0]) <= CONSTANT * most))
    if most == 0.0 or (still and level == 0.0):  # a pure number, such as an exponent
        return _Begin()
    if not still:  # a factor of what varies, at which the largest is as large as what stands beside it
        size = (level or 1.0) / most
        return _Begin((size, -size), FURTHER * size)
    zero = -rest[np.isfinite(rest)] / part[0]  # of the sum
    middle, low, high = float(np.median(zero)), float(zero.min()), float(zero.max())
    half = (high - low) / 2.0
    return _Begin(tuple(dict.fromkeys((middle, low - half, high + half))), float(np.hypot(middle, high - low)))


def _middle(values: Floats, beside: Floats) -> float:
    """The median of what is there; 0 where it is but rounding."""
    there = values[np.isfinite(values)]
    middle = float(np.median(there)) if len(there) else 0.0
    return middle if middle > CONSTANT * _most(beside) else 0.0


def _most(values: Floats) -> float:
    """The largest size but for a few outliers."""
    there = np.abs(values[np.isfinite(values)])
    return float(np.quantile(there, MOST)) if len(there) else 0.0


def _amplitudes(
    effect: Effect, tree: ast.expr, channels: Mapping[str, Floats], values: Mapping[str, float], spread_n: float
) -> dict[str, float]:
    """One sigma of each: by what it adds where the others are 1, or nothing if they vanish only together."""
    names, found = [p.name for p in effect.parameters if p.amplitude], {}
    for name in names:
        ones = {**values, **dict.fromkeys(names, 1.0)}
        added = along(tree, channels, ones) - along(tree, channels, {**ones, name: 0.0})
        there = added[np.isfinite(added)]
        level = float(np.abs(np.mean(there))) if len(there) else 0.0
        spread = float(np.std(there)) if len(there) else 0.0
        size = spread if spread > CONSTANT * level else level
        found[name] = WIDE * spread_n / size if size > 0.0 and spread_n > 0.0 else WIDE
    return found
