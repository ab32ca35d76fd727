"""The laws that go by one word."""

from thrustd.diagnose.search.library import laws
from thrustd.model.effect import Effect
from thrustd.model.effects import laws_of


def variants(effect: Effect) -> list[Effect]:
    """Every law that goes by the word, when it is the word that was said; else the one law."""
    if effect.name != effect.word:
        return [effect]
    return laws([effect, *(law for law in laws_of(effect.word) if law.name != effect.name)])
