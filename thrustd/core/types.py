"""The nouns that travel through thrustd. All immutable, the unit in the name, times in integer nanoseconds.

Events go into the pipeline (`Frame`, `Tick`); outputs come out (`Reading`, `MountOutput`, `Estimate`, `CrossCheck`,
`Terms`, `Fault`).
"""

from collections.abc import Callable
from enum import IntFlag
from math import nan
from typing import NamedTuple

Progress = Callable[[float, str], None]  # share done, 0 to 1, and what is under way


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
    kind: str  # a word of `core.faults.FAULT_KINDS`, e.g. "lost"
    active: bool = True  # False: it is over
    count: int = 1  # how many at once, e.g. frames lost


class Status(IntFlag):
    """Why an estimate is what it is. 0 = both sources healthy and inside their valid range."""

    MOUNT_LOST = 1 << 0  # no fresh mount measurement
    BROCHURE_LOST = 1 << 1  # no fresh brochure measurement
    MOUNT_REJECTED = 1 << 2  # gated out this step
    BROCHURE_REJECTED = 1 << 3  # gated out this step
    MOUNT_FAILED = 1 << 4  # declared failed until it agrees again
    BROCHURE_FAILED = 1 << 5  # declared failed until it agrees again
    MODEL_EXTRAPOLATING = 1 << 6  # deformation outside the model's valid range
    DECK_EXTRAPOLATING = 1 << 7  # outside the brochure deck's fitted region
    TRANSIENT = 1 << 8  # throttle moving: brochure source down-weighted
    GAP = 1 << 9  # ADC samples were lost; linear blocks stepped through or re-initialised
    ONE_MOUNT = 1 << 10  # engine thrust scaled from one mount
    ENGINE_OFF = 1 << 11  # nobody says that it runs: its thrust is none, or what windmilling costs
    LOAD_FACTOR_STALE = 1 << 12  # accelerations missing: g-load corrections at rest values
    CONVERGING = 1 << 13  # just started or restarted: band still wide
    STUCK = 1 << 14  # a sensor repeats itself although the other source moves
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
    DISAGREE = 1 << 27  # sources disagree and nothing tells which is right: the band covers both
    SENSOR_EXCLUDED = 1 << 26  # a sensor that matters to this engine is excluded; the faults say which and why


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
    mount_n: float  # mount source alone, bias included; NaN when there is none
    mount_std_n: float
    brochure_n: float  # brochure source alone; NaN when there is none
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
    source_residual_n: float  # mount source minus brochure source; NaN without either
    asymmetry_n: float  # fused thrust minus the other engines' mean; NaN of a single engine


class Terms(NamedTuple):
    """What the thrust of one engine may be wrong by at one fused step, term by term: one sigma each.

    The mounts' terms, NaN while none is trusted, and the fuel's part of the brochure's sigma. What deck and filter add
    besides, the estimate and the configuration tell.
    """

    t_ns: int
    engine: int
    calibration_n: float  # the model on held-out data, what it misses of creep in it
    zero_n: float
    stiffness_n: float
    friction_n: float
    beyond_n: float  # outside the identified range, counted from where the zero was found
    start_n: float  # load before the start, channels that are not measured: of both mounts to the same side
    share_n: float  # of the one mount that is left, with the couple of a mass that is off
    installation_n: float  # what nobody corrected of the installation, as far as the brochure does not bound it
    fuel_n: float  # density and heating value of the fuel on board: in the brochure's sigma


Event = Frame | Tick | Fault  # a source's own faults (unplugged, overrun) are logged and replayed like bytes
Output = Reading | MountOutput | Estimate | CrossCheck | Terms | Fault
