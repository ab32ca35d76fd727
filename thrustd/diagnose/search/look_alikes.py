"""Effects that the data at hand cannot tell apart, and the test that would.

Two effects are look-alikes when, on held-back blocks, the one removes nearly what the other does. Neighbours in physics
(the groups below) are named a little sooner: their difference rests on the exact form of the law, which a real mount
need not obey.
"""

from collections.abc import Sequence

from thrustd.diagnose.search.gram import gain_t
from thrustd.diagnose.search.selection import Scored

NEIGHBOURS: tuple[frozenset[str], ...] = (
    frozenset({"hysteresis", "free_play"}),
    frozenset({"viscous_damping", "time_delay"}),
    frozenset({"creep", "ageing", "sensor_drift", "thermal_expansion", "thermal_stiffness"}),
    frozenset({"payne", "vibration_rectification", "mullins_softening"}),
    frozenset({"sensor_scale", "ageing", "thermal_stiffness", "mullins_softening"}),
)
CLOSE = 0.4  # of the own squared error: a difference this small is none
ALIKE = 0.9  # of the squared error removed
NEIGHBOUR_CLOSE = 1.0  # the same for neighbours
NEIGHBOUR_ALIKE = 0.8
LEAST_ALIKE = 0.3  # whatever the difference in N: less than this is another matter
UNSURE_ALIKE = 0.6  # the same where the difference is not sure block by block
FAINT = 0.1  # of the own squared error: an effect that removes less looks like nothing at all
SURE = 2.5  # standard errors of the difference per block
NAMED = 3  # look-alikes whose own test is said


def look_alikes(scored: Scored, others: Sequence[Scored], own_n: float) -> tuple[str, ...]:
    """Names of effects that the data cannot separate from `scored`, nearest first."""
    found = [o for o in others if o.candidate.word != scored.candidate.word and _alike(scored, o, own_n)]
    return tuple(o.candidate.word for o in sorted(found, key=lambda o: o.fit.mse))


def _alike(scored: Scored, other: Scored, own_n: float) -> bool:
    if other.gain <= 0 or scored.gain <= FAINT * own_n**2:
        return False
    near = neighbours(scored.candidate.word, other.candidate.word)
    gap = (other.fit.mse - scored.fit.mse) / own_n**2
    share = other.gain / scored.gain
    close, alike = (NEIGHBOUR_CLOSE, NEIGHBOUR_ALIKE) if near else (CLOSE, ALIKE)
    unsure = gain_t(other.fit, scored.fit) < SURE and share >= UNSURE_ALIKE
    return share <= 1 / alike and (share >= alike or unsure or (gap <= close and share >= LEAST_ALIKE))


def neighbours(one: str, other: str) -> bool:
    """Whether two effects stand close in physics."""
    return any(one in group and other in group for group in NEIGHBOURS)


def advice_for(scored: Scored, alike: Sequence[str], others: Sequence[Scored]) -> list[str]:
    """The tests that separate an effect from its look-alikes, nearest first: its own, then those of the others."""
    if not alike:
        return []
    tests = {o.candidate.word: o.candidate.effect.separating_test for o in others}
    word = scored.candidate.word
    lines = [f"to tell {word} from {_listed(alike)}: {scored.candidate.effect.separating_test}"]
    return lines + [f"{name} alone would show so: {tests[name]}" for name in alike[:NAMED] if name in tests]


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
