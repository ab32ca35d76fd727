"""Faults counted and thinned: the first of a kind at a place goes out at once, repeats once a second as one count.

A noisy line may give thousands of faults a second; the sum of the counts that go out is always the number that came.
Begin and end of a fault never change places: what went out last is how it is.
"""

from thrustd.core.types import Fault

REPEAT_AFTER_NS = 1_000_000_000
_What = tuple[str, str, bool]  # where, kind, active


class FaultBook:
    """Counts by what a fault says but when. Mutable, reads no clock."""

    __slots__ = ("_held", "_since_ns")

    def __init__(self) -> None:
        self._since_ns: dict[_What, int] = {}  # when it last went out
        self._held: dict[_What, int] = {}  # counted since, the latest to come last

    def take(self, fault: Fault) -> Fault | None:
        """The fault if it is to go out now, None if it is held back."""
        key = (fault.where, fault.kind, fault.active)
        if key in self._held or _opposite(key) in self._held or not self._may_go(key, fault.t_ns):
            self._held[key] = self._held.pop(key, 0) + fault.count
            return None
        self._since_ns[key] = fault.t_ns
        return fault

    def due(self, t_ns: int) -> list[Fault]:
        """Held faults whose second is over, as one fault each; begin and end wait for each other."""
        if not self._held:
            return []
        early = {key for key in self._held if not self._may_go(key, t_ns)}
        keys = [key for key in self._held if not {key, _opposite(key)} & early]
        for key in keys:
            self._since_ns[key] = t_ns
        return [Fault(t_ns, *key, count=self._held.pop(key)) for key in keys]

    def _may_go(self, key: _What, t_ns: int) -> bool:
        return t_ns - self._since_ns.get(key, t_ns - REPEAT_AFTER_NS) >= REPEAT_AFTER_NS


def _opposite(key: _What) -> _What:
    where, kind, active = key
    return where, kind, not active
