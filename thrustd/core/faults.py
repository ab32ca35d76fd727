"""Every kind of fault, in one table: what it means, which status bit says so, and for how long.

`Fault.where` says what is concerned: "adc", "adc[1]" (a channel), "can[Engine1_N1]" (a message), "n1_pct[0]" (a
signal), "left_upper" (a mount), "mount[left]" (a source of an engine), "log", "checkpoint", ...
"""

from math import inf
from typing import NamedTuple

from thrustd.core.types import Status

MOMENT_S = 1.0
UNTIL_OVER = inf  # until the same fault comes again, not active


class FaultKind(NamedTuple):
    meaning: str
    status: Status
    shows_s: float = MOMENT_S
    of_engine: bool = False  # the fusion sets the bit, in the estimates of the engines that it matters to


FAULT_KINDS: dict[str, FaultKind] = {
    # what comes over a wire, and what a log holds of it
    "damaged": FaultKind("bytes, or chunks of a log, that fit no layout or checksum; discarded", Status.WIRE_FAULT),
    "foreign": FaultKind("a frame or message of another version, size or type than configured", Status.WIRE_FAULT),
    "lost": FaultKind("frames or messages missing by their counter (CAN: at least this many)", Status.WIRE_FAULT),
    "late": FaultKind("a frame or message that came already, or is older than the last; discarded", Status.WIRE_FAULT),
    "contested": FaultKind("an identifier with two senders, or a counter repeated with other data", Status.WIRE_FAULT),
    "reset": FaultKind("ADC sequence and device time started again", Status.WIRE_FAULT),
    "rate": FaultKind("ADC or its crystal runs at another rate than configured", Status.WIRE_FAULT, UNTIL_OVER),
    "open": FaultKind("ADC marks a channel open or shorted, or counts leave 24 bit", Status.CHANNEL_OPEN, UNTIL_OVER),
    "unplugged": FaultKind("a port or bus disappeared or refuses to open", Status.LINK_LOST, UNTIL_OVER),
    "silent": FaultKind(
        "nothing that is known comes over a wire; its signals are not reported one by one",
        Status.LINK_LOST | Status.SIGNAL_STALE, UNTIL_OVER,
    ),
    "bus_error": FaultKind("the CAN controller reports an error frame or a bus-off", Status.LINK_LOST),
    # readings
    "out_of_range": FaultKind("not a number, or outside the catalogue's range; not used", Status.OUT_OF_RANGE),
    "stale": FaultKind("no reading within the time its channel allows", Status.SIGNAL_STALE, UNTIL_OVER),
    # sensors and thrust sources that are excluded
    "dead": FaultKind("a sensor has stopped sending", Status.SENSOR_EXCLUDED, UNTIL_OVER, True),
    "stuck": FaultKind(
        "a sensor repeats one value while the others move", Status.SENSOR_EXCLUDED | Status.STUCK, UNTIL_OVER, True
    ),
    "noisy": FaultKind("a sensor scatters far more than before", Status.SENSOR_EXCLUDED, UNTIL_OVER, True),
    "offset": FaultKind("a sensor jumped away from the others", Status.SENSOR_EXCLUDED, UNTIL_OVER, True),
    "drift": FaultKind("a sensor drifted away from the others", Status.SENSOR_EXCLUDED, UNTIL_OVER, True),
    "failed": FaultKind(
        "a thrust source of an engine is excluded until it agrees again",
        Status.MOUNT_FAILED | Status.BROCHURE_FAILED, UNTIL_OVER, True,
    ),
    "zero": FaultKind(
        "not a fault: the zeros of the transducers were calibrated before the first engine start",
        Status.ENGINE_OFF, of_engine=True,
    ),
    "zero_refused": FaultKind(
        "before the first engine start a mount showed nothing, or more than a zero can be; it flies without a zero",
        Status.SENSOR_EXCLUDED, 10.0, of_engine=False,
    ),
    # the machine
    "overrun": FaultKind("events or log items dropped, the oldest first: something is too slow", Status.OVERLOAD),
    "not_recorded": FaultKind(
        "the log cannot be written (disk full, read-only); items lost until it can", Status.NOT_RECORDING, UNTIL_OVER
    ),
    "not_sent": FaultKind("CAN output, live view or health page cannot be served", Status.OUTPUT_FAULT),
    "not_saved": FaultKind("the checkpoint cannot be written: a restart now is cold", Status.NO_CHECKPOINT, UNTIL_OVER),
    "cold": FaultKind("the checkpoint is old, damaged or of other models: started cold", Status.CONVERGING),
    "clock_step": FaultKind(
        "the calendar clock jumped; count is the size in ms. Estimates use the monotonic clock", Status.CLOCK_STEP, 10.0
    ),
}  # fmt: skip
