"""What the process has seen, as plain numbers: written by the estimation thread, read by whoever serves the page."""

import time
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable
from typing import Final

import numpy as np

from thrustd.core.columns import TICK
from thrustd.core.types import Estimate, Fault, Output
from thrustd.wire.event_batch import EventBatch

BUS: Final = "can"
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
        self.latency_s = Histogram(LATENCY_BOUNDS_S)  # last byte in -> estimate out
        self.nis = Histogram(NIS_BOUNDS)
        self._batch: EventBatch | None = None  # the events that are worked on
        self.heard_ns = 0  # of the first of them

    def take_batch(self, batch: EventBatch) -> None:
        """Before the pipeline works on it."""
        self._batch, self.heard_ns = batch, batch.t_ns.item(0)
        kinds = batch.kind.tobytes()
        for kind, channel in (*enumerate(batch.channels), (TICK, "tick")):
            last = kinds.rfind(kind)
            if last >= 0:
                self.events[channel] += kinds.count(kind)
                self.last_ns[channel] = batch.t_ns.item(last)

    def write_output(self, output: Output) -> None:
        if isinstance(output, Fault):
            if output.active:
                self.faults[output.where, output.kind] += max(output.count, 1)  # a refused disk has lost nothing yet
        elif isinstance(output, Estimate):
            self.latest[output.engine] = output
            self.latency_s.take((self.clock_ns() - self._arrival_ns(output.t_ns)) * 1e-9)
            self.estimates[output.engine] += 1  # behind its latency: a page that is written now shows no more of these
            if output.nis == output.nis:
                self.nis.take(output.nis)

    def _arrival_ns(self, instant_ns: int) -> int:
        """Of the event that made the step of this instant due: the first that is not older and no CAN message, which
        makes none due. A sample is never newer than its arrival, so this is never too late.
        """
        batch = self._batch
        if batch is None:
            return instant_ns
        arrived = batch.t_ns
        if BUS in batch.channels and not (ours := batch.kind != batch.channels.index(BUS)).all() and ours.any():
            arrived = arrived[ours]
        return arrived.item(min(int(np.searchsorted(arrived, instant_ns)), len(arrived) - 1))

    def age_s(self, channel: str) -> float:
        """Since the last event of a channel."""
        return (self.clock_ns() - self.last_ns[channel]) * 1e-9
