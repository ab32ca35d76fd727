"""The nouns that travel through thrustd. All immutable, the unit in the name, times in integer nanoseconds.

Events go into the pipeline (`Frame`, `Tick`); outputs come out (`Reading`, `MountOutput`, `Estimate`, `Fault`).
"""

from enum import IntFlag
from math import nan
from typing import NamedTuple


class Frame(NamedTuple):
    """Bytes as they came, serial and CAN alike."""

    t_ns: int  # monotonic time stamped by the source
    channel: str  # "adc" for the serial ADC, "can" for the bus
    ident: int  # CAN identifier; 0 for serial bytes
    data: bytes  # serial: any chunk of the byte stream; CAN: the data bytes of one message


class Tick(NamedTuple):
    """Time for a step, so that estimation goes on when a sensor is silent."""

    t_ns: int


class Reading(NamedTuple):
    """One quantity in the catalogue's unit (see `thrustd.core.signals`)."""

    t_ns: int
    signal: str  # canonical channel name, e.g. "n1_pct"
    index: int  # engine 0.. or mount 0..; 0 for aircraft signals
    value: float


class Fault(NamedTuple):
    """Something arrived that should not have (or did not arrive): counted and logged, never raised."""

    t_ns: int
    where: str  # "adc", "can", "log", "left_upper", "n1_pct[0]", ...
    kind: str  # a word of FAULT_KINDS, e.g. "crc"
    count: int = 1  # how many at once, e.g. frames lost


FAULT_KINDS: dict[str, str] = {
    # serial bytes
    "cobs": "bytes between two delimiters are not COBS",
    "crc": "checksum does not match",
    "length": "frame or message shorter or longer than its kind says",
    "overlong": "no delimiter within the longest legal frame; bytes thrown away up to the next one",
    "version": "ADC frame of an unknown version",
    "channel_count": "ADC frame with another number of channels than configured",
    # ADC sequence and time
    "lost": "frames or messages missing by their counter (CAN: at least so many)",
    "duplicate": "the same frame or message twice; dropped",
    "late": "a frame older than one already seen; dropped",
    "adc_reset": "ADC sequence and device time started again",
    "sample_rate": "ADC samples come at another rate than configured: the thrust is not to be used",
    "sample_rate_over": "the ADC's rate is as configured again",
    "channel_fault": "ADC marks a channel open or shorted, or counts leave 24 bit",
    "channel_recovered": "the channel measures again; count is the number of samples it did not",
    # CAN messages
    "can_data_type": "CANaerospace data type is not the one the DBC says",
    "can_service": "CANaerospace service code is not 0: the sender does not call it normal data",
    "can_node": "another node sends an identifier that already has a living sender; dropped",
    "can_counter": "CANaerospace message code repeated with other data",
    "not_finite": "NaN or infinity in a message; dropped",
    # readings
    "out_of_range": "value outside the catalogue's range; it does not count",
    "stale": "no reading within the time its channel allows",
    "fresh": "a stale channel reads again",
    # sensors and routes that are not believed
    "dead": "a sensor that was there is silent for good",
    "dead_over": "it measures again",
    "stuck": "a sensor repeats itself although the others move",
    "stuck_over": "it is believed again",
    "noisy": "a sensor scatters far more than it used to",
    "noisy_over": "it is believed again",
    "offset": "a sensor jumped away from what the others say",
    "offset_over": "it is believed again",
    "drift": "a sensor left what the others say, little by little",
    "drift_over": "it is believed again",
    "mount_failed": "the mount route of an engine is not believed until it agrees again",
    "mount_recovered": "the mount route is believed again",
    "brochure_failed": "the brochure route of an engine is not believed until it agrees again",
    "brochure_recovered": "the brochure route is believed again",
    "tare": "not a fault: before the first engine start the mounts were asked for their zeros",
    # sources
    "unplugged": "a port or bus disappeared or refuses to open",
    "reconnected": "a port or bus is back",
    "bus_error": "the CAN controller reports an error frame or a bus-off",
    "queue_overrun": "events shed because the pipeline is too slow; the oldest go first",
    # sinks
    "log_overrun": "items missing in the log because the disk is too slow",
    "log_write": "the log cannot be written (disk full, read-only); items lost until it can",
    "log_damaged": "chunks of a log that is replayed are damaged and left out; count is how many, at least",
    "log_resumed": "recording goes on in a new file",
    "can_tx": "an estimate could not be sent on the bus",
    "live_view": "an output could not be shown in the live view",
    "health": "the health page cannot be served",
    # the process itself
    "clock_step": "the machine's calendar clock jumped; count is the size in ms. Estimates use the monotonic clock",
    "checkpoint_refused": "the checkpoint is old, damaged or of other models: started cold",
    "checkpoint_write": "the checkpoint cannot be written: a restart now would be cold",
    "checkpoint_resumed": "checkpoints are written again",
}


class Status(IntFlag):
    """Why an estimate is what it is. 0 = both routes healthy and inside their valid range."""

    MOUNT_LOST = 1 << 0  # no fresh mount measurement
    BROCHURE_LOST = 1 << 1  # no fresh brochure measurement
    MOUNT_REJECTED = 1 << 2  # gated out this step
    BROCHURE_REJECTED = 1 << 3  # gated out this step
    MOUNT_FAILED = 1 << 4  # declared failed until it agrees again
    BROCHURE_FAILED = 1 << 5  # declared failed until it agrees again
    MODEL_EXTRAPOLATING = 1 << 6  # deformation outside the model's valid range
    DECK_EXTRAPOLATING = 1 << 7  # outside the brochure deck's fitted region
    TRANSIENT = 1 << 8  # throttle moving: brochure route down-weighted
    GAP = 1 << 9  # ADC samples were lost; linear blocks stepped through or re-initialised
    ONE_MOUNT = 1 << 10  # engine thrust scaled from one mount
    ENGINE_OFF = 1 << 11  # N1 below 5 %: zero thrust
    LOAD_FACTOR_STALE = 1 << 12  # accelerations missing: g-load corrections at rest values
    CONVERGING = 1 << 13  # just started or restarted: band still wide
    STUCK = 1 << 14  # a sensor repeats itself although the other route moves
    OUT_OF_RANGE = 1 << 15  # a reading was outside the catalogue's range
    MOUNTS_DISAGREE = 1 << 16  # load share between the two mounts of an engine is implausible
    # about the installation: the estimate itself may be as good as ever (see `pipeline.fault_status`)
    WIRE_FAULT = 1 << 17  # damaged, missing, repeated or contradictory frames or messages in the last second
    CHANNEL_OPEN = 1 << 18  # the ADC marks a channel open or shorted
    LINK_LOST = 1 << 19  # a port or bus is away, or in error in the last second
    SIGNAL_STALE = 1 << 20  # a channel that was there is silent
    OVERLOAD = 1 << 21  # events or log items were shed in the last second
    NOT_RECORDING = 1 << 22  # the log cannot be written
    OUTPUT_FAULT = 1 << 23  # CAN output or live view failed in the last second
    CLOCK_STEP = 1 << 24  # the calendar clock jumped in the last ten seconds
    NO_CHECKPOINT = 1 << 25  # a restart now would be cold
    SENSOR_DOUBTED = 1 << 26  # a sensor that matters to this engine is not believed; the faults say which and why


class MountOutput(NamedTuple):
    """One mount at one fused step."""

    t_ns: int
    mount: int
    deformation_mm: float  # measured, before corrections
    force_n: float  # thrust share of this mount after g-load corrections
    std_n: float  # one sigma of the model in this region


class Estimate(NamedTuple):
    """Thrust of one engine at one fused step. Forward thrust positive; `*_std_n` one sigma."""

    t_ns: int
    engine: int
    thrust_n: float
    thrust_std_n: float
    thrust_rate_n_s: float
    mount_n: float  # mount route alone, bias included; NaN when there is none
    mount_std_n: float
    brochure_n: float  # brochure route alone; NaN when there is none
    brochure_std_n: float
    innovation_n: float  # mount measurement minus prediction
    brochure_innovation_n: float
    nis: float  # normalised innovation squared of the accepted measurements, NaN when none
    mount_bias_n: float
    brochure_bias: float  # relative, -
    load_share: float  # upper mount's part of the engine's mount force, -
    status: int  # Status bits
    brochure_nis: float = nan  # the brochure's own part of `nis`; NaN when it was not used at this step


class CrossCheck(NamedTuple):
    """What is said of one engine by different sensors, against each other: for trends over flights."""

    t_ns: int
    engine: int
    route_residual_n: float  # mount route minus brochure route; NaN without either
    asymmetry_n: float  # fused thrust minus the other engines' mean; NaN of a single engine


Event = Frame | Tick | Fault  # a source's own faults (unplugged, overrun) are logged and replayed like bytes
Output = Reading | MountOutput | Estimate | CrossCheck | Fault
