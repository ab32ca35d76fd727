"""A thermal effect of another part than the rubber: `thermal_expansion at sat_degC` is that of a rod in the open air.

The law is the same; in place of the mount's own temperature it reads another one that was recorded. Which part warms
is seldom known before: the rubber, the rod of the transducer, the bracket, the cell.
"""

from dataclasses import replace
from functools import cache

from thrustd.model.effect import Effect
from thrustd.model.modulated import BY

AT = " at "
TEMPERATURE = "temperature_degC"  # of the mount
KIND = "_degC"  # how other temperatures end
MARKS = AT, BY, '"', "'"  # of the names of effects, and of formulas


def at_column(effect: Effect, column: str) -> Effect:
    """`effect` by the temperature `column`; one that reads no temperature is the same by any."""
    return _at_column(effect.name, column, effect) if thermal(effect) else effect


@cache
def _at_column(name: str, column: str, effect: Effect) -> Effect:
    return replace(
        effect,
        name=f"{name}{AT}{column}",
        title=f"{effect.title}, by {column}",
        channels=tuple(column if own == TEMPERATURE else own for own in effect.channels),
        variant_of=effect.word,
        equation=f"{effect.equation}, T = {column}",
    )


def is_temperature(column: str) -> bool:
    """Whether a column can stand behind AT."""
    return column.endswith(KIND) and not any(mark in column for mark in MARKS)


def thermal(effect: Effect) -> bool:
    """Whether it reads the mount's temperature."""
    return TEMPERATURE in effect.channels
