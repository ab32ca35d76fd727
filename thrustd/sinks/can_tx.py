"""Estimates out on the bus: net thrust and its standard deviation per engine, ICD ids 1850 to 1853."""

from collections.abc import Callable
from math import isfinite
from typing import Final

from thrustd.core.types import Estimate, Fault, Output
from thrustd.wire.can_frames import CanEncoder
from thrustd.wire.can_table import CanTable

WHERE: Final = "can_out"
TELL_NS = 1_000_000_000  # failures are told in bunches, at most so often


class CanTx:
    """A sink for estimates; `send` may raise OSError, the sink does not."""

    def __init__(
        self,
        table: CanTable,
        node_id: int,
        rate_hz: float,
        send: Callable[[int, bytes], None],
        report: Callable[[Fault], None],
    ) -> None:
        self.failed_messages = 0
        self._encoder = CanEncoder(table, node_id)
        self._period_ns = round(1e9 / rate_hz)
        self._send = send
        self._report = report
        self._sent_ns: dict[int, int] = {}  # per engine
        self._told_ns: int | None = None
        self._untold = 0

    def write_output(self, output: Output) -> None:
        """Send an estimate when one of this engine is due; anything else is not for the bus."""
        if not isinstance(output, Estimate):
            return
        last_ns = self._sent_ns.get(output.engine)
        if last_ns is not None and 0 <= output.t_ns - last_ns < self._period_ns:
            return
        self._sent_ns[output.engine] = output.t_ns
        self._say(output.t_ns, "thrust_N", output.engine, output.thrust_n)
        self._say(output.t_ns, "thrust_std_N", output.engine, output.thrust_std_n)

    def close(self) -> None:
        """Nothing is kept back."""

    def _say(self, t_ns: int, signal: str, engine: int, value: float) -> None:
        try:
            if not isfinite(value):
                raise ValueError("no number to send")
            self._send(*self._encoder.encode(signal, engine, value))
        except (OSError, ValueError, OverflowError, KeyError):
            self.failed_messages += 1
            self._untold += 1
            if self._told_ns is None or t_ns - self._told_ns >= TELL_NS:
                self._report(Fault(t_ns, WHERE, "not_sent", count=self._untold))
                self._told_ns, self._untold = t_ns, 0
