"""What sets of effects take away on the user's own data: the residual without any, and what each set explains of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.compare import free_runs
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.grow import joined
from thrustd.diagnose.search.joint import Joint, told
from thrustd.diagnose.search.question import Question
from thrustd.diagnose.search.ranking import Ranked
from thrustd.diagnose.search.screen import SAYS
from thrustd.identify.regression.record import Record
from thrustd.identify.segments import DEFORMATION

SETS = 2  # the best, and the best of the others


@dataclass(frozen=True, slots=True)
class Stretch:
    """One stretch of a record, (n,) each: what the model leaves, as in `compare`, and what every set takes off, N."""

    time_s: Floats
    dt_s: float
    channels: Mapping[str, Floats]
    residual_n: Floats
    explained_n: tuple[Floats, ...]  # in the order of the sets


@dataclass(frozen=True, slots=True)
class Explained:
    """Sets of effects, best first, by word and by law, what they leave on held-back blocks, N, and the stretches."""

    words: tuple[tuple[str, ...], ...]
    laws: tuple[tuple[str, ...], ...]
    rmse_n: tuple[float, ...]
    stretches: tuple[Stretch, ...]


def explained(question: Question, ranked: Ranked) -> Explained:
    """The best set and the best other one, estimated where the search had no cause to."""
    base, records, sets = question.base, question.rows, _shown(ranked)
    if len(sets) < SETS:
        sets += _another(base, records, ranked, sets)
    sets = [told(base, records, fit, sum(map(len, records))) for fit in sets]
    found = []
    for i, (record, segment) in enumerate(zip(records, question.segments, strict=True)):
        channels = {name: column[record.stood :] for name, column in record.channels.items()}
        time_s, channels[DEFORMATION] = channels["time_s"], record.d[record.stood :]
        own_n = np.interp(time_s, segment.time_s, segment.force_n - free_runs(question.spec, segment)[1])
        taken = tuple(own_n - base.scale * fit.solution.normal.residuals[i][record.stood :] for fit in sets)
        found.append(Stretch(time_s, record.dt_s, channels, own_n, taken))
    return Explained(
        tuple(fit.words for fit in sets),
        tuple(tuple(term.effect.name for term in fit.terms) for fit in sets),
        tuple(base.scale * float(fit.mse**0.5) for fit in sets),
        tuple(found),
    )


def _shown(ranked: Ranked) -> list[Joint]:
    """The best first; of the others none that only says the same with a member more or fewer."""
    shown = [ranked.best] if ranked.best.terms else []
    for fit in ranked.fits:
        if len(shown) < SETS and fit.terms and all(_other(fit, one) for one in shown):
            shown.append(fit)
    return shown


def _another(base: Base, records: Sequence[Record], ranked: Ranked, shown: Sequence[Joint]) -> list[Joint]:
    """The effect that says most at a linear look, beside those shown."""
    words = {word for fit in shown for word in fit.words}
    one = next((one for one in ranked.looked if one.term.effect.word not in words and one.removes > SAYS), None)
    return [] if one is None else [joined(base, records, ranked.nothing, one)]


def _other(fit: Joint, shown: Joint) -> bool:
    return not (set(fit.words) <= set(shown.words) or set(shown.words) <= set(fit.words))
