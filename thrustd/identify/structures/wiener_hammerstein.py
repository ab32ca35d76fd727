"""Wiener-Hammerstein: a linear block on either side of one curve, deformation -> G1 -> h -> G2 -> force.

With a random input the best linear model of such a system is G1 G2 times a number (Bussgang), so its poles and zeros
belong to one block or to the other. Every share-out is tried: u through G1, powers of that through G2, least squares
for what they weigh (Sjoberg & Schoukens, Automatica 48(2), 2012). The best few are then estimated whole, and so are
the Wiener and the Hammerstein model, which this one contains; what follows blocks held back best is taken.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.first_state import SETTLING
from thrustd.identify.parameters import pack
from thrustd.identify.regression.general import Asked, holds_of
from thrustd.identify.regression.shape import Hold
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import DEFORMATION, Segment, head
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, deformation, of_spec
from thrustd.identify.structures.trial import Bench, Trial
from thrustd.model.artifact import ComplexMode, Curve, LinearBlock, ModelSpec, PiecewiseLinear, Polynomial, RealMode
from thrustd.model.compile import compile_model, linear_stage

Roots = NDArray[np.complex128]

CHOSEN = ("linear.*", "output_curve.*", "output_linear.*")
ORDERS = (2, 3, 4, 6)  # of the best linear model
DEGREE = 5  # of the curve while share-outs are compared
SEGMENTS = 10
RANKED = 6_000  # samples on which share-outs are compared
FINALISTS, TRIED = 4, 30_000  # of them estimated, on so many samples
FINAL = 120_000  # samples for the last estimate
MOST_SPLITS = 3_000
GROWTH, WORTH_IT = 4, 0.97  # real modes that may be added, each for an error that falls at least to so much
NEW_GAIN = 0.02
MOST_GAIN = 100.0  # of a mode: blocks that undo each other integrate the errors of the curve between them
FAR = 100.0  # times the fastest pole: a zero further out does nothing


class Split(NamedTuple):
    error: float
    first: LinearBlock
    curve: PiecewiseLinear
    second: LinearBlock


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    shown = head(max(segments, key=len), RANKED)
    few = Bench([head(segment, TRIED) for segment in segments[:5]], CHOSEN)
    holds = holds_of(segments)
    within = [spec for hold in holds for spec in _contained(segments, fits, hold, progress)]
    ends = [end for hold in holds for end in _ends(segments, fits, hold, few, shown, progress)]
    ends += [few.tried(spec, 8) for spec in within]
    best = _grown(min(ends, key=lambda trial: trial.error), few)
    all_of_it = Bench([head(segment, FINAL) for segment in segments], CHOSEN)
    coarse = all_of_it.tried(best, 20)
    fine = all_of_it.tried(_finer(coarse.spec), 20)
    found = min((coarse, fine), key=lambda trial: trial.error).spec
    spec = min((found, *within), key=Bench(list(segments), CHOSEN).error)  # few samples may mislead
    spec = reached(spec, segments)
    return of_spec(msgspec.structs.replace(spec, structure="wiener-hammerstein"), len(pack(spec, CHOSEN)) - 2)


def reached(spec: ModelSpec, segments: Sequence[Segment]) -> ModelSpec:
    """With the curve as far as these data reach: a knot that no sample lies beside may stand anywhere."""
    curve = spec.output_curve
    if not isinstance(curve, PiecewiseLinear):
        return spec
    bare = msgspec.structs.replace(spec, output_curve=PiecewiseLinear([0.0, 1.0], [0.0, 1.0]), output_linear=None)
    before = [compile_model(bare, 1.0 / s.dt_s).simulate(deformation(s)[:, None]) for s in segments]
    low, high = min(float(x.min()) for x in before), max(float(x.max()) for x in before)
    first = max(int(np.searchsorted(curve.x, low, side="right")) - 1, 0)
    last = max(int(np.searchsorted(curve.x, high)), first + 1)
    within = slice(min(first, len(curve.x) - 2), last + 1)
    return msgspec.structs.replace(spec, output_curve=PiecewiseLinear(curve.x[within], curve.y[within]))


def _finer(spec: ModelSpec) -> ModelSpec:
    """Twice as many segments in the curve, where they are long."""
    curve = spec.output_curve
    assert isinstance(curve, PiecewiseLinear)
    x = np.array(curve.x)
    between = np.sort(np.concatenate((x, 0.5 * (x[1:] + x[:-1]))))
    heights = np.interp(between, x, curve.y)
    return msgspec.structs.replace(spec, output_curve=PiecewiseLinear(between.tolist(), heights.tolist()))


def _ends(
    segments: Sequence[Segment], fits: BlockFits, hold: Hold, few: Bench, shown: Segment, progress: Progress | None
) -> list[Trial]:
    """The best shares of the linear models' poles and zeros."""
    lines = [Asked("line", "line", order=order, hold=hold) for order in ORDERS]
    linears = [fits.of(segments, asked, progress).spec for asked in lines]
    splits = [(split.error, _spec(linear, split)) for linear in linears for split in _splits(linear.linear, shown)]
    splits.sort(key=lambda split: split[0])
    return [few.tried(spec, 8) for _, spec in splits[:FINALISTS]]


def _contained(segments: Sequence[Segment], fits: BlockFits, hold: Hold, progress: Progress | None) -> list[ModelSpec]:
    """The Wiener and the Hammerstein model of these data as a curve between two blocks, one of which does nothing."""
    asked = Asked("line", "curve", segments=SEGMENTS, hold=hold), Asked("curve", "line", segments=SEGMENTS, hold=hold)
    wiener, hammerstein = (fits.of(segments, wanted, progress).spec for wanted in asked)
    return [msgspec.structs.replace(wiener, output_linear=LinearBlock(1.0, hold=hold)), _turned(hammerstein)]


def _turned(spec: ModelSpec) -> ModelSpec:
    """A Hammerstein model: its output line goes into the curve, its linear block behind it."""
    line, block = spec.output_curve, spec.linear
    assert isinstance(line, PiecewiseLinear)
    slope = (line.y[-1] - line.y[0]) / (line.x[-1] - line.x[0])
    steady = block.direct + sum(m.gain for m in block.real_modes) + sum(m.gain_re for m in block.complex_modes)
    level = (line.y[0] - slope * line.x[0]) / steady
    low, high = spec.valid.deformation_mm
    return msgspec.structs.replace(
        spec,
        input_curve=PiecewiseLinear([low, high], [low, high]),
        linear=LinearBlock(1.0),
        output_curve=_stretched(spec.input_curve, slope, level),
        output_linear=block,
    )


def _stretched(curve: Curve, slope: float, level: float) -> Curve:
    """level + slope times the curve."""
    if isinstance(curve, Polynomial):
        first, *others = (slope * value for value in curve.coefficients)
        return Polynomial(curve.centre, curve.scale, [first + level, *others])
    return PiecewiseLinear(curve.x, [level + slope * y for y in curve.y])


def _grown(best: Trial, bench: Bench) -> ModelSpec:
    """With further real modes in either block: the best linear model melts neighbouring poles of both into one."""
    for _ in range(GROWTH):
        longer = min((bench.tried(spec, 12) for spec in _one_mode_more(best.spec)), key=lambda trial: trial.error)
        if longer.error > WORTH_IT * best.error:
            break
        best = longer
    return best.spec


def _one_mode_more(spec: ModelSpec) -> list[ModelSpec]:
    assert spec.output_linear is not None
    known = np.concatenate([_poles(block) for block in (spec.linear, spec.output_linear)])
    tau_s = float(np.exp(-np.log(np.abs(known)).mean()))
    first, second = (_with_mode(block, tau_s) for block in (spec.linear, spec.output_linear))
    return [msgspec.structs.replace(spec, linear=first), msgspec.structs.replace(spec, output_linear=second)]


def _with_mode(block: LinearBlock, usual_s: float) -> LinearBlock:
    poles = _poles(block)
    tau_s = float(np.exp(-np.log(np.abs(poles)).mean())) if len(poles) else usual_s
    mode = RealMode(tau_s, NEW_GAIN)
    return msgspec.structs.replace(block, direct=block.direct - NEW_GAIN, real_modes=[*block.real_modes, mode])


def _spec(linear: ModelSpec, split: Split) -> ModelSpec:
    low, high = linear.valid.deformation_mm
    return msgspec.structs.replace(
        linear,
        input_curve=PiecewiseLinear([low, high], [low, high]),
        linear=split.first,
        output_curve=split.curve,
        output_linear=split.second,
    )


def _splits(linear: LinearBlock, segment: Segment) -> Iterator[Split]:
    """Every way to share out poles and zeros, conjugates together, neither block with more zeros than poles."""
    poles = _poles(linear)
    pole_units, zero_units = _units(poles), _units(_zeros(linear, poles))
    ways = product((0, 1), repeat=len(pole_units) + len(zero_units))
    for _, way in zip(range(MOST_SPLITS), ways, strict=False):
        shared = [_joined(pole_units, way, block) for block in (0, 1)]
        zeros = [_joined(zero_units, way[len(pole_units) :], block) for block in (0, 1)]
        if all(len(z) <= len(p) for z, p in zip(zeros, shared, strict=True)):
            blocks = _block(shared[0], zeros[0], linear.hold), _block(shared[1], zeros[1], linear.hold)
            if all(_most_gain(block) < MOST_GAIN for block in blocks):
                yield _judged(*blocks, segment)


def _most_gain(block: LinearBlock) -> float:
    pairs = [abs(complex(m.gain_re, m.gain_im)) for m in block.complex_modes]
    return max([abs(block.direct), *(abs(m.gain) for m in block.real_modes), *pairs])


def _judged(first: LinearBlock, second: LinearBlock, segment: Segment) -> Split:
    """Curve by least squares between the two blocks, and the mean squared error with it."""
    x = through(first, segment.inputs[DEFORMATION], segment.dt_s)
    centre, scale = float(x.mean()), float(np.ptp(x)) / 2 or 1.0
    z = (x - centre) / scale
    powers = np.polynomial.legendre.legvander(z, DEGREE)
    table = np.column_stack([through(second, column, segment.dt_s) for column in powers.T])
    good = np.isfinite(segment.force_n) & np.isfinite(table).all(axis=1)
    good[: int(SETTLING * len(good))] = False
    if good.sum() < 2 * DEGREE:
        return Split(np.inf, first, PiecewiseLinear([0.0, 1.0], [0.0, 1.0]), second)
    weights = np.linalg.lstsq(table[good], segment.force_n[good], rcond=1e-9)[0]
    error = float(np.mean((segment.force_n[good] - table[good] @ weights) ** 2))
    knots = 0.5 * np.quantile(z, np.linspace(0, 1, SEGMENTS + 1)) + 0.5 * np.linspace(-1.0, 1.0, SEGMENTS + 1)
    heights = np.polynomial.legendre.legval(knots, weights)
    curve = PiecewiseLinear(list(map(float, centre + scale * knots)), list(map(float, heights)))
    return Split(error if np.isfinite(error) else np.inf, first, curve, second)


def through(block: LinearBlock, u: Floats, dt_s: float) -> Floats:
    stage = linear_stage(block, dt_s)
    return stage.run(stage.start(np.empty(0), float(u[0])), np.empty((len(u), 0)), np.ascontiguousarray(u))


def _poles(linear: LinearBlock) -> Roots:
    real = [complex(-1 / mode.tau_s * (1 + 1e-6 * i)) for i, mode in enumerate(linear.real_modes)]  # all different
    pairs = [complex(-m.decay_1_s, m.frequency_rad_s) for m in linear.complex_modes]
    return np.array(real + pairs + [p.conjugate() for p in pairs], complex)


def _zeros(linear: LinearBlock, poles: Roots) -> Roots:
    """Roots of direct prod(1 - s/p) + sum g_i prod_{k != i}(1 - s/p_k), in units of the fastest pole."""
    if not len(poles):  # noise about one level
        return poles
    pairs = [complex(m.gain_re, m.gain_im) / 2 for m in linear.complex_modes]
    gains = np.array([m.gain for m in linear.real_modes] + pairs + [g.conjugate() for g in pairs], complex)
    scale = float(np.abs(poles).max())
    factors = [np.array([1.0, -scale / p]) for p in poles]  # rising powers of s / scale
    total = linear.direct * _product(factors)
    for i, gain in enumerate(gains):
        total = np.polynomial.polynomial.polyadd(total, gain * _product(factors[:i] + factors[i + 1 :]))
    total = np.trim_zeros(np.where(np.abs(total) > 1e-9 * np.abs(total).max(), total, 0.0), "b")
    zeros = np.polynomial.polynomial.polyroots(np.real(total)) * scale
    return zeros[(np.abs(zeros) < FAR * scale) & (np.abs(zeros) > 1e-6 * np.abs(poles).min())].astype(complex)


def _product(factors: Sequence[Roots]) -> Roots:
    total = np.ones(1, complex)
    for factor in factors:
        total = np.convolve(total, factor)
    return total


def _units(roots: Roots) -> list[Roots]:
    """Real roots alone, complex ones with their conjugates."""
    real = np.abs(roots.imag) < 1e-9 * np.abs(roots)
    upper = roots[~real & (roots.imag > 0)]
    return [np.array([r.real + 0j]) for r in roots[real]] + [np.array([r, r.conjugate()]) for r in upper]


def _joined(units: Sequence[Roots], way: Sequence[int], block: int) -> Roots:
    return np.concatenate([np.empty(0, complex), *(u for u, at in zip(units, way, strict=False) if at == block)])


def _block(poles: Roots, zeros: Roots, hold: Hold = "foh") -> LinearBlock:
    """Unit DC gain: prod(1 - s/z) / prod(1 - s/p) as modes."""
    direct = float(np.real(np.prod(poles) / np.prod(zeros))) if len(poles) == len(zeros) else 0.0
    gains = [np.prod(1 - p / zeros) / np.prod([1 - p / q for q in poles if q != p]) for p in poles]
    real = [RealMode(float(-1 / p.real), float(g.real)) for p, g in zip(poles, gains, strict=True) if p.imag == 0]
    pairs = [
        ComplexMode(float(-p.real), float(p.imag), float(2 * g.real), float(2 * g.imag))
        for p, g in zip(poles, gains, strict=True)
        if p.imag > 0
    ]
    return LinearBlock(direct, real, pairs, hold)


STRUCTURES = (Structure("wiener-hammerstein", "Wiener-Hammerstein: linear, 10 segments, linear", "beyond", _fit),)
