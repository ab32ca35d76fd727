"""The latest reading of every signal, with its age.

A reading holds until the next one and counts as missing once it is older than the catalogue's `stale_after_s`.
"""

from collections.abc import Sequence
from math import nan
from typing import Any, Final

import numpy as np

from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Fault, Reading
from thrustd.sync.align import keep, look
from thrustd.sync.memory import HELD

_new: Final = tuple.__new__  # half the time of calling a NamedTuple


class Hold:
    """The latest reading of every signal that is heard, with its age."""

    __slots__ = ("_places", "_t_ns", "_value", "heard", "held", "seen", "slots")

    def __init__(self, slots: Sequence[tuple[str, int]]) -> None:
        """`slots`: signal and index, in the order in which rows of readings number them."""
        self.slots = tuple(slots)
        self._places = {slot: place for place, slot in enumerate(self.slots)}
        self.held = np.zeros(len(self.slots), HELD)
        self._t_ns, self._value = self.held["t_ns"], self.held["value"]
        # by slot, and last for slot -1: values, NaN when never seen or stale; their ages [s], then 0
        self.seen = np.array([[nan], [0.0]]).repeat(len(self.slots) + 1, axis=1)
        self.heard = np.zeros(len(self.slots) + 1, np.int64)  # how many, then their slots in the order of hearing
        for place, (name, _) in enumerate(self.slots):
            signal = CATALOGUE[name]
            stale_after_ns = round(signal.stale_after_s * 1e9)
            self.held[place] = (0, stale_after_ns, 0, 0, 1, nan, signal.low, signal.high)

    def place(self, signal: str, index: int = 0) -> int:
        """Its slot; -1 when nobody hears it."""
        return self._places.get((signal, index), -1)

    def take(self, reading: Reading) -> Fault | None:
        """Keep a reading; a value outside the catalogue's range is a fault and does not count."""
        t_ns, signal, index, value = reading
        place = self._places[signal, index]
        return None if keep(self.held, self.heard, place, t_ns, value) else self.outside(t_ns, place)

    def outside(self, t_ns: int, place: int) -> Fault:
        """The fault of a reading outside its range."""
        signal, index = self.slots[place]
        return Fault(t_ns, f"{signal}[{index}]", "out_of_range")

    def look(self, t_ns: int) -> bool:
        """Bring `seen` to t_ns; true when signals went stale or came back: see `changes`."""
        return bool(look(self.held, self.heard, t_ns, self.seen))

    def newest_ns(self) -> int:
        """When the latest of all readings came."""
        return max(0, *self._t_ns.tolist())

    def value(self, t_ns: int, signal: str, index: int = 0) -> float:
        """One value at t_ns, NaN when never seen or stale."""
        self.look(t_ns)
        return self.seen.item(0, self.place(signal, index))

    def changes(self, t_ns: int) -> list[tuple[int, Fault]]:
        """Slots of signals that went stale, or came back, since the last call, each with what is to be told."""
        found = []
        for place in self._in_order():
            held = self.held[place]
            stale = t_ns - held["t_ns"] > held["stale_after_ns"]
            if stale != held["stale"]:
                signal, index = self.slots[place]
                found.append((place, Fault(t_ns, f"{signal}[{index}]", "stale", bool(stale))))
                held["stale"] = stale
        return found

    def readings(self, after_ns: int) -> list[Reading]:
        """The latest reading of every signal that was heard later than `after_ns`, at its own time."""
        t_ns, values = self._t_ns.tolist(), self._value.tolist()
        return [_new(Reading, (t_ns[i], *self.slots[i], values[i])) for i in self._in_order() if t_ns[i] > after_ns]

    def snapshot(self) -> list[list[Any]]:
        """Rows of signal, index, value, t_ns."""
        return [[*self.slots[i], self._value.item(i), self._t_ns.item(i)] for i in self._in_order()]

    def restore(self, rows: list[list[Any]], shift_ns: int = 0) -> bool:
        """Take over the readings of a snapshot, their times moved by `shift_ns`; False when it is none."""
        try:
            readings = [Reading(int(t_ns) + shift_ns, name, int(i), float(value)) for name, i, value, t_ns in rows]
            return all([self.take(reading) is None for reading in readings])
        except (KeyError, TypeError, ValueError, OverflowError):
            return False

    def _in_order(self) -> list[int]:
        """Slots that were heard, the first one first."""
        heard: list[int] = self.heard[1 : 1 + self.heard.item(0)].tolist()
        return heard
