"""The shelf of model structures, in the order of the thesis' table."""

from thrustd.core.errors import UsageError
from thrustd.identify.structures import (
    block_oriented,
    box_jenkins,
    equation_error,
    feedback,
    mount,
    narx,
    physical,
    static,
    wiener_hammerstein,
    with_effects,
)
from thrustd.identify.structures.structure import Fitted, Structure

__all__ = ["Fitted", "Structure", "shelf", "structure_named"]

_LINEAR = [structure for structure in block_oriented.STRUCTURES if structure.family == "linear"]
_BLOCKS = [structure for structure in block_oriented.STRUCTURES if structure.family != "linear"]


def shelf() -> dict[str, Structure]:
    """Every structure by name."""
    groups = (physical.STRUCTURES, static.STRUCTURES, equation_error.STRUCTURES, _LINEAR, box_jenkins.STRUCTURES)
    more = (
        narx.STRUCTURES,
        _BLOCKS,
        wiener_hammerstein.STRUCTURES,
        feedback.STRUCTURES,
        with_effects.STRUCTURES,
        mount.STRUCTURES,
    )
    return {structure.name: structure for group in (*groups, *more) for structure in group}


def structure_named(name: str) -> Structure:
    """The structure of that name; UsageError that lists what there is."""
    if name not in shelf():
        raise UsageError(f"unknown structure '{name}', expected one of {', '.join(shelf())}")
    return shelf()[name]
