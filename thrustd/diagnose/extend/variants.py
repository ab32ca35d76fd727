"""The laws that go by one word."""

from thrustd.diagnose.search.library import laws
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf
from thrustd.model.modulated import BY, modulated


def variants(effect: Effect) -> list[Effect]:
    """Every law that goes by the word, when it is the word that was said; else the one law."""
    law, by, channel = effect.name.partition(BY)
    if by:
        return [modulated(one, channel) for one in variants(effect_named(law))]
    if effect.name != effect.word:
        return [effect]
    return laws([effect, *(other for other in shelf().values() if other.variant_of == effect.name)])
