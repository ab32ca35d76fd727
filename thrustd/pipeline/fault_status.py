"""Faults as status bits, as `core.faults` says: for a moment, or by place until the fault is over.

Those of sensors and routes are not kept here: the fusion sets their bits by engine.
"""

from thrustd.core.faults import FAULT_KINDS, UNTIL_OVER
from thrustd.core.types import Fault, Status


class FaultStatus:
    """Which bits are on. Mutable, reads no clock."""

    __slots__ = ("_bits", "_changed", "_momentary", "_open")

    def __init__(self) -> None:
        self._open: set[tuple[str, str]] = set()  # place, kind
        self._momentary: dict[Status, int] = {}  # bit -> until when
        self._bits, self._changed = 0, False

    def take(self, fault: Fault) -> None:
        kind = FAULT_KINDS.get(fault.kind)  # a log of another version may hold other words
        if kind is None or kind.of_engine:
            return
        if not fault.active:
            self._open.discard((fault.where, fault.kind))
        elif kind.shows_s == UNTIL_OVER:
            self._open.add((fault.where, fault.kind))
        else:
            self._momentary[kind.status] = fault.t_ns + round(kind.shows_s * 1e9)
        self._changed = True

    def bits(self, t_ns: int) -> int:
        """Status bits at t_ns."""
        if self._changed or self._momentary:
            self._momentary = {bit: until_ns for bit, until_ns in self._momentary.items() if until_ns > t_ns}
            self._bits = 0
            for bit in (*self._momentary, *(FAULT_KINDS[kind].status for _, kind in self._open)):
                self._bits |= int(bit)
            self._changed = False
        return self._bits
