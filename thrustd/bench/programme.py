"""What a rig is asked to do: random steps, sines, multisines and sweeps of force, or of any channel.

The thesis' identification programme steps through random forces between 400 N and 6.5 kN, each held for minutes; its
characterisation adds slow sines; the sweep it recommends is a multisine here.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats

LOW_N = 400.0
HIGH_N = 6500.0
HOLD_S = (120.0, 480.0)
RAMP_S = (0.5, 2.0)


class Levels(NamedTuple):
    """Between which levels a signal steps, and how: the thesis' programme."""

    low: float = LOW_N
    high: float = HIGH_N
    hold_s: tuple[float, float] = HOLD_S
    ramp_s: tuple[float, float] = RAMP_S
    start: float | None = None  # None: at the lower one
    parts: int = 1  # of the range: every one is visited as often


def _targets(levels: Levels, rng: np.random.Generator) -> Iterator[float]:
    """Hands of one level from each part of the range, shuffled; the first and the last are the ends themselves."""
    edges = np.linspace(levels.low, levels.high, levels.parts + 1)
    while True:
        hand = rng.uniform(edges[:-1], edges[1:])
        if levels.parts > 1:
            hand[[0, -1]] = levels.low, levels.high
        yield from rng.permutation(hand).tolist()


def random_steps(
    duration_s: float,
    sample_hz: float,
    rng: np.random.Generator,
    levels: Levels = Levels(),  # noqa: B008 - immutable
) -> Floats:
    """Random levels held for random times with smooth ramps between them, (n,)."""
    count = round(duration_s * sample_hz)
    signal = np.empty(count)
    level = levels.low if levels.start is None else levels.start
    done, targets = 0, _targets(levels, rng)
    while done < count:
        target = next(targets)
        ramp = max(1, round(rng.uniform(*levels.ramp_s) * sample_hz))
        hold = round(rng.uniform(*levels.hold_s) * sample_hz)
        rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, ramp + 1) / ramp)
        piece = np.concatenate((level + (target - level) * rise, np.full(hold, target)))[: count - done]
        signal[done : done + len(piece)] = piece
        done += len(piece)
        level = target
    return signal


def sine(duration_s: float, sample_hz: float, frequency_hz: float, low: float = LOW_N, high: float = HIGH_N) -> Floats:
    """One frequency between two levels, starting at the lower one, (n,)."""
    time_s = np.arange(round(duration_s * sample_hz)) / sample_hz
    return low + (high - low) * (0.5 - 0.5 * np.cos(2 * np.pi * frequency_hz * time_s))


def multisine(
    duration_s: float,
    sample_hz: float,
    rng: np.random.Generator,
    band_hz: tuple[float, float] = (0.001, 1.0),
    lines: int = 40,
    low: float = LOW_N,
    high: float = HIGH_N,
) -> Floats:
    """Log-spaced lines of equal rate-weighted size and random phase, scaled to fill [low, high], (n,)."""
    time_s = np.arange(round(duration_s * sample_hz)) / sample_hz
    total = np.zeros(len(time_s))
    for frequency_hz in np.geomspace(*band_hz, lines):
        size = (band_hz[0] / frequency_hz) ** 0.5  # a hydraulic cylinder cannot move far and fast
        total += size * np.sin(2 * np.pi * (frequency_hz * time_s + rng.random()))
    return _between(total, low, high)


def sweep(
    duration_s: float, sample_hz: float, band_hz: tuple[float, float], low: float = LOW_N, high: float = HIGH_N
) -> Floats:
    """One sine whose frequency rises exponentially through the band, (n,)."""
    time_s = np.arange(round(duration_s * sample_hz)) / sample_hz
    low_hz, high_hz = band_hz
    rate = np.log(high_hz / low_hz) / time_s[-1]
    return _between(-np.cos(2 * np.pi * low_hz * np.expm1(rate * time_s) / rate), low, high)


def _between(signal: Floats, low: float, high: float) -> Floats:
    filled: Floats = low + (high - low) * (signal - signal.min()) / (signal.max() - signal.min())
    return filled
