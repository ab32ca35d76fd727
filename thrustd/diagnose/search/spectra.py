"""Numbers of an effect that are many of a kind, of which none says much alone: heights of a curve, stops, branches."""

import re
from collections.abc import Iterable, Mapping, Sequence

from thrustd.identify.regression.shape import SPECTRUM
from thrustd.model.free_curve import is_curve

NUMBERED = re.compile(r"_\d[\d.e]*(?=_|$)")


def kind_of(name: str) -> str:
    """What a parameter is called with all its kind: `friction_03_n` is one of `friction_.._n`."""
    return NUMBERED.sub("_..", name)


def together(names: Iterable[str]) -> list[list[str]]:
    """Every name alone, but for those of a kind, where these are many."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        kinds.setdefault(kind_of(name), []).append(name)
    return [part for own in kinds.values() for part in ([own] if len(own) >= SPECTRUM else [[name] for name in own])]


def many_words(effect: str, names: Sequence[str], values: Sequence[float], unit: str = "") -> str:
    """How many, how large; of heights of a curve no sum is said, which would mean nothing."""
    unit = f" {unit}" if unit not in ("", "-") else ""
    low, high = (float(f"{end:.2g}") + 0.0 for end in (min(values), max(values)))  # 120, not 1.2e+02; 0, not -0
    sizes = f"{low:g} to {high:g}{unit}"
    if is_curve(effect):
        return f"{len(values)} {names[0].partition('_')[0].replace('at', 'place')}s of {sizes}"
    return f"{len(values)} elements of {sizes}, {sum(values):.3g}{unit} together"


def folded(effect: str, parameters: Mapping[str, float]) -> dict[str, float | str]:
    """Parameters as a table shows them: a spectrum or a curve is one, in words."""
    found: dict[str, float | str] = {}
    for names in together(parameters):
        values = [parameters[name] for name in names]
        found |= {kind_of(names[0]): many_words(effect, names, values)} if len(names) > 1 else {names[0]: values[0]}
    return found
