"""What a mount may have been through before anybody looked: the state to go on with, and what it may be wrong by.

Creep. The load came at some time that nobody saw. Its age may be anything from nothing to a few times A:
gamma-distributed, shape 1/2, mean A. Of a mode's way to where the load now holds it, with r = A / tau,

    E[e^(-age/tau)] = (1 + 2 r)^(-1/2),     variance  (1 + 4 r)^(-1/2) - (1 + 2 r)^-1

is left. It is one age: what the modes may be wrong by has a sign and adds up, and ends with each mode's own tau.

Friction. The load may have grown to what it is, or come down from as much as a take-off: two states between which the
true one lies and stays, because friction does not change sides. The model goes on from where between them it is
likeliest, and they are stepped on beside it until the mount has moved far enough for both to be the same; the band
reaches to the farther one.

An engine that idles on the ground was started on new mounts, or on mounts that hold what the last flight left in their
friction, or it has just landed: their middle. Where the aircraft flies it came down from a cruise some minutes ago:
friction is most likely that of a load that fell, or has turned back a little since, and the modes are on their way from
the cruise. Mounts that never carried more are as far off as they may be, and inside the band all the same.
One that stood while its zero was calibrated begins anew, and nothing is left in its friction. Where a tethered run has
found the zero under load, friction holds what the spring shows then: a state between the branches, or as far beyond.

Zero. A mount that carries nothing shows a force all the same: its model at rest would show none where its transducer
stood by that zero lower. Unless it is what the friction holds since the last flight.
"""

from collections.abc import Callable, Mapping, Sequence
from math import copysign, exp, hypot, inf, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.core.calibration import LARGEST_ZERO_MM
from thrustd.core.columns import Floats
from thrustd.core.signals import CATALOGUE, Signal
from thrustd.model.compile import CompiledModel, linear_of
from thrustd.mounts.step import CHORDS

LOAD_AGE_S = 3600.0  # A of a cold start: flights last one to three hours
DESCENT_AGE_S = 600.0  # A of the idle of an aircraft that flies
IDLE, CRUISE, TAKE_OFF = 0.1, 0.4, 0.75  # of the identified deformation
BRANCH_STD = 1.0 / sqrt(2.0)  # of the way to the farther branch: near one of them is likelier than midway
TURNED_BACK = 0.3  # of the way between the branches, at most: what creep and a throttle at idle undo of a descent
REST_S = 1.0  # what a load that falls at once leaves in dampers is gone by then
SOLVED_MM = 1e-7
SAME_N = 1.0  # branches that are no further apart are one
Rows = Callable[[float], Floats]  # deformation, mm -> a row of the model's inputs


class Past(NamedTuple):
    """What is known of a mount before it is looked at."""

    state: Floats | None  # None: nobody knows
    age_s: float  # of the load, mean
    since_s: float = 0.0  # since the last start or doubt
    fell_from: float | None = None  # the load fell since a take-off; part of the range that the modes come from
    rested: bool = False  # nothing is left of an earlier load in the friction
    carries_nothing: bool = False  # and what is left of it holds the spring


class Unseen:
    """What one mount may still be wrong by. Mutable."""

    def __init__(self, model: CompiledModel) -> None:
        self._model = model
        self.doubts = np.zeros((0, 2))  # force of each real mode, N, one sigma with its sign, and its tau, s
        self._branches = np.zeros((0, 0))  # two states
        self._far = 0.5  # from where the model went on to the farther one, of the way between them

    @property
    def branched(self) -> bool:
        return len(self._branches) > 0

    def start(self, row: Rows, found_mm: float, past: Past) -> Floats:
        """State of a mount that is found at `found_mm`."""
        model, full_mm = self._model, self._model.spec.valid.deformation_mm[1]
        from_below, from_above = model.start(row(found_mm)), model.start(row(TAKE_OFF * full_mm))
        linear = _linear(model)
        here = np.tile(row(found_mm), (max(round(REST_S * model.rate_hz), 1), 1))
        model.run(from_above, here[:, 1:].copy(), here[:, 0].copy())
        idles = found_mm <= IDLE * full_mm
        if past.state is None and idles and past.fell_from is not None:
            from_above[linear] = from_below[linear]
            state = self.doubt(model.start(row(past.fell_from * full_mm)), from_above, DESCENT_AGE_S, past.since_s)
            fell = 1.0 - 0.5 * TURNED_BACK
        else:
            fell = 0.5
            before = model.start(row(0.0)) if past.state is None else past.state
            state = self.doubt(before, from_below, past.age_s, past.since_s)
            if past.carries_nothing:
                self._branches = np.zeros((0, 0))
                return self._holding(state, from_above, row(found_mm))
            if past.rested or (idles and past.state is not None) or found_mm >= TAKE_OFF * full_mm:
                self._branches = np.zeros((0, 0))
                return state
        self._branches = np.stack((from_below, from_above))
        self._branches[:, linear] = state[linear]
        self._far = fell
        between: Floats = (1.0 - fell) * self._branches[0] + fell * self._branches[1]
        return between

    def _holding(self, free: Floats, from_above: Floats, row: Floats) -> Floats:
        """`free` with as much of the friction of `from_above` as leaves no force."""
        held = from_above.copy()
        held[_linear(self._model)] = free[_linear(self._model)]
        free_n, held_n = (self._model.step(state.copy(), row[1:], row.item(0)) for state in (free, held))
        part = free_n / (free_n - held_n) if free_n != held_n else 0.0
        whole: Floats = free + min(max(part, -1.0), 1.0) * (held - free)
        return whole

    def doubt(self, before: Floats, after: Floats, age_s: float, since_s: float) -> Floats:
        """The load is of this mean age. -> `after`, at rest, with its modes as far from `before` as on average."""
        state, new = settle(self._model, before, after, age_s)
        for row, (old_n, tau_s) in zip(new, self.doubts, strict=False):  # there are no old ones at first
            row[0] = copysign(hypot(row[0], old_n * exp(-since_s / tau_s)), row[0])
        self.doubts = new
        return state

    def friction_std_n(self, row: Floats) -> float:
        """Steps both branches on to this row of inputs."""
        below_n, above_n = (self._model.step(branch, row[1:], row.item(0)) for branch in self._branches)
        far_n = self._far * abs(below_n - above_n)
        if far_n < SAME_N:
            self._branches = np.zeros((0, 0))
        return far_n * BRANCH_STD

    def snapshot(self) -> dict[str, list[float]]:
        branches = [*self._branches.ravel().tolist(), self._far] if self.branched else []
        return {"doubts": self.doubts.ravel().tolist(), "branches": branches}

    def restore(self, doubts: Sequence[float], branches: Sequence[float], n_state: int) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none."""
        sizes = (
            len(doubts) in (0, 2 * len(linear_of(self._model.spec).real_modes)),
            len(branches) in (0, 2 * n_state + 1),
        )
        if not all(sizes) or not all(map(isfinite, [*doubts, *branches])) or min(doubts[1::2], default=1.0) <= 0.0:
            return False
        self.doubts, self._branches = np.reshape(doubts, (-1, 2)), np.reshape(branches[: 2 * n_state], (-1, n_state))
        self._far = branches[-1] if branches else 0.5
        return True


def settle(model: CompiledModel, before: Floats, after: Floats, age_s: float) -> tuple[Floats, Floats]:
    """(`after` with its modes as far from `before` as they are on average, doubts); `after` is at rest."""
    output = next(stage for stage in model.stages if stage.name == "output_curve")
    modes, linear = linear_of(model.spec).real_modes, _linear(model)
    w = float(after[linear.start])
    nearby = w + 1e-3 * max(abs(w), 1e-3)
    here, there = (output.once(np.zeros(0), np.zeros(0), v) for v in (w, nearby))
    slope, tau_s = (there - here) / (nearby - w), np.array([mode.tau_s for mode in modes])
    mine = slice(linear.start + 1, linear.start + 1 + len(modes))
    r, way, state = age_s / tau_s, w - before[mine], after.copy()
    state[mine] = w - way / np.sqrt(1 + 2 * r)
    left_std = np.sqrt(1 / np.sqrt(1 + 4 * r) - 1 / (1 + 2 * r))
    return state, np.column_stack((slope * np.array([mode.gain for mode in modes]) * way * left_std, tau_s))


def resting_n(model: CompiledModel, row: Floats) -> float:
    """Thrust share of a mount at rest under a row of inputs."""
    return model.step(model.start(row), row[1:], row.item(0))


def chords(model: CompiledModel, row: Rows) -> tuple[Floats, Floats]:
    """(middles, mm; slopes, N/mm) of the model's curve at rest, (CHORDS,)."""
    ends_mm = np.linspace(*model.spec.valid.deformation_mm, CHORDS + 1)
    forces_n = [resting_n(model, row(mm)) for mm in ends_mm.tolist()]
    return 0.5 * (ends_mm[1:] + ends_mm[:-1]), np.diff(forces_n) / np.diff(ends_mm)


def at_rest(model: CompiledModel, measured: Mapping[str, float]) -> Rows:
    """Rows with every channel as measured, or else where it rests."""
    held = np.array([measured.get(name, CATALOGUE[name].rest) for name in model.channels[1:]])
    own = np.array([name == "deformation_mm" for name in model.channels[1:]], bool)
    return lambda mm: np.concatenate(([mm], np.where(own, mm, held)))


def zero_of(model: CompiledModel, row: Rows, shown_mm: float, shown_n: float) -> float:
    """What a transducer that shows `shown_mm` shows too much, mm, if the mean force `shown_n` is none; NaN: no zero.

    `shown_n` is a mean over noise: what is asked for is the deformation whose force is less by that.
    """
    wanted_n = resting_n(model, row(shown_mm)) - shown_n
    low_mm, high_mm = shown_mm - LARGEST_ZERO_MM, shown_mm + LARGEST_ZERO_MM
    if not resting_n(model, row(low_mm)) < wanted_n < resting_n(model, row(high_mm)):
        return nan
    while high_mm - low_mm > SOLVED_MM:
        middle_mm = 0.5 * (low_mm + high_mm)
        too_low = resting_n(model, row(middle_mm)) < wanted_n
        low_mm, high_mm = (middle_mm, high_mm) if too_low else (low_mm, middle_mm)
    return shown_mm - 0.5 * (low_mm + high_mm)


def _linear(model: CompiledModel) -> slice:
    """Where the linear block is in the model's state: its last input, then its modes."""
    names = [stage.name for stage in model.stages]
    number = names.index("linear")
    begin = sum(stage.n_state for stage in model.stages[:number])
    return slice(begin, begin + model.stages[number].n_state)


def unmeasured_std(signal: Signal, age_s: float) -> float:
    """One sigma of a signal that was last seen `age_s` ago and is held; infinity = never seen, it is at rest.

    A Gauss-Markov signal of spread s moves by  s sqrt(2 (1 - e^(-age / memory)))  (Gelb, Applied Optimal Estimation).
    """
    return signal.spread if age_s == inf else signal.spread * sqrt(2.0 * (1.0 - exp(-age_s / signal.memory_s)))
