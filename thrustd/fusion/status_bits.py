"""Why the filter's estimate is what it is: its part of the status word, in plain integers (see `types.Status`)."""

from math import isfinite

from thrustd.fusion.fusion_inputs import FusionInputs
from thrustd.fusion.gate import Gate, Verdict
from thrustd.types import Status

# IntFlag arithmetic costs a microsecond a bit, plain integers nothing
MOUNT_LOST, BROCHURE_LOST = int(Status.MOUNT_LOST), int(Status.BROCHURE_LOST)
MOUNT_REJECTED, BROCHURE_REJECTED = int(Status.MOUNT_REJECTED), int(Status.BROCHURE_REJECTED)
MOUNT_FAILED, BROCHURE_FAILED = int(Status.MOUNT_FAILED), int(Status.BROCHURE_FAILED)
MODEL_EXTRAPOLATING, DECK_EXTRAPOLATING = int(Status.MODEL_EXTRAPOLATING), int(Status.DECK_EXTRAPOLATING)
TRANSIENT, GAP, ONE_MOUNT = int(Status.TRANSIENT), int(Status.GAP), int(Status.ONE_MOUNT)
LOAD_FACTOR_STALE, ENGINE_OFF = int(Status.LOAD_FACTOR_STALE), int(Status.ENGINE_OFF)
CONVERGING = int(Status.CONVERGING)


def input_bits(inputs: FusionInputs) -> int:
    """What was known before the filter looked."""
    status = inputs.status
    if inputs.mount_extrapolating:
        status |= MODEL_EXTRAPOLATING
    if inputs.brochure_extrapolating:
        status |= DECK_EXTRAPOLATING
    if inputs.transient:
        status |= TRANSIENT
    if inputs.gap:
        status |= GAP
    if inputs.one_mount:
        status |= ONE_MOUNT
    if inputs.load_factor_stale:
        status |= LOAD_FACTOR_STALE
    return status


def mount_bits(there: bool, verdict: Verdict, gate: Gate) -> int:
    """`there`: the mounts say something at this step, and `verdict` is what became of it."""
    status = MOUNT_FAILED if gate.failed else 0
    if not there:
        return status | MOUNT_LOST
    return status if verdict.used else status | MOUNT_REJECTED


def brochure_bits(there: bool, verdict: Verdict, gate: Gate, off: bool) -> int:
    """`verdict` of the last reading: a value that is repeated is not judged again. `off`: nobody asks the deck."""
    status = BROCHURE_FAILED if gate.failed else 0
    if off:
        return status | ENGINE_OFF
    if not there:
        return status | BROCHURE_LOST
    return status | BROCHURE_REJECTED if isfinite(verdict.innovation_n) and not verdict.used else status
