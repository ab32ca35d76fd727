"""Ticks at a steady rate, so that estimates go on when every sensor is silent."""

import time
from collections.abc import Callable

from thrustd.core.types import Tick
from thrustd.sources.merge import Put
from thrustd.sources.worker import Worker


class Ticker:
    """Puts `Tick`s at `tick_hz`; missed ones are skipped, not made up for."""

    def __init__(self, tick_hz: float, put: Put, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._period_ns = round(1e9 / tick_hz)
        self._put = put
        self._clock_ns = clock_ns
        self._worker = Worker("ticker", self._run)

    def start(self) -> None:
        self._worker.start()

    def stop(self) -> None:
        self._worker.stop()

    def _run(self) -> None:
        due_ns = self._clock_ns()
        while not self._worker.stopping.is_set():
            now_ns = self._clock_ns()
            if now_ns >= due_ns:
                self._put(Tick(now_ns))
                due_ns += self._period_ns * (1 + (now_ns - due_ns) // self._period_ns)
            self._worker.stopping.wait(max(0, due_ns - now_ns) / 1e9)
