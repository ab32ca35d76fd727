"""Extend a model by effects: one joint fit with what it knows, kept only when held-back blocks are better.

An effect is looked for among all its variants, each from every start of its shape; of several asked for, those that the
others explain as well are left out. The core moves under its posterior: what the bench knew well stays, what it had not
seen is learnt here.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from thrustd.core.blas import one_thread
from thrustd.core.errors import ModelError
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.types import Progress
from thrustd.diagnose.compare.checks import check_channels, check_new
from thrustd.diagnose.compare.compare import free_runs
from thrustd.diagnose.compare.reference import BROCHURE
from thrustd.diagnose.extend.extend_report import ExtendReport, ledger_of
from thrustd.diagnose.extend.variants import variants
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import eased, gained, likely, simplest
from thrustd.diagnose.search.candidates import judgeable
from thrustd.diagnose.search.evidence import lateness, simulate_in_flight
from thrustd.diagnose.search.floor import before, left
from thrustd.diagnose.search.grow import joined, seen_beside
from thrustd.diagnose.search.joint import Joint, joint_fit, told
from thrustd.diagnose.search.library import Rig
from thrustd.diagnose.search.plain import by_other_laws, elsewhere, plain
from thrustd.diagnose.search.question import NOTHING, Given, asked, asked_for
from thrustd.diagnose.search.ranking import pruned
from thrustd.diagnose.search.reading import searched
from thrustd.diagnose.search.screen import TRIED, leading
from thrustd.diagnose.search.sets import look, sets_grown
from thrustd.diagnose.search.told import as_told, estimates_of, specs_of
from thrustd.identify.artifact import data_sha256, witness_rows
from thrustd.identify.error_map import error_map
from thrustd.identify.first_state import begun_at
from thrustd.identify.regression.posterior import kept, with_own_stops
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.table import FRICTION, spec_of
from thrustd.identify.regression.terms import deformed
from thrustd.identify.segments import Segment
from thrustd.model.artifact import ErrorMap, ModelSpec, ValidRange
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.model.modulated import BY
from thrustd.records.recording import Recording

MISSED = 1.1  # times what the fit leaves: a model that leaves more does not keep its promise
LEAST = 1e-3  # of the squared error: an effect asked for that removes less is not there


@one_thread()
def extend(
    spec: ModelSpec,
    recordings: Sequence[Recording],
    effects: Sequence[Effect | str],
    *,
    name: str = "",
    given: Given = NOTHING,
    progress: Progress | None = None,
) -> ExtendReport:
    """Add `effects` to a model. ModelError, and no model, when held-back blocks are not better with them."""
    chosen = asked_for(effects, recordings)
    if given.against == BROCHURE:
        from thrustd.diagnose.extend.in_flight import extended_in_flight  # it compiles what flies: seconds

        return extended_in_flight(spec, asked(spec, recordings, given), chosen, given, name or spec.name, progress)
    for effect in chosen:
        check_new(spec, effect, spec.name)
    question = asked(spec, recordings, given)
    records, segments, rows = question.records, question.segments, question.rows
    possible = _possible(chosen, records, () if given.flies else records)

    def search(known: Base, few: Sequence[Record]) -> tuple[Joint, Joint, list[Joint]]:
        nothing = joint_fit(known, few, ())
        return nothing, *_fitted(known, few, nothing, possible, question.rig, progress)

    known, few, (nothing, fit, tried), base = searched(question, search, lambda found: found[1])
    fit = plain(known, few, _that_help(known, few, pruned(known, few, nothing, fit, tried)), question.rig)
    fit, moved = elsewhere(known, few, fit, question.rig)
    same = likely(fit, moved + by_other_laws(known, few, fit, question.rig, tried))
    nothing, fit = told(base, rows, nothing), told(base, rows, fit)
    _check_better(spec, chosen, nothing, fit, base)
    _tell(progress, 0.9, "artifact")
    numbers = tuple(estimates_of(base, fit, same))
    written = _written(spec, name or spec.name, base, nothing, fit, segments, records)
    written = msgspec.structs.replace(written, effects=as_told(written.effects, numbers))
    left_out = tuple(effect.word for effect in chosen if effect.word not in fit.words)
    was, after = (base.scale * float(np.sqrt(mse)) for mse in (before(nothing, base), fit.mse))
    written, missed = _as_delivered(spec, written, base, fit, segments)
    return ExtendReport(written, fit.words, was, after, numbers, left_out, base.roles.unit, remarks=missed)


def _as_delivered(
    spec: ModelSpec, written: ModelSpec, base: Base, fit: Joint, segments: Sequence[Segment]
) -> tuple[ModelSpec, tuple[str, ...]]:
    """Where the model leaves more of these records than its fit does, as `compare` sees it, its ledger says so.

    ModelError where it leaves more than the model before.
    """
    own, before_n = (
        rms(np.concatenate([s.force_n - free_runs(one, s)[1] for s in segments])) for one in (written, spec)
    )
    fitted, unit = base.scale * float(np.sqrt(fit.solution.mean_square)), base.roles.unit
    said = f"the model leaves {own:.4g} {unit} of these records where its fit leaves {fitted:.4g} {unit}"
    entry = written.ledger[-1]
    if own > max(before_n, entry.rmse_before_n):
        raise ModelError(f"{spec.name}: {said}, and the model before {before_n:.4g} {unit}; no model written")
    if own <= MISSED * fitted:
        return written, ()
    entry = msgspec.structs.replace(entry, rmse_after_n=max(own, entry.rmse_after_n))
    return msgspec.structs.replace(written, ledger=[*written.ledger[:-1], entry]), (said,)


def _possible(
    chosen: Sequence[Effect], records: Sequence[Recording], temperatures_of: Sequence[Recording]
) -> dict[str, list[Effect]]:
    """What may be added, by word: every law that these records can judge; RecordingError where that is none."""
    found: dict[str, list[Effect]] = {}
    for effect in chosen:
        able = judgeable(variants(effect, temperatures_of), records, ())[0]
        if not able:
            check_channels(records, effect)
        laws = found.setdefault(effect.word, [])
        laws += [law for law in able or [effect] if law not in laws]
    return found


def _fitted(
    base: Base,
    rows: Sequence[Record],
    nothing: Joint,
    chosen: Mapping[str, Sequence[Effect]],
    rig: Rig,
    progress: Progress | None,
) -> tuple[Joint, list[Joint]]:
    """The set that the search would find among these effects alone; then those it left out, in their best variants.

    And every set that was estimated.
    """
    every = [law for laws in chosen.values() for law in laws]
    looks = look(base, rows, nothing, every, rig)
    most = max(2 * TRIED, 2 * sum(BY in law.name for law in every))  # the search estimates all that follow a channel
    count = len(chosen)
    best, all_tried = sets_grown(
        base, rows, looks, count, lambda size, word: _tell(progress, 0.85 * size / count, word), most
    )
    for word, laws in chosen.items():
        if word in best.words:
            continue
        own = [probe for probe in looks.probes if probe.term.effect in laws]
        seen = leading(seen_beside(base, best, own), least=-np.inf)
        tried = [joined(base, rows, best, one) for one in seen]
        all_tried += tried
        best = simplest(tried) if tried else best
    return best, all_tried


def _that_help(base: Base, rows: Sequence[Record], fit: Joint) -> Joint:
    """Without effects that may as well be nothing, where the others leave as little without them."""
    while len(fit.terms) > 1 and min(fit.sigmas) <= SIGMAS_95:
        least = fit.sigmas.index(min(fit.sigmas))
        fewer = joint_fit(base, rows, [*fit.terms[:least], *fit.terms[least + 1 :]])
        if gained(fewer, fit):
            break
        fit = fewer
    return fit


def _told(fit: Joint) -> bool:
    """Whether the 95 % interval of any new amplitude leaves out nothing.

    The search chooses among many and asks more (`Joint.shown`); here the user has chosen.
    """
    size, std = fit.solution.point.vector(fit.solution.shape)[fit.new], fit.std[fit.new]
    amplitudes = np.array([p.amplitude for term in fit.terms for p in term.free], bool)
    return bool(np.any(np.abs(size[amplitudes]) > SIGMAS_95 * std[amplitudes]))


def _check_better(spec: ModelSpec, chosen: Sequence[Effect], nothing: Joint, fit: Joint, base: Base) -> None:
    least = left(nothing, base)
    less = fit.mse <= (1.0 - LEAST) * least or eased(nothing, fit)
    if not less or not (_told(fit) or gained(nothing, fit, LEAST)):
        was, after = (base.scale * float(np.sqrt(mse)) for mse in (least, fit.mse))
        raise ModelError(
            f"{spec.name}: {', '.join(effect.word for effect in chosen)} not added:"
            f" {was:.4g} {base.roles.unit} before and {after:.4g} after on held-back blocks, expected clearly less:"
            " these data are explained best with none of it; no model written"
        )


def _written(
    parent: ModelSpec,
    name: str,
    base: Base,
    nothing: Joint,
    fit: Joint,
    segments: Sequence[Segment],
    records: Sequence[Recording],
) -> ModelSpec:
    """The fit as an artifact: tables, effects, posterior, error map, ledger, provenance and witness."""
    found = with_own_stops(fit.solution)
    drawn = [deformed(found.shape.terms, found.point.terms, record.seen).d for record in fit.records]
    core = spec_of(found, segments, name, drawn=drawn)
    effects = [*core.effects, *(effect for term, effect in specs_of(base, fit) if term.effect.name != FRICTION)]
    before_n, after_n = (base.scale * float(np.sqrt(mse)) for mse in (before(nothing, base), fit.mse))
    entry = ledger_of(parent, fit.words, before_n, after_n, [record.name for record in records])
    seen_s = parent.provenance.get("longest_train_s")
    longest_s = max(len(s) * s.dt_s for s in segments)
    longest_s = max(longest_s, float(seen_s)) if isinstance(seen_s, int | float) else longest_s
    draft = msgspec.structs.replace(
        core,
        structure=parent.structure,
        valid=_wider(parent.valid, core.valid),
        effects=effects,
        posterior=kept(found, [effect.name for effect in effects]),
        provenance=dict(parent.provenance)
        | {"extended_on": [f"{r.name} {data_sha256(r)}" for r in records], "longest_train_s": longest_s},
        ledger=[*parent.ledger, entry],
    )
    begun = [begun_at(s, r.beginning) for s, r in zip(segments, fit.records, strict=True)]
    draft = _for_flight(draft, fit, begun)
    draft = msgspec.structs.replace(draft, error=_errors(draft, fit, begun))
    return msgspec.structs.replace(draft, witness=witness_rows(draft, 1.0 / segments[0].dt_s))


def _errors(spec: ModelSpec, fit: Joint, segments: Sequence[Segment]) -> ErrorMap:
    """By region, enlarged to what blocks held back show."""
    held_back = float(np.sqrt(fit.mse / fit.solution.mean_square))
    found = error_map(lateness(spec)[0], segments)
    return msgspec.structs.replace(found, std_n=[[held_back * std for std in row] for row in found.std_n])


def _wider(one: ValidRange, other: ValidRange) -> ValidRange:
    def span(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
        return min(a[0], b[0]), max(a[1], b[1])

    rates = [r for r in (one.rate_mm_s, other.rate_mm_s) if r is not None]
    rate = (0.0, max(r[1] for r in rates)) if rates else None
    return ValidRange(span(one.deformation_mm, other.deformation_mm), span(one.force_n, other.force_n), rate)


def _for_flight(spec: ModelSpec, fit: Joint, segments: Sequence[Segment]) -> ModelSpec:
    """The best of the starts of what matters only in flight: how a late reading is extrapolated."""
    for i, present in enumerate(spec.effects):
        effect = effect_named(present.name)
        if not effect.ahead or effect.word not in fit.words:
            continue
        fixed = [p for p in effect.parameters if not p.estimate]
        trials = []
        for values in itertools.product(*(p.starts for p in fixed)):
            named = dict(zip([p.name for p in fixed], values, strict=True))
            moved = msgspec.structs.replace(present, parameters=dict(present.parameters) | named)
            trials.append(msgspec.structs.replace(spec, effects=[*spec.effects[:i], moved, *spec.effects[i + 1 :]]))
        spec = min(trials, key=lambda one: rms(_in_flight(one, segments)))
    return spec


def _in_flight(spec: ModelSpec, segments: Sequence[Segment]) -> Any:
    return np.concatenate([s.force_n - simulate_in_flight(spec, s) for s in segments])


def _tell(progress: Progress | None, share: float, what: str) -> None:
    if progress is not None:
        progress(share, what)
