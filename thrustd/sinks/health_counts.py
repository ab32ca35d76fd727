"""What the process has seen, as plain numbers: written by the estimation thread, read by whoever serves the page."""

import time
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

from thrustd.types import Estimate, Event, Fault, Frame, Output

LATENCY_BOUNDS_S: Final = (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5, 1.0, 5.0)
NIS_BOUNDS: Final = (0.1, 0.5, 1.0, 2.0, 4.0, 9.0, 16.0, 25.0)


class Histogram:
    """Counts per bucket (the last one is open), and the sum of all values."""

    __slots__ = ("bounds", "counts", "sum")

    def __init__(self, bounds: tuple[float, ...]) -> None:
        self.bounds = bounds
        self.counts = [0] * (len(bounds) + 1)
        self.sum = 0.0

    def take(self, value: float) -> None:
        self.counts[bisect_left(self.bounds, value)] += 1
        self.sum += value


class HealthCounts:
    """A sink for events and outputs."""

    def __init__(self, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.clock_ns = clock_ns
        self.started_ns = clock_ns()
        self.events: Counter[str] = Counter()  # by channel
        self.last_ns: dict[str, int] = {}  # of each channel
        self.faults: Counter[tuple[str, str]] = Counter()  # where, kind -> how many
        self.estimates: Counter[int] = Counter()  # by engine
        self.latest: dict[int, Estimate] = {}  # by engine
        self.latency_s = Histogram(LATENCY_BOUNDS_S)  # event in -> estimate out
        self.nis = Histogram(NIS_BOUNDS)
        self._arrived_ns = 0

    def take_events(self, events: Sequence[Event]) -> None:
        """Before the pipeline works on them; latency counts from the oldest."""
        self._arrived_ns = events[0].t_ns
        for event in events:
            if not isinstance(event, Fault):
                channel = event.channel if isinstance(event, Frame) else "tick"
                self.events[channel] += 1
                self.last_ns[channel] = event.t_ns

    def write_output(self, output: Output) -> None:
        if isinstance(output, Fault):
            self.faults[output.where, output.kind] += output.count
        elif isinstance(output, Estimate):
            self.latest[output.engine] = output
            self.estimates[output.engine] += 1
            self.latency_s.take((self.clock_ns() - self._arrived_ns) * 1e-9)
            if output.nis == output.nis:
                self.nis.take(output.nis)

    def age_s(self, channel: str) -> float:
        """Since the last event of a channel."""
        return (self.clock_ns() - self.last_ns[channel]) * 1e-9
