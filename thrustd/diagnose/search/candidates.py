"""Which effects can be judged at all on these records."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.reference import is_own_output
from thrustd.diagnose.search.base import STATE_OF
from thrustd.diagnose.search.records import complete
from thrustd.identify.regression.walk import HOURS
from thrustd.identify.segments import DEFORMATION, FORCE
from thrustd.model.effect import Effect
from thrustd.model.elsewhere import TEMPERATURE, at_column, is_temperature, thermal
from thrustd.model.free_curve import difference, is_curve, nameable, product, quoted
from thrustd.records.recording import TIME, Recording

STILL = 1e-3  # a channel moves when its spread exceeds this share of its typical size ...
SAME = 0.05  # of its spread: a temperature that is no further from another is that one
NO_CURVE = {  # of a channel: why a free curve of it explains nothing
    FORCE: "is what is to be explained",
    DEFORMATION: "is what the model's own curve reads",
    TIME: "says when, which no other record repeats",
}


@dataclass(frozen=True, slots=True)
class NotJudged:
    """An effect the data say nothing about, and why."""

    effect: str
    reason: str


def not_judged_lines(not_judged: Sequence[NotJudged]) -> list[str]:
    """One line for all, by reason; none where everything was judged."""
    reasons: dict[str, list[str]] = {}
    for one in not_judged:
        reasons.setdefault(one.reason, []).append(one.effect)
    why = "; ".join(f"{', '.join(effects)} ({reason})" for reason, effects in sorted(reasons.items()))
    return [f"not judged: {why}"] if why else []


def judgeable(
    effects: Sequence[Effect], records: Sequence[Recording], present: Sequence[str]
) -> tuple[list[Effect], list[NotJudged]]:
    """Effects whose channels are there and move, and the others with the reason: those without a law that can be."""
    able, unable = [], []
    for effect in effects:
        reason = _reason(effect, records, present)
        if reason:
            unable.append(NotJudged(effect.word, reason))
        elif effect.word not in present:
            able.append(effect)
    words = {effect.word for effect in able}
    return able, [one for one in dict.fromkeys(unable) if one.effect not in words]


def by_other_temperatures(effects: Sequence[Effect], records: Sequence[Recording]) -> list[Effect]:
    """Thermal effects once more, by every other temperature that can be judged and does not say the mount's own."""
    channels = [name for record in records[:1] for name in record.channels]
    others = [name for name in channels if is_temperature(name) and name != TEMPERATURE and not _same(name, records)]
    return judgeable([at_column(law, name) for name in others for law in effects if thermal(law)], records, ())[0]


def _same(name: str, records: Sequence[Recording]) -> bool:
    """Whether a column says what the mount's own temperature says."""
    if not all(name in record and TEMPERATURE in record for record in records):
        return False
    one, own = (np.concatenate([record[column] for record in records]) for column in (name, TEMPERATURE))
    apart = one - own
    return bool(np.nanstd(apart) <= SAME * np.nanstd(own))


def _reason(effect: Effect, records: Sequence[Recording], present: Sequence[str]) -> str:
    if effect.word in present:
        return ""
    if why := no_explanation(effect):
        return why
    for channel in effect.channels:
        if channel == "time_s":
            continue
        if not all(channel in record for record in records):
            return f"channel {channel} is not in the data"
        column = np.concatenate([record[channel] for record in records])
        if not np.isfinite(column).any():
            return f"channel {channel} has no value at all"
        if not moves(column):
            return f"channel {channel} never moves"
        if not all(complete(record[channel]) for record in records):
            return f"channel {channel} has values missing"
    return ""


def no_curve(channel: str) -> str:
    """Why a free curve of a channel explains nothing; "" where it may."""
    why = "is thrustd's own output" if is_own_output(channel) else NO_CURVE.get(channel, "")
    return f"{channel} {why}" if why else ""


def no_explanation(effect: Effect) -> str:
    """Why what an effect reads explains nothing; a law may read time and deformation, a curve of them may not."""
    said = [no_curve(channel) for channel in effect.channels if is_curve(effect.name) or channel == FORCE]
    return next(filter(None, said), "")


def moves(column: Floats) -> bool:
    """Whether a channel varies at all, beyond its last digit."""
    good = column[np.isfinite(column)]
    if good.size < 2:
        return False
    low, high = np.quantile(good, [0.001, 0.999])
    return bool(high - low > STILL * max(abs(low), abs(high), 1e-9))


def combined(channels: Mapping[str, Floats]) -> dict[str, tuple[str, ...]]:
    """Every moving channel, and differences and products of two, with the channels that each is made of."""
    single = [name for name, column in channels.items() if _strange(name) and nameable(name) and moves(column)]
    found: dict[str, tuple[str, ...]] = {quoted(name): (name,) for name in single}
    for a, b in itertools.combinations(single, 2):
        if _unit(a) == _unit(b):
            found[difference(a, b)] = (a, b)
        found[product(a, b)] = (a, b)
    return found


def _strange(name: str) -> bool:
    """Whether the model does not read it anyway."""
    return not no_curve(name) and not name.startswith((STATE_OF, HOURS))


def _unit(name: str) -> str:
    return name.partition("_")[2]
