"""What held-back parts of flights say of a set of effects: how likely they are to who has seen the rest alone.

    ln p(part | rest; set) - ln p(part | rest; without) = gain(all) - gain(rest),   gain: ln of how much likelier

A part is another recording where several are given, else a fifth of the flight. A set that makes the parts no likelier
than the model without it is not there: it fits what happened once. Nor is one that leaves as many N of the parts as
there were, in the mounts that it is in; fewer alone prove little, for a deck is wrong for minutes by more than most
effects. Nor is an effect whose size recordings disagree about so much that it may be nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.diagnose.search.weigh import Flown, Runs, Weighed, weigh
from thrustd.sensors.past import FUEL_FLOW

PARTS = 5  # of one recording


@dataclass(frozen=True, slots=True)
class HeldBack:
    """Of a set against a smaller one: both estimated without each part, and judged on it."""

    likelier: float  # ln, all parts together
    before_n: float  # of the mount that is judged
    after_n: float
    fell: bool  # the error of those mounts that the last effect is in


def held_back(seen: Flown, larger: Weighed, smaller: Weighed) -> HeldBack:
    """`larger` and `smaller` have been weighed on everything."""
    gain, foretold = larger.likelier(smaller), 0.0
    left: tuple[list[Runs], list[Runs]] = [], []
    for part in _parts(seen):
        rest, held = seen.without(part), seen.without([~flags for flags in part])
        before, after = weigh(rest, smaller.placed), weigh(rest, larger.placed, begin=larger.numbers)
        foretold += gain - after.likelier(before)
        for one, rests_n in zip((before, after), left, strict=True):
            rests_n.append(_rests_n(held, one))
    before_n, after_n = (_by_mount(parts) for parts in left)
    shows = [one is not None for one in (larger.placed[-1].in_mount(mount, seen.mounts[0]) for mount in seen.mounts)]
    fell = rms(after_n[shows]) < rms(before_n[shows])
    return HeldBack(foretold, float(before_n[0]), float(after_n[0]), fell)


def _by_mount(parts: Sequence[Runs]) -> Floats:
    """Rms of all parts together (mounts,)."""
    return np.array([rms(np.concatenate(of_one)) for of_one in zip(*parts, strict=True)])


def as_recordings_scatter(seen: Flown, one: Weighed) -> Weighed:
    """As sure as recordings agree that each tell the sizes alone (Birge, Phys. Rev. 40 (1932) 207)."""
    names = seen.recordings
    if len(names) < 2 or not one.placed:
        return one
    alone = [weigh(seen.only(name), one.placed, begin=one.numbers) for name in names]
    squares = sum(np.square((each.numbers - one.numbers) / each.std) for each in alone)
    factor = np.sqrt(np.maximum(squares / (len(names) - 1), 1.0))
    return replace(one, covariance=one.covariance * np.outer(factor, factor))


def told(one: Weighed) -> bool:
    """Whether the last effect of a set is surely not nothing."""
    free = one.placed[-1].term.free
    sizes = np.abs(one.numbers[-len(free) :]) > SIGMAS_95 * one.std[-len(free) :]
    return any(p.amplitude and sure for p, sure in zip(free, sizes, strict=True))


def _parts(seen: Flown) -> list[list[Flags]]:
    """For every part, rows that are in it, by source."""
    names, counts = seen.recordings, [len(source.counts) for source in seen.sources]
    if len(names) > 1:
        return [
            [np.full(n, s.segment.record == name) for s, n in zip(seen.sources, counts, strict=True)] for name in names
        ]
    number = np.arange(sum(counts)) * PARTS // sum(counts)
    return [np.split(number == part, np.cumsum(counts)[:-1]) for part in range(PARTS)]


def left_n(seen: Flown, one: Weighed) -> float:
    """Rms of what the mount says less its share of the fuel flow's thrust, both with their unknowns at their place."""
    return rms(_rests_n(seen, one)[0])


def _rests_n(seen: Flown, one: Weighed) -> Runs:
    """The same row by row, of every mount."""
    found: list[list[Floats]] = [[] for _ in seen.mounts]
    for source, run in zip(seen.sources, one.runs, strict=True):
        own = source.said + source.unknowns @ one.unknowns + source.of_mounts(run)
        for slot, (mount, rests_n) in enumerate(zip(seen.mounts, found, strict=True)):
            rests_n.append((own[:, slot] - mount.place.share * own[:, FUEL_FLOW])[source.counts[:, FUEL_FLOW]])
    return tuple(np.concatenate(rests_n) for rests_n in found)
