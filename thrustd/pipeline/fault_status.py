"""Faults as status bits: every kind of fault has its bit (`docs/interfaces.md` shows them all).

Those of the installation are kept here: one with an end (unplugged .. reconnected) holds its bit until then, by place;
all others for a moment. Those of sensors and routes are set in the fusion, by engine.
"""

from thrustd.core.types import Fault, Status

MOMENT_NS = 1_000_000_000
LONG_MOMENT_NS = 10_000_000_000
ENDS: dict[str, str] = {  # kind -> the kind that ends it
    "unplugged": "reconnected",
    "channel_fault": "channel_recovered",
    "sample_rate": "sample_rate_over",
    "stale": "fresh",
    "log_write": "log_resumed",
    "checkpoint_write": "checkpoint_resumed",
}
FUSION_ENDS: dict[str, str] = {
    **{kind: f"{kind}_over" for kind in ("dead", "stuck", "noisy", "offset", "drift")},
    "mount_failed": "mount_recovered",
    "brochure_failed": "brochure_recovered",
}
WIRE = (
    *("cobs", "crc", "length", "overlong", "version", "channel_count", "lost", "duplicate", "late", "adc_reset"),
    *("sample_rate", "can_data_type", "can_service", "can_node", "can_counter", "not_finite"),
)
BITS: dict[str, Status] = {
    **dict.fromkeys(WIRE, Status.WIRE_FAULT),
    "out_of_range": Status.OUT_OF_RANGE,
    "channel_fault": Status.CHANNEL_OPEN,
    "stale": Status.SIGNAL_STALE,
    "unplugged": Status.LINK_LOST,
    "bus_error": Status.LINK_LOST,
    "queue_overrun": Status.OVERLOAD,
    "log_damaged": Status.WIRE_FAULT,
    "log_overrun": Status.OVERLOAD,
    "log_write": Status.NOT_RECORDING,
    "can_tx": Status.OUTPUT_FAULT,
    "live_view": Status.OUTPUT_FAULT,
    "health": Status.OUTPUT_FAULT,
    "clock_step": Status.CLOCK_STEP,
    "checkpoint_write": Status.NO_CHECKPOINT,
    "checkpoint_refused": Status.CONVERGING,
}
FUSION_BITS: dict[str, Status] = {
    **dict.fromkeys(("dead", "noisy", "offset", "drift"), Status.SENSOR_DOUBTED),
    "stuck": Status.SENSOR_DOUBTED | Status.STUCK,
    "mount_failed": Status.MOUNT_FAILED,
    "brochure_failed": Status.BROCHURE_FAILED,
    "tare": Status.ENGINE_OFF,
}
_BEGINS = {end: begin for begin, end in ENDS.items()}


class FaultStatus:
    """Which bits are on. Mutable, reads no clock."""

    __slots__ = ("_bits", "_changed", "_momentary", "_open")

    def __init__(self) -> None:
        self._open: set[tuple[str, str]] = set()  # place, kind
        self._momentary: dict[Status, int] = {}  # bit -> until when
        self._bits, self._changed = 0, False

    def take(self, fault: Fault) -> None:
        bit = BITS.get(fault.kind)
        if fault.kind in ENDS:
            self._open.add((fault.where, fault.kind))
        elif fault.kind in _BEGINS:
            self._open.discard((fault.where, _BEGINS[fault.kind]))
        elif bit is not None:
            moment_ns = LONG_MOMENT_NS if bit is Status.CLOCK_STEP else MOMENT_NS
            self._momentary[bit] = fault.t_ns + moment_ns
        self._changed = True

    def bits(self, t_ns: int) -> int:
        """Status bits at t_ns."""
        if self._changed or self._momentary:
            self._momentary = {bit: until_ns for bit, until_ns in self._momentary.items() if until_ns > t_ns}
            self._bits = 0
            for bit in (*self._momentary, *(BITS[kind] for _, kind in self._open)):
                self._bits |= int(bit)
            self._changed = False
        return self._bits
