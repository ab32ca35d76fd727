"""The search for an HW-PWL model, the piecewise-linear Hammerstein-Wiener model of the thesis (section 13.4).

    deformation -> PWL curve f -> linear block, DC gain 1 -> PWL curve h -> force

All records together, each stretch with its own initial state. Data are normalised inside, so any scale and unit will
do. The search starts from poles spread over the time scales of the data and, where these oscillate, from those of the
best linear model; with twice the segments wanted, which are then merged (see `hw_search`, `hw_merge`).
"""

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass, replace

import numpy as np

from thrustd.identify.first_state import begun
from thrustd.identify.hw_guess import guesses
from thrustd.identify.hw_held_out import EACH, MIDDLE, Choice, choose_reins, folds_of, mean_square, rescaled
from thrustd.identify.hw_merge import merged
from thrustd.identify.hw_prior import LOOSE, Reins, with_priors
from thrustd.identify.hw_problem import Point, Signal, normal_equations, residuals_of, simulate, slow_variance
from thrustd.identify.hw_search import search
from thrustd.identify.hw_shapes import Shape, directions_of, smooth
from thrustd.identify.hw_start import best_start, freed
from thrustd.identify.hw_units import Units, signal_in, signals_in, units_of
from thrustd.identify.segments import Segment, excerpts, head, segments_of, thinned
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

Progress = Callable[[str, float], None]  # (which of the STAGES, rmse in the unit of the force)

STAGES = ("starts", "smooth curves", "guesses", "held-back blocks", "free knots", "merging", "merged", "fine")
COARSE_ROWS, MIDDLE_ROWS, FINE_ROWS = 40_000, 120_000, 400_000  # samples that count in the passes of each stage
AT_ONCE = 1_000_000  # samples that the coarse stages see of longer records
HELD_BACK_SAMPLES, PLENTIFUL = 60_000, 900_000  # to choose how rough curves may be; from which on data may be plenty
FOLD_ROWS = 4_000  # enough to see which model predicts better
START_SAMPLES = 400_000  # of the longest segment, to choose among starting points
START_ROWS = 10_000  # that count there, when records are long
ROWS_PER_KNOT = 25  # fewer data per knot do not determine it
FEWEST_SEGMENTS = 5  # yet these follow a cubic, near which reins may hold them
FASTEST = 0.3  # of a sample period: shortest time constant
SLOWEST = 0.5  # of the longest segment: longest time constant; slower ones never settled, they invent offsets
SMALL = 60_000  # samples: passes are cheap, iterate to the end
THIN = 1.5  # error on held-back blocks over that on the others, from which on the data are called too thin
GUESS_SAMPLES, GUESS_SEGMENTS = 60_000, 5  # to choose among guesses at the curves
GUESSING = 10  # iterations of every guess
MUCH_BETTER = 0.7  # error of another guess over that of the smooth one
FREEING = 8  # iterations after the knots have been freed
PASTS = 2  # times that small data are given the past that suits the model found so far


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
class HwFit:
    """A fitted model in normalised units, and how it went."""

    point: Point
    units: Units
    segments: list[Segment]
    rmse: float  # at the chosen samples, unit of the force
    limits_s: tuple[float, float]  # the time constants' bounds
    notes: tuple[str, ...] = ()
    free_input: bool = True  # the knots of the input curve were free


def fit_hw(records: Sequence[Recording], settings: HwSettings | None = None, progress: Progress | None = None) -> HwFit:
    """Fit to deformation_mm -> force_N of all records."""
    return fit_segments(segments_of(records), settings or HwSettings(), progress)


def fit_segments(segments: list[Segment], settings: HwSettings, progress: Progress | None = None) -> HwFit:
    """As `fit_hw`, on segments cut already."""
    units = units_of(segments)
    coarse = excerpts(segments, AT_ONCE)
    task = _Task(segments, coarse, units, settings, _limits(segments), _scaled(progress, units))
    smooth_point = point = _smooth_fit(task)
    reins = LOOSE
    notes: tuple[str, ...] = ()
    if "pwl" in task.shapes:
        point, chosen = _freed_fit(task, point)
        reins, notes = chosen.reins, thin_data(chosen.ratio)
    if task.long:
        point, smooth_point = _from_rest(point, segments), _from_rest(smooth_point, segments)
    variance = 0.0
    last = FINE_ROWS if "pwl" in task.shapes or not task.long else MIDDLE_ROWS  # a dozen numbers ask for fewer
    for rows, count, stall in ((MIDDLE_ROWS, 30 if task.small else 10, 2e-5), (last, 3, 1e-4)):
        signals = signals_in(segments, units, rows)
        held = rescaled(reins, smooth_point, signals)
        point, variance = task.search(point, signals, count, stall, "fine", reins=held)
    if task.small:
        point, variance = _from_past(task, point, held)
    return HwFit(
        point, units, segments, float(np.sqrt(variance)) * units.y_span, task.limits, notes, task.shapes[0] == "pwl"
    )


def thin_data(ratio: float) -> tuple[str, ...]:
    """A word when held-back blocks are predicted much worse than the others are followed."""
    if ratio < THIN:
        return ()
    return (
        f"blocks held back were predicted with {ratio:.1f} times the error of the others: these data hold too little "
        "for so many numbers; record longer, or take fewer --segments and a lower --order",
    )


@dataclass(frozen=True, slots=True)
class _Task:
    """What a fit is about. coarse: what the stages before the fine one see of the segments."""

    segments: list[Segment]
    coarse: list[Segment]
    units: Units
    settings: HwSettings
    limits: tuple[float, float]
    say: Callable[[str], Callable[[float], None] | None]

    @property
    def small(self) -> bool:
        return sum(map(len, self.segments)) < SMALL

    @property
    def long(self) -> bool:
        return len(self.coarse) > len(self.segments)  # cut into stretches

    @property
    def shapes(self) -> tuple[Shape, Shape]:
        return self.settings.input_shape, self.settings.output_shape

    def search(
        self,
        point: Point,
        signals: list[Signal],
        iterations: int,
        stall: float,
        stage: str,
        shapes: tuple[Shape, Shape] | None = None,
        reins: Reins = LOOSE,
        at_rest: bool = False,
    ) -> tuple[Point, float]:
        directions = directions_of(point, *(shapes or self.shapes), at_rest)
        return search(point, signals, self.limits, iterations, stall, self.say(stage), directions, reins)


def _from_past(task: _Task, point: Point, reins: Reins) -> tuple[Point, float]:
    """Every segment from the past that its first stretch shows, as it will be judged, in place of states of its own.

    Six free states follow a trend that no past could have left, and short records are little else.
    """
    units, variance = task.units, 0.0
    for _ in range(PASTS):
        rested = _from_rest(point, task.segments)

        def run(segment: Segment, rested: Point = rested) -> Floats:
            return units.y_zero + units.y_span * simulate(rested, 0, signal_in(segment, units, 1))

        signals = [signal_in(segment, units, 1) for segment in begun(run, task.segments)]
        point, variance = task.search(rested, signals, 20, 1e-4, "fine", reins=reins, at_rest=True)
    return point, variance


def _limits(segments: list[Segment]) -> tuple[float, float]:
    longest_s = max(len(segment) * segment.dt_s for segment in segments)
    return FASTEST * min(segment.dt_s for segment in segments), SLOWEST * longest_s


def _smooth_fit(task: _Task) -> Point:
    """The model with cubics for free knots, on all data."""
    shapes = smooth(task.shapes)
    longest = max(task.segments, key=len)
    part = head(longest, START_SAMPLES)
    trial = signal_in(part, task.units, max(1, len(part) // (START_ROWS if task.long else COARSE_ROWS)))
    point = best_start(
        trial,
        task.settings.order,
        shapes,
        lambda point, signals, count: task.search(point, signals, count, 1e-3, "starts", shapes),
    )
    point = _from_rest(point, task.coarse)
    coarse = signals_in(task.coarse, task.units, COARSE_ROWS)
    return task.search(point, coarse, task.settings.iterations, 1e-3, "smooth curves", shapes)[0]


def _freed_fit(task: _Task, point: Point) -> tuple[Point, Choice]:
    """Free knots, more than wanted, held as tightly as held-back blocks ask for, then merged."""
    coarse = signals_in(task.coarse, task.units, COARSE_ROWS)
    start, like = freed(point, task.shapes, _most_knots(task), coarse), _near(point)
    guess, ratio = _best_guess(task, start)
    if ratio < MUCH_BETTER:
        start, like, point = guess, LOOSE, guess
    others = [guess] if task.small and MUCH_BETTER <= ratio < 1.0 else []
    chosen = _chosen_reins(task, point, [start, *others], like)
    begins = [_from_rest(chosen.point, coarse)]
    if chosen.reins is LOOSE and ratio < 1.0:
        begins = [*begins[: int(task.small)], guess]
    reins = rescaled(chosen.reins, point, coarse)
    ends = [_merged_fit(task, begin, coarse, reins) for begin in begins]
    return min(ends, key=lambda end: mean_square(end, coarse)), chosen


def _chosen_reins(task: _Task, smooth_point: Point, starts: Sequence[Point], like: Reins) -> Choice:
    """Long records are thinned: how rough a curve may be does not hang on the rate."""
    total = sum(map(len, task.segments))
    segments = thinned(task.segments, HELD_BACK_SAMPLES) or task.segments
    return choose_reins(
        _from_rest(smooth_point, segments),
        [_from_rest(start, segments) for start in starts],
        folds_of(signals_in(segments, task.units, FOLD_ROWS), EACH),
        lambda p, signals, reins: task.search(p, signals, FREEING, 1e-3, "held-back blocks", reins=reins)[0],
        like,
        total > PLENTIFUL,
    )


def _from_rest(point: Point, stretches: Sized) -> Point:
    """At rest at the beginning of each of so many stretches."""
    return replace(point, starts=np.zeros((len(stretches), point.layout.width)))


def _near(point: Point) -> Reins:
    """Reins to the present curves."""
    layout, theta = point.layout, point.theta
    f, h = (np.stack((theta[x], theta[y])) for x, y in ((layout.fx, layout.fy), (layout.hx, layout.hy)))
    return Reins(f=f, h=h)


def _merged_fit(task: _Task, begin: Point, signals: list[Signal], reins: Reins) -> Point:
    stall = 2e-4 if task.small else 1e-3
    found, _ = task.search(begin, signals, task.settings.iterations, stall, "free knots", reins=reins)
    fewer = _fewer_knots(task, found, signals, reins)
    return task.search(fewer, signals, 20, 2e-5, "merged", reins=reins)[0] if task.small else fewer


def _best_guess(task: _Task, start: Point) -> tuple[Point, float]:
    """The guess at the curves that predicts a held-back block best, and its error over that of `start` there.

    `start` is the smooth model, which the search may make worse where the first data of every segment are few.
    """
    few = [head(segment, GUESS_SAMPLES) for segment in task.segments[:GUESS_SEGMENTS]]
    (fold,) = folds_of(signals_in(few, task.units, FOLD_ROWS), (MIDDLE,))
    own = _from_rest(start, few)
    ends = [
        task.search(guess, fold.train, GUESSING, 1e-3, "guesses")[0]
        for guess in (own, *guesses(own, task.shapes, fold.train))
    ]
    errors = [mean_square(end, fold.held) for end in ends]
    errors[0] = min(errors[0], mean_square(own, fold.held))
    best = int(np.argmin(errors))
    found = start if best == 0 else _from_rest(ends[best], start.starts)
    return found, float(np.sqrt(errors[best] / errors[0]))


def _most_knots(task: _Task) -> tuple[int, int]:
    """Knots to free, as many as the data bear."""
    settings = task.settings
    rows = sum(min(len(segment), FINE_ROWS) for segment in task.segments)
    most = max(FEWEST_SEGMENTS, rows // ROWS_PER_KNOT // 4)
    first, second = (
        1 + min(most, round(settings.surplus * n)) for n in (settings.input_segments, settings.output_segments)
    )
    return first, second


def _scaled(progress: Progress | None, units: Units) -> Callable[[str], Callable[[float], None] | None]:
    def stage(what: str) -> Callable[[float], None] | None:
        return None if progress is None else lambda rms: progress(what, rms * units.y_span)

    return stage


def _fewer_knots(task: _Task, point: Point, signals: list[Signal], reins: Reins) -> Point:
    """Merge in rounds, a third of the surplus at a time, re-fitting in between."""
    settings = task.settings
    n_f, n_h = point.layout.n_f, point.layout.n_h
    n_f = min(n_f, settings.input_segments + 1) if settings.input_shape == "pwl" else n_f
    n_h = min(n_h, settings.output_segments + 1) if settings.output_shape == "pwl" else n_h
    while point.layout.n_f > n_f or point.layout.n_h > n_h:
        variance = slow_variance(residuals_of(point, signals)) if reins.variance is None else reins.variance
        normal, _ = with_priors(point, normal_equations(point, signals), variance, reins)
        f_next = max(n_f, point.layout.n_f - max(1, (point.layout.n_f - n_f + 2) // 3))
        h_next = max(n_h, point.layout.n_h - max(1, (point.layout.n_h - n_h + 2) // 3))
        point, _ = task.search(merged(point, normal, f_next, h_next), signals, 5, 1e-3, "merging", reins=reins)
    return point
