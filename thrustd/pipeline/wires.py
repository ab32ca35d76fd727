"""One wire that goes takes all its signals along: then the wire is said, not each of fifty signals.

While nothing comes over a wire, and for a moment after it is back, its signals that are stale or dead are kept unsaid;
those that are still so after that moment are said then. So it is with a channel of the ADC that is open, and the mount
behind it. What their counters missed is said as one sum. Where several
messages of a wire have one trouble at once, the wire has it, and counts. Status bits do not wait: see `fault_status`.
"""

from collections.abc import Mapping

from thrustd.core.config import Config
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Fault

ADC, CAN = "adc", "can"  # as the sources call them
SILENT_NS = 300_000_000  # since its last message: a 10 Hz channel, which may be silent for 0.5 s, spoke 0.1 s before
EVERY_NS = 50_000_000
RETURN_NS = 3_000_000_000  # the slowest channels come once a second
WITH_THE_WIRE = frozenset({"stale", "dead"})


class Wires:
    """Which wires carry nothing, and what is not said because of them. Mutable, reads no clock."""

    __slots__ = (
        "_back_ns",
        "_began",
        "_heard",
        "_lost",
        "_open",
        "_silent",
        "_unplugged",
        "_unsaid",
        "_wires_of",
        "next_ns",
    )

    def __init__(self, wires_of: Mapping[str, tuple[str, ...]]) -> None:
        """`wires_of`: place of a fault -> the wire over which it is known, and the channel of it."""
        self._wires_of = wires_of
        self._open: set[str] = set()  # channels
        self._silent: set[str] = set()
        self._unplugged: set[str] = set()
        self._back_ns = {ADC: 0, CAN: 0}
        self._unsaid: dict[tuple[str, str], Fault] = {}
        self._lost = {ADC: 0, CAN: 0}  # by the counters of single messages, while they were away
        self._heard: dict[tuple[str, str], dict[str, int]] = {}  # wire and kind -> when each of its messages had it
        self._began = False
        self.next_ns = 0  # of the next `look`

    def look(self, t_ns: int, adc_ns: int, can_ns: int) -> list[Fault]:
        """What is to be told of the wires at a fused step; `adc_ns`, `can_ns`: when each last brought something."""
        self.next_ns = t_ns + EVERY_NS
        if not self._began:
            self._began = True
            self._back_ns |= {ADC: t_ns, CAN: t_ns}
        found = []
        for wire, heard_ns in ((ADC, adc_ns), (CAN, can_ns)):
            silent = t_ns - max(heard_ns, self._back_ns[wire]) >= SILENT_NS and wire not in self._unplugged
            if silent != (wire in self._silent):
                found.append(Fault(t_ns, wire, "silent", silent))
        return found

    def take(self, fault: Fault) -> list[Fault]:
        """The fault when it is to be said now."""
        gone = {"silent": self._silent, "unplugged": self._unplugged, "open": self._open}.get(fault.kind)
        if gone is not None and (fault.where in self._back_ns or gone is self._open):
            (gone.add if fault.active else gone.discard)(fault.where)
            if not fault.active:
                self._back_ns[fault.where] = fault.t_ns
        wire = fault.where.partition("[")[0]
        if fault.kind == "lost" and wire != fault.where and not self._may_speak(wire, fault.t_ns):
            self._lost[wire] += fault.count
            return []
        if fault.kind not in WITH_THE_WIRE or fault.where not in self._wires_of:
            return [self._of_the_wire(fault, wire)]
        what = fault.where, fault.kind
        if not fault.active:
            return [] if self._unsaid.pop(what, None) else [fault]
        if self._answers_for_itself(fault.where, fault.t_ns):
            return [fault]
        self._unsaid[what] = fault
        return []

    def _of_the_wire(self, fault: Fault, wire: str) -> Fault:
        """The fault of a message, or of its wire when others have it at once."""
        if wire == fault.where or wire != CAN:
            return fault
        heard = self._heard.setdefault((wire, fault.kind), {})
        heard[fault.where] = fault.t_ns
        if len(heard) > 1:
            for place in [place for place, t_ns in heard.items() if fault.t_ns - t_ns > RETURN_NS]:
                del heard[place]
        return fault._replace(where=wire) if len(heard) > 1 else fault

    def due(self, t_ns: int) -> list[Fault]:
        """What a wire that is back does not excuse any longer."""
        if not (self._unsaid or any(self._lost.values())):
            return []
        lost = [wire for wire, count in self._lost.items() if count and self._may_speak(wire, t_ns)]
        sums = [Fault(t_ns, wire, "lost", count=self._lost.pop(wire)) for wire in lost]
        self._lost |= dict.fromkeys(lost, 0)
        late = [what for what in self._unsaid if self._answers_for_itself(what[0], t_ns)]
        return [*sums, *(self._unsaid.pop(what)._replace(t_ns=t_ns) for what in late)]

    def _answers_for_itself(self, place: str, t_ns: int) -> bool:
        return all(self._may_speak(wire, t_ns) for wire in self._wires_of[place])

    def _may_speak(self, wire: str, t_ns: int) -> bool:
        gone = wire in self._silent or wire in self._unplugged or wire in self._open
        return not gone and t_ns - self._back_ns.get(wire, -RETURN_NS) >= RETURN_NS


def wires_of(config: Config, heard: tuple[tuple[str, int], ...]) -> dict[str, tuple[str, ...]]:
    """Place of a fault -> its wire and channel; `heard`: signals with their index that come over the bus."""
    mounts = {mount.name: (ADC, f"{ADC}[{mount.adc_channel}]") for mount in config.mount}
    return {**mounts, **{f"{signal}[{index}]": (CAN,) for signal, index in heard}}


def engines_of(config: Config) -> dict[str, int]:
    """Place of a fault -> the one engine that it concerns; places that are not here concern all."""
    engines = config.aircraft.engines
    found = {f"{name}[{e}]": e for name, signal in CATALOGUE.items() if signal.scope == "engine"
             for e in range(len(engines))}  # fmt: skip
    for number, mount in enumerate(config.mount):
        places = [f"{name}[{number}]" for name, signal in CATALOGUE.items() if signal.scope == "mount"]
        found |= dict.fromkeys((mount.name, f"{ADC}[{mount.adc_channel}]", *places), engines.index(mount.engine))
    return found
