"""The search for an HW-PWL model, the piecewise-linear Hammerstein-Wiener model of the thesis (section 13.4).

    deformation -> PWL curve f -> linear block, DC gain 1 -> PWL curve h -> force

All records together, each stretch with its own initial state. Data are normalised inside, so any scale and unit will
do. The search starts from poles spread over the time scales of the data and, where these oscillate, from those of the
best linear model; with twice the segments wanted, which are then merged (see `hw_search`, `hw_merge`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.errors import RecordingError
from thrustd.identify import linear_start
from thrustd.identify.hw_merge import merged
from thrustd.identify.hw_search import (
    Point,
    Signal,
    choose_samples,
    normal_equations,
    search,
    simulate,
    slow_variance,
    with_priors,
)
from thrustd.identify.hw_shapes import Shape, directions_of, knots_of
from thrustd.identify.hw_theta import Layout
from thrustd.identify.linear_start import Poles
from thrustd.identify.segments import DEFORMATION, Segment, segments_of
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

Progress = Callable[[str, float], None]  # (what is being done, rmse in the unit of the force)

COARSE_ROWS, MIDDLE_ROWS, FINE_ROWS = 40_000, 120_000, 400_000  # samples that count in the passes of each stage
START_SAMPLES = 400_000  # of the longest segment, to choose among starting points
ROWS_PER_KNOT = 25  # fewer data per knot do not determine it
FASTEST = 0.3  # of a sample period: shortest time constant
SLOWEST = 0.5  # of the longest segment: longest time constant; slower ones never settled, they invent offsets
HEAT = 3  # iterations of every starting point before the best go on
FINALISTS = 2
SMALL = 200_000  # samples: passes are cheap, iterate to the end
TINY_GAIN = 1e-3


@dataclass(frozen=True, slots=True)
class HwSettings:
    """What to fit: segments of the two curves and the order of the linear block."""

    order: int = 6
    input_segments: int = 10
    output_segments: int = 10
    input_shape: Shape = "pwl"
    output_shape: Shape = "pwl"
    surplus: float = 2.0  # start with so many times the segments, then merge
    iterations: int = 25


@dataclass(frozen=True, slots=True)
class Units:
    """u = (deformation - u_zero) / u_span, y = (force - y_zero) / y_span."""

    u_zero: float
    u_span: float
    y_zero: float
    y_span: float


@dataclass(frozen=True, slots=True)
class HwFit:
    """A fitted model in normalised units, and how it went."""

    point: Point
    units: Units
    segments: list[Segment]
    rmse: float  # at the chosen samples, unit of the force
    limits_s: tuple[float, float]  # the time constants' bounds
    notes: tuple[str, ...] = ()


def fit_hw(records: Sequence[Recording], settings: HwSettings | None = None, progress: Progress | None = None) -> HwFit:
    """Fit to deformation_mm -> force_N of all records."""
    return fit_segments(segments_of(records), settings or HwSettings(), progress)


def fit_segments(segments: list[Segment], settings: HwSettings, progress: Progress | None = None) -> HwFit:
    """As `fit_hw`, on segments cut already."""
    units = units_of(segments)
    longest_s = max(len(segment) * segment.dt_s for segment in segments)
    dt_s = min(segment.dt_s for segment in segments)
    limits = (FASTEST * dt_s, SLOWEST * longest_s)
    say = _scaled(progress, units)
    point = _best_start(segments, units, settings, limits, say)
    coarse = _signals(segments, units, COARSE_ROWS)
    point, _ = _search(point, coarse, settings, limits, settings.iterations, 1e-3, say("all data"))
    point = _fewer_knots(point, coarse, settings, limits, say)
    small = sum(map(len, segments)) < SMALL
    for rows, count, stall in ((MIDDLE_ROWS, 20 if small else 4, 2e-4), (FINE_ROWS, 3, 1e-4)):
        signals = _signals(segments, units, rows)
        point, variance = _search(point, signals, settings, limits, count, stall, say("fine"))
    return HwFit(point, units, segments, float(np.sqrt(variance)) * units.y_span, limits)


def _search(
    point: Point,
    signals: list[Signal],
    settings: HwSettings,
    limits: tuple[float, float],
    iterations: int,
    stall: float,
    say: Callable[[float], None] | None,
) -> tuple[Point, float]:
    directions = directions_of(point, settings.input_shape, settings.output_shape)
    return search(point, signals, limits, iterations, stall, say, directions)


def units_of(segments: Sequence[Segment]) -> Units:
    """Range of the input, mean and spread of the output; RecordingError when either is constant."""
    u_low = min(float(segment.inputs[DEFORMATION].min()) for segment in segments)
    u_high = max(float(segment.inputs[DEFORMATION].max()) for segment in segments)
    force_n = [segment.force_n[np.isfinite(segment.force_n)] for segment in segments]
    total = sum(map(len, force_n))
    mean = sum(float(part.sum()) for part in force_n) / total
    std = float(np.sqrt(sum(float(((part - mean) ** 2).sum()) for part in force_n) / total))
    name = segments[0].record
    if not u_high > u_low:
        raise RecordingError(f"{name}: {DEFORMATION} is {u_low:g} all the time; a constant input identifies nothing")
    if not std > 0:
        raise RecordingError(f"{name}: force_N is {mean:g} all the time; expected a force that moves")
    return Units(u_low, u_high - u_low, mean, std)


def _scaled(progress: Progress | None, units: Units) -> Callable[[str], Callable[[float], None] | None]:
    def stage(what: str) -> Callable[[float], None] | None:
        return None if progress is None else lambda rms: progress(what, rms * units.y_span)

    return stage


def _signals(segments: Sequence[Segment], units: Units, rows: int) -> list[Signal]:
    total = sum(map(len, segments))
    return [_signal(segment, units, max(1, total // rows)) for segment in segments]


def _signal(segment: Segment, units: Units, stride: int) -> Signal:
    u = (segment.inputs[DEFORMATION] - units.u_zero) / units.u_span
    y = (segment.force_n - units.y_zero) / units.y_span
    return Signal(u, y, segment.dt_s, choose_samples(y, stride))


def _best_start(
    segments: list[Segment],
    units: Units,
    settings: HwSettings,
    limits: tuple[float, float],
    say: Callable[[str], Callable[[float], None] | None],
) -> Point:
    """Try the candidates on part of the data; the best, with one set of initial states per segment."""
    longest = max(segments, key=len)
    part = replace(
        longest,
        inputs={name: column[:START_SAMPLES] for name, column in longest.inputs.items()},
        force_n=longest.force_n[:START_SAMPLES],
    )
    trial = [_signal(part, units, max(1, len(part) // COARSE_ROWS))]
    count = sum(len(signal.chosen) for signal in _signals(segments, units, FINE_ROWS))
    tried = [
        _search(starting_point(poles, trial, settings, count), trial, settings, limits, HEAT, 1e-3, say("starts"))
        for poles in candidates(trial[0], settings.order)
    ]
    tried.sort(key=lambda result: result[1])
    finals = [_search(point, trial, settings, limits, 3 * HEAT, 1e-3, say("starts")) for point, _ in tried[:FINALISTS]]
    best = min(finals, key=lambda result: result[1])[0]
    return replace(best, starts=np.zeros((len(segments), best.layout.width)))


def candidates(signal: Signal, order: int) -> list[Poles]:
    """Starting poles for one segment."""
    dt_s, n = signal.dt_s, len(signal.u)
    spread = linear_start.spread(order, 2 * dt_s, max(4 * dt_s, n * dt_s / 8))
    good = np.isfinite(signal.y)
    y = np.interp(np.arange(n), np.flatnonzero(good), signal.y[good])
    found = linear_start.realised(signal.u - signal.u.mean(), y - y.mean(), dt_s, order)
    options = [spread]
    if len(found.pairs):
        options.append(linear_start.filled(found, order, spread.tau_s))
        options.append(linear_start.filled(Poles(np.empty(0), found.pairs), order, spread.tau_s))
    elif len(found.tau_s) and n < START_SAMPLES // 4:
        options.append(linear_start.filled(found, order, spread.tau_s))
    return options


def starting_point(poles: Poles, signals: list[Signal], settings: HwSettings, count: int) -> Point:
    """f = identity, gains by linear least squares for these poles, h = the straight line; knots between even and
    quantile spacing, as many as the data bear."""
    most = max(2, count // ROWS_PER_KNOT // 4)
    n_f = knots_of(settings.input_shape, min(most, round(settings.surplus * settings.input_segments)))
    n_h = knots_of(settings.output_shape, min(most, round(settings.surplus * settings.output_segments)))
    layout = Layout(n_f, len(poles.tau_s), len(poles.pairs), n_h)
    theta = np.zeros(layout.size)
    theta[layout.fx] = _knots(signals[0].u, n_f)
    theta[layout.fy] = theta[layout.fx]
    theta[layout.poles] = np.concatenate((np.log(poles.tau_s), np.log(poles.pairs).ravel()))
    theta[layout.c] = 1.0
    theta[layout.hx] = theta[layout.hy] = np.linspace(-0.1, 1.1, n_h)
    point = Point(layout, theta, np.zeros((len(signals), layout.width)))
    return _linear_fit(point, signals)


def _knots(v: Floats, n: int) -> Floats:
    """Half even, half quantile spacing over the range of v."""
    share = np.linspace(0, 1, n)
    knots: Floats = 0.5 * np.quantile(v, share) + 0.5 * (v.min() + np.ptp(v) * share)
    return knots


def _linear_fit(point: Point, signals: list[Signal]) -> Point:
    """Gains and a straight h by least squares: y = offset + slope x, slope = DC gain unless that is tiny.

    With f and h identities the columns of gains and c are what the linear block puts out per unit of each.
    """
    layout = point.layout
    normal = normal_equations(point, signals)
    columns = np.concatenate((np.arange(layout.size)[layout.gains], [layout.c]))
    offset = np.zeros(normal.matrix.shape[0])
    offset[layout.hy] = 1.0  # all knots up together: a constant
    basis = np.zeros((normal.matrix.shape[0], len(columns) + 1))
    basis[columns, np.arange(len(columns))] = 1.0
    basis[:, -1] = offset
    matrix = basis.T @ normal.matrix @ basis
    right = basis.T @ (normal.gradient + normal.matrix @ basis[:, -2])  # residual of the model plus c w itself = y
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + 1e-6 * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    gain, level = found[-2], found[-1]
    biggest = float(np.max(np.abs(found[:-1])))
    slope = gain if abs(gain) > TINY_GAIN * biggest else float(np.copysign(biggest, gain or 1.0))
    theta = point.theta.copy()
    theta[layout.gains] = found[:-2] / slope
    theta[layout.c] = gain / slope
    return _fitted_output(replace(point, theta=theta), signals, slope, level)


def _fitted_output(point: Point, signals: list[Signal], slope: float, level: float) -> Point:
    """h as a straight line over the range that x takes."""
    layout, theta = point.layout, point.theta.copy()
    theta[layout.hx] = theta[layout.hy] = np.linspace(-1, 1, layout.n_h)
    straight = replace(point, theta=theta)
    x = np.concatenate([simulate(straight, i, signal) for i, signal in enumerate(signals)])
    theta[layout.hx] = _knots(x[:: max(1, len(x) // 50_000)], layout.n_h)
    theta[layout.hy] = level + slope * theta[layout.hx]
    return straight


def _fewer_knots(
    point: Point,
    signals: list[Signal],
    settings: HwSettings,
    limits: tuple[float, float],
    say: Callable[[str], Callable[[float], None] | None],
) -> Point:
    """Merge in rounds, a third of the surplus at a time, re-fitting in between."""
    n_f, n_h = point.layout.n_f, point.layout.n_h
    n_f = min(n_f, settings.input_segments + 1) if settings.input_shape == "pwl" else n_f
    n_h = min(n_h, settings.output_segments + 1) if settings.output_shape == "pwl" else n_h
    while point.layout.n_f > n_f or point.layout.n_h > n_h:
        variance = slow_variance(point, signals)
        normal, _ = with_priors(point, normal_equations(point, signals), variance)
        f_next = max(n_f, point.layout.n_f - max(1, (point.layout.n_f - n_f + 2) // 3))
        h_next = max(n_h, point.layout.n_h - max(1, (point.layout.n_h - n_h + 2) // 3))
        fewer = merged(point, normal, f_next, h_next)
        point, _ = _search(fewer, signals, settings, limits, 3, 1e-3, say("merging"))
    return point
