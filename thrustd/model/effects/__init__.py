"""The shelf of physical effects: the folder is the registry; other packages add theirs by entry point."""

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules

from thrustd.errors import ModelError
from thrustd.model.effect import Effect

ENTRY_POINT = "thrustd.effects"


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
    return found


def effect_named(name: str) -> Effect:
    """The effect of that name; ModelError that lists what there is."""
    if name not in shelf():
        raise ModelError(f"unknown effect '{name}': expected one of {', '.join(sorted(shelf()))}")
    return shelf()[name]
