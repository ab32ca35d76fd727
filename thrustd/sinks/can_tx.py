"""Estimates out on the bus: net thrust, its standard deviation and its status per engine, ICD ids 1850 to 1855.

The three go together, `rate_hz` times a second by a schedule of due times: of the estimates the one that is nearest to
its due time is sent, so the rate is kept however the steps jitter, also where it is that of the estimates. Nothing is
sent before a thrust has been found, and none of the three where one of them is no number: no status is valid alone.
"""

from collections.abc import Callable
from math import isfinite
from typing import Final

from thrustd.core.types import Estimate, Fault, Output, Status
from thrustd.wire.can_frames import CanEncoder
from thrustd.wire.can_table import CanTable
from thrustd.wire.estimate_status import status_word

WHERE: Final = "can_out"
TELL_NS = 1_000_000_000  # failures are told in bunches, at most so often


class CanTx:
    """A sink for estimates; `send` may raise OSError, the sink does not."""

    def __init__(
        self,
        table: CanTable,
        node_id: int,
        rate_hz: float,
        estimate_hz: float,
        send: Callable[[int, bytes], None],
        report: Callable[[Fault], None],
    ) -> None:
        self._encoder = CanEncoder(table, node_id)
        self._period_ns = round(1e9 / rate_hz)
        self._early_ns = round(0.5e9 / estimate_hz)  # the next estimate would be further from its due time
        self._send = send
        self._report = report
        self._due_ns: dict[int, int] = {}  # per engine
        self._told_ns: int | None = None
        self._untold = 0

    def write_output(self, output: Output) -> None:
        """Send an estimate when one of this engine is due; anything else is not for the bus."""
        if not isinstance(output, Estimate):
            return
        if not self._is_due(output):
            return
        try:
            for ident, data in self._messages(output):
                self._send(ident, data)
        except (OSError, ValueError, OverflowError, KeyError):
            self._untold += 1
            if self._told_ns is None or output.t_ns - self._told_ns >= TELL_NS:
                self._report(Fault(output.t_ns, WHERE, "not_sent", count=self._untold))
                self._told_ns, self._untold = output.t_ns, 0

    def _messages(self, estimate: Estimate) -> list[tuple[int, bytes]]:
        """All of one estimate; ValueError, OverflowError or KeyError when one of them cannot be said."""
        if not isfinite(estimate.thrust_n + estimate.thrust_std_n):
            raise ValueError("no number to send")
        said = ("thrust_N", estimate.thrust_n), ("thrust_std_N", estimate.thrust_std_n)
        status = "thrust_status", status_word(estimate.status)
        return [self._encoder.encode(signal, estimate.engine, value) for signal, value in (*said, status)]

    def _is_due(self, estimate: Estimate) -> bool:
        t_ns, due_ns = estimate.t_ns, self._due_ns.get(estimate.engine)
        if due_ns is None:
            if estimate.status & Status.CONVERGING:
                return False
            due_ns = t_ns
        early_ns = due_ns - t_ns
        if self._early_ns < early_ns <= self._period_ns:
            return False
        if abs(early_ns) > self._period_ns:  # a pause is not made up for; a clock that went back begins anew
            due_ns = t_ns
        self._due_ns[estimate.engine] = due_ns + self._period_ns
        return True

    def close(self) -> None:
        """Nothing is kept back."""
