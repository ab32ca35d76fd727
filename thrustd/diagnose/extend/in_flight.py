"""Extend a model by what flights show against the brochure: effects alone, the mount's own curve stays the bench's."""

from collections.abc import Sequence

import msgspec
import numpy as np

from thrustd.core.errors import ModelError
from thrustd.core.types import Progress
from thrustd.diagnose.compare.checks import check_channels
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.extend.extend_report import ExtendReport, ledger_of
from thrustd.diagnose.extend.variants import variants
from thrustd.diagnose.search.aboard import sized, with_effects
from thrustd.diagnose.search.in_flight import (
    HELD_BACK,
    NOT_FORETOLD,
    TOLD_BY_BENCH,
    numbers_of,
    searched,
    several_flights,
)
from thrustd.diagnose.search.library import of_the_rubber, terms_in_flight
from thrustd.diagnose.search.question import Given, Question
from thrustd.diagnose.search.weigh import Flown, Weighed, flown
from thrustd.identify.artifact import data_sha256, witness_rows
from thrustd.model.artifact import ErrorMap, ModelSpec
from thrustd.model.effect import Effect


def extended_in_flight(
    spec: ModelSpec,
    question: Question,
    chosen: Sequence[Effect],
    given: Given,
    name: str,
    progress: Progress | None = None,
) -> ExtendReport:
    """The model with those of the effects that make the flights clearly likelier, and parts held back likelier."""
    for effect in chosen:
        check_channels(question.records, effect)
        if of_the_rubber(effect):
            raise ModelError(f"{spec.name}: {effect.word} {TOLD_BY_BENCH}; expected another effect, or a load cell")
    seen = flown(spec, question, given)
    terms = terms_in_flight(spec, [law for effect in chosen for law in variants(effect)], question.rig)
    found = searched(seen, terms, progress)
    before_n, after_n = found.left_n(seen)
    if found.not_foretold and not found.best.words:
        raise ModelError(f"{spec.name}: {', '.join(found.not_foretold)} {NOT_FORETOLD}; no model written")
    if not found.best.words:
        raise ModelError(
            f"{spec.name}: {', '.join(effect.word for effect in chosen)} not added: {newtons(before_n)} N against the"
            f" brochure are explained without, expected flights clearly likelier with it; no model written"
        )
    written = _written(spec, name, seen, found.best, question, before_n, after_n)
    left_out = tuple(effect.word for effect in chosen if effect.word not in found.best.words)
    numbers, remarks = numbers_of(question.base, found.best), several_flights(seen, question.base, found.best)
    return ExtendReport(
        written, found.best.words, before_n, after_n, tuple(numbers), left_out, judged=HELD_BACK, remarks=tuple(remarks)
    )


def _written(
    parent: ModelSpec, name: str, seen: Flown, best: Weighed, question: Question, before_n: float, after_n: float
) -> ModelSpec:
    records = question.records
    extended_on = [f"{record.name} {data_sha256(record)}" for record in records]
    draft = msgspec.structs.replace(
        with_effects(parent, [size for placed, size in sized(best.placed, best.numbers, best.std) if placed.here]),
        name=name,
        provenance=dict(parent.provenance) | {"extended_on": extended_on},
        ledger=[*parent.ledger, ledger_of(parent, best.words, before_n, after_n, [r.name for r in records])],
        error=_less_sure(parent.error, seen, best),
    )
    return msgspec.structs.replace(draft, witness=witness_rows(draft, 1.0 / question.segments[0].dt_s))


def _less_sure(error: ErrorMap | None, seen: Flown, best: Weighed) -> ErrorMap | None:
    """By what the sizes of the effects are not sure, on average over what was flown."""
    if error is None:
        return None
    spread_n2 = []
    for nudge in np.linalg.cholesky(best.s2 * best.covariance).T:
        moved = seen.runs(best.placed, best.numbers + nudge)
        apart = np.concatenate([one[0] - own for one, own in zip(moved, best.forces_n, strict=True)])
        spread_n2.append(float(np.mean(apart**2)))
    return msgspec.structs.replace(
        error, std_n=[[float(np.hypot(s, np.sqrt(sum(spread_n2)))) for s in row] for row in error.std_n]
    )
