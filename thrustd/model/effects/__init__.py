"""The shelf of physical effects: the folder is the registry; other packages add theirs by entry point.

Effects of a user's file join by `put_on_shelf`; a name that is a formula is an effect made of it (model/expression.py),
one like `hysteresis by voltage_V` a law of the shelf whose strength follows a channel (model/modulated.py), one like
`thermal_expansion at sat_degC` a thermal one of another temperature (model/elsewhere.py), one like `curve of sat_degC`
whatever follows a channel (model/free_curve.py).
"""

from collections.abc import Collection, Mapping
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules

from thrustd.core.errors import ModelError
from thrustd.model.effect import Effect
from thrustd.model.elsewhere import AT, KIND, TEMPERATURE, at_column, is_temperature, thermal
from thrustd.model.expression import expression_effect, is_expression
from thrustd.model.free_curve import curve_named, is_curve
from thrustd.model.modulated import BY, modulated

ENTRY_POINT = "thrustd.effects"
NEAREST = 3  # names offered for one that is unknown


@cache
def shelf() -> Mapping[str, Effect]:
    """Every known effect by name: the files of this folder, then packages with entry point `thrustd.effects`."""
    found: dict[str, Effect] = {}
    for module in sorted(info.name for info in iter_modules(__path__)):
        effect: Effect = import_module(f"{__name__}.{module}").EFFECT
        found[effect.name] = effect
    for point in entry_points(group=ENTRY_POINT):
        effect = point.load()
        if effect.name in found:
            raise ModelError(f"effect '{effect.name}' of package entry point '{point.value}' already exists")
        found[effect.name] = effect
    return found | _more


def put_on_shelf(effect: Effect, where: str) -> None:
    """Add an effect that was loaded on request; ModelError when its name is taken by another."""
    known = shelf().get(effect.name)
    if known is not None and known is not effect:
        raise ModelError(f"{where}: effect '{effect.name}' already exists, expected a new name")
    _more[effect.name] = effect
    shelf.cache_clear()


_more: dict[str, Effect] = {}  # loaded from files since the start of the process


def effect_named(name: str, columns: Collection[str] = ()) -> Effect:
    """The effect of that name (or formula, which may read `columns`); ModelError that offers the nearest."""
    if is_curve(name):
        return curve_named(name)
    law, by, channel = name.partition(BY)
    if by and not is_expression(law.partition(AT)[0]):
        return modulated(effect_named(law), channel)
    law, at, column = name.partition(AT)
    if at and not is_expression(law):
        if not thermal(found := effect_named(law)):
            raise ModelError(f"{name}: {law} reads no {TEMPERATURE}; expected a thermal effect before{AT}{column}")
        if not is_temperature(column):
            raise ModelError(f"{name}: '{column}' is no temperature; expected a column that ends in {KIND}")
        return at_column(found, column) if column != TEMPERATURE else found
    if is_expression(name):
        return expression_effect(name, columns)
    if name not in shelf():
        near = " or ".join(get_close_matches(name.lower(), shelf(), NEAREST)) or "a name"
        raise ModelError(f"unknown effect '{name}': expected {near} (thrustd effects lists all {len(shelf())})")
    return shelf()[name]


def laws_like(effect: Effect) -> list[Effect]:
    """Every law of the shelf that goes by its word, by the temperature that it reads."""
    found, column = [law for law in shelf().values() if law.word == effect.word], effect.name.partition(AT)[2]
    return [at_column(law, column) for law in found] if column else found


def effect_said(name: str) -> str:
    """Its word, as every report has it, and the law where that is another; the name of one that is not here."""
    try:
        word = effect_named(name).word
    except ModelError:
        return name
    return name if word == name else f"{word} ({name})"
