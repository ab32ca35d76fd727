"""The slow walk of a reference: what a load cell adds to every force that no mount makes.

A cell's zero wanders as the sum of many small steps. Over a record of length T such a walk is

    w(t) = sqrt(q T) sum_k z_k sqrt(2) sin((k - 1/2) pi t / T) / ((k - 1/2) pi),   z_k ~ N(0, 1)

(Karhunen-Loeve; Wiener process of variance q per hour), of which the first few terms are all that rubber's slow memory
could be taken for. How much a cell walks (q) the data tell; without it, slow relaxation would have to explain it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from thrustd.core.columns import Flags
from thrustd.identify.regression.terms import Term, at_start
from thrustd.identify.segments import Segment
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

MODES = 12  # of the walk over one recording
HOURS = "hours of recording "
ELSEWHERE = -1.0  # hours: another recording's
LASTS = "lasts_h"
NAMES = tuple(f"mode_{k}" for k in range(MODES))
SIZE = 0.01  # of the output's spread in an hour, one sigma: no cell in order walks further


@jit
def _modes(length_h: float, at_h: float, out: Floats) -> None:
    """Modes (n,) of the walk at so many hours."""
    turn = np.pi * at_h / length_h
    one, before = np.sin(0.5 * turn), -np.sin(0.5 * turn)
    for k in range(out.size):
        out[k] = np.sqrt(2.0 * length_h) / ((k + 0.5) * np.pi) * one if at_h >= 0.0 else 0.0
        one, before = 2.0 * np.cos(turn) * one - before, one


@jit
def _step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """v plus the walk at u[0] hours; c[0]: length, h, then sizes."""
    out = np.empty(c.size - 1)
    _modes(c[0], u[0], out)
    return v + np.sum(out * c[1:])


@jit
def _elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    row = 0
    for i in range(wanted.size):
        if wanted[i]:
            _modes(c[0], u[i, 0], out[row])
            row += 1


def walks(segments: Sequence[Segment], size_n: float, sized: bool = False) -> list[Term]:
    """One of every recording; size_n: one sigma of an hour's, N: none, no walk. Unless `sized` the data tell it."""
    found: list[Term] = []
    if not size_n:
        return found
    for number, name in enumerate(dict.fromkeys(segment.record for segment in segments)):
        last_s = max(s.time_s[-1] for s in segments if s.record == name)
        found.append(_walk(number, (last_s - _start(segments, name)) / 3600.0, size_n, sized))
    return found


def _walk(number: int, long_h: float, size_n: float, sized: bool) -> Term:
    effect = Effect(
        name=f"{HOURS}{number}",
        title="walk of the reference",
        site="force",
        channels=(f"{HOURS}{number}",),
        parameters=(
            Parameter(LASTS, "h", long_h, 0.0, np.inf, (long_h,), "", amplitude=False, estimate=False),
            *(Parameter(name, "N", 0.0, -1e12, 1e12, (1.0,), "") for name in NAMES),
        ),
        step=_step,
        prepare=None,
        n_state=0,
        equation="",
        source="",
        separating_test="",
        elements=_elements,
    )
    return replace(at_start(effect, dict.fromkeys(NAMES, size_n), {}), sized=sized)


def hours_of(segments: Sequence[Segment], segment: Segment) -> dict[str, Floats]:
    """Channels of one segment: its hours since its recording began, and those of the others."""
    names = list(dict.fromkeys(one.record for one in segments))
    own = (segment.time_s - _start(segments, segment.record)) / 3600.0
    elsewhere = np.full(len(segment), ELSEWHERE)
    return {f"{HOURS}{k}": own if name == segment.record else elsewhere for k, name in enumerate(names)}


def lasts_h(term: Term) -> float:
    """Of the recording of a walk."""
    return term.fixed[LASTS]


def told(terms: Sequence[Term], precisions: Mapping[str, float]) -> float | None:
    """One sigma of an hour's walk, N, of these terms; None where there are none."""
    squares = [term.std[NAMES[0]] ** 2 / precisions.get(term.effect.name, 1.0) for term in terms if is_walk(term)]
    return float(np.sqrt(np.mean(squares))) if squares else None


def _start(segments: Sequence[Segment], name: str) -> float:
    return float(min(s.start_s for s in segments if s.record == name))


def is_walk(term: Term) -> bool:
    """Of the reference, no effect of the mount."""
    return term.effect.name.startswith(HOURS)


def walking(terms: Sequence[Term]) -> Flags:
    """Which of the numbers (n,) of these terms are a walk's."""
    return np.array([is_walk(term) for term in terms for _ in term.free], bool)
