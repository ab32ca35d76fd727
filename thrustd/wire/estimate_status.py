"""What the status of an estimate says on the bus: 32 bits, data type BLONG (ICD section 2, ids 1854 and 1855)."""

from thrustd.core.types import Status

_STARTING = Status.CONVERGING
_MOUNTS_OUT = Status.MOUNT_LOST | Status.MOUNT_FAILED
_BROCHURE_OUT = Status.BROCHURE_LOST | Status.BROCHURE_FAILED
_REJECTED = Status.MOUNT_REJECTED | Status.BROCHURE_REJECTED  # by the other source: the band holds both
_AT_FAULT = Status.SENSOR_EXCLUDED | Status.STUCK | Status.MOUNTS_DISAGREE | Status.CHANNEL_OPEN
_NOT_USED = Status.OUT_OF_RANGE | Status.SIGNAL_STALE | Status.LOAD_FACTOR_STALE | Status.LINK_LOST  # a reading is not
VALID, DEGRADED = 1 << 0, 1 << 1
BITS = (  # bit of the word, any of these bits of the estimate
    (DEGRADED, _MOUNTS_OUT | _BROCHURE_OUT | Status.ONE_MOUNT),
    (1 << 2, Status.DISAGREE | _REJECTED),
    (1 << 3, _AT_FAULT | _NOT_USED),
    (1 << 4, Status.NOT_RECORDING),
    (1 << 5, Status.MODEL_EXTRAPOLATING | Status.DECK_EXTRAPOLATING),
    (1 << 6, Status.TRANSIENT),
    (1 << 7, _STARTING),
)


def status_word(status: int) -> int:
    """Valid: some source carries the estimate (or the engine is off), and it has found its thrust."""
    carried = status & Status.ENGINE_OFF or not (status & _MOUNTS_OUT and status & _BROCHURE_OUT)
    word = VALID if carried and not status & _STARTING else 0
    for bit, any_of in BITS:
        word |= bit if status & any_of else 0
    return word
