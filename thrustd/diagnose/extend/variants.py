"""The laws that go by one word."""

from collections.abc import Sequence

from thrustd.diagnose.search.candidates import by_other_temperatures
from thrustd.diagnose.search.library import laws
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, laws_like
from thrustd.model.elsewhere import AT, at_column
from thrustd.model.expression import PREFIX
from thrustd.model.free_curve import CURVE_OF, KINDS, free_curve, is_curve
from thrustd.model.modulated import BY, modulated
from thrustd.records.recording import Recording


def variants(effect: Effect, records: Sequence[Recording] = ()) -> list[Effect]:
    """Every law that goes by the word, when it is the word that was said, by every temperature of these records.

    Else the one law.
    """
    if effect.name.startswith(PREFIX):
        return [effect]
    if is_curve(effect.name):
        channel, asked = effect.word.removeprefix(CURVE_OF), effect.name == effect.word
        return [free_curve(channel, site) for site in KINDS.values()] if asked else [effect]
    law, by, channel = effect.name.partition(BY)
    if by:
        return [modulated(one, channel) for one in variants(effect_named(law))]
    law, at, column = effect.name.partition(AT)
    if at:
        return [at_column(one, column) for one in variants(effect_named(law))]
    if effect.name != effect.word:
        return [effect]
    found = laws([effect, *(law for law in laws_like(effect) if law.name != effect.name)])
    return found + by_other_temperatures(found, records)
