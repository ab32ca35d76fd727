"""The nouns that travel through thrustd. All immutable, the unit in the name, times in integer nanoseconds.

Events go into the pipeline (`Frame`, `Tick`); outputs come out (`Reading`, `MountOutput`, `Estimate`, `Fault`).
"""

from enum import IntFlag
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
    """One quantity in the catalogue's unit (see `thrustd.signals`)."""

    t_ns: int
    signal: str  # canonical channel name, e.g. "n1_pct"
    index: int  # engine 0.. or mount 0..; 0 for aircraft signals
    value: float


class Fault(NamedTuple):
    """Something arrived that should not have (or did not arrive): counted and logged, never raised."""

    t_ns: int
    where: str  # "adc", "can", "log", "left_upper", "n1_pct[0]", ...
    kind: str  # a word from the catalogue in docs/interfaces.md, e.g. "crc"
    count: int = 1  # how many at once, e.g. frames lost


class Status(IntFlag):
    """Why an estimate is what it is. 0 = both routes healthy and inside their valid range."""

    MOUNT_LOST = 1 << 0  # no fresh mount measurement
    BROCHURE_LOST = 1 << 1  # no fresh brochure measurement
    MOUNT_REJECTED = 1 << 2  # gated out this step
    BROCHURE_REJECTED = 1 << 3
    MOUNT_FAILED = 1 << 4  # declared failed until it agrees again
    BROCHURE_FAILED = 1 << 5
    MODEL_EXTRAPOLATING = 1 << 6  # deformation outside the model's valid range
    DECK_EXTRAPOLATING = 1 << 7  # outside the brochure deck's fitted region
    TRANSIENT = 1 << 8  # throttle moving: brochure route down-weighted
    GAP = 1 << 9  # ADC samples were lost; linear blocks stepped through or re-initialised
    ONE_MOUNT = 1 << 10  # engine thrust scaled from one mount
    ENGINE_OFF = 1 << 11  # N1 below 5 %: zero thrust, mounts are tared
    LOAD_FACTOR_STALE = 1 << 12  # accelerations missing: g-load corrections at rest values
    CONVERGING = 1 << 13  # just started or restarted: band still wide
    STUCK = 1 << 14  # a sensor repeats itself although the other route moves
    OUT_OF_RANGE = 1 << 15  # a reading was outside the catalogue's range
    MOUNTS_DISAGREE = 1 << 16  # load share between the two mounts of an engine is implausible


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


Event = Frame | Tick
Output = Reading | MountOutput | Estimate | Fault
