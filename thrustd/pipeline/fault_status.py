"""Faults as status bits, as `core.faults` says: for a moment, or by place until the fault is over.

A fault of one engine's sensor shows in that engine's estimates only. Those of sensors and sources that are excluded
are not kept here: the fusion sets their bits.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.core.columns import Integers
from thrustd.core.faults import FAULT_KINDS, UNTIL_OVER
from thrustd.core.types import Fault, Status


class FaultStatus:
    """Which bits are on. Mutable, reads no clock."""

    __slots__ = ("_bits", "_changed", "_engine_of", "_momentary", "_open")

    def __init__(self, engines: int, engine_of: Mapping[str, int]) -> None:
        """`engine_of`: place of a fault -> the one engine that it concerns."""
        self._engine_of = engine_of
        self._open: set[tuple[str, str]] = set()  # place, kind
        self._momentary: dict[tuple[Status, int | None], int] = {}  # bit, engine or None for all -> until when
        self._bits, self._changed = np.zeros(engines, np.int64), False

    def take(self, fault: Fault) -> None:
        kind = FAULT_KINDS.get(fault.kind)  # a log of another version may hold other words
        if kind is None or kind.of_engine:
            return
        if not fault.active:
            self._open.discard((fault.where, fault.kind))
        elif kind.shows_s == UNTIL_OVER:
            self._open.add((fault.where, fault.kind))
        else:
            what = kind.status, self._engine_of.get(fault.where)
            self._momentary[what] = fault.t_ns + round(kind.shows_s * 1e9)
        self._changed = True

    def bits(self, t_ns: int) -> Integers:
        """Status bits at t_ns, of each engine."""
        if self._changed or self._momentary:
            self._momentary = {what: until_ns for what, until_ns in self._momentary.items() if until_ns > t_ns}
            self._bits[:] = 0
            for bit, engine in self._momentary:
                self._set(bit, engine)
            for where, kind in self._open:
                self._set(FAULT_KINDS[kind].status, self._engine_of.get(where))
            self._changed = False
        return self._bits

    def _set(self, bit: Status, engine: int | None) -> None:
        self._bits[slice(None) if engine is None else engine] |= int(bit)
