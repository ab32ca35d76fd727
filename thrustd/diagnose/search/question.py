"""What is asked, of which model, on which data: the same for `diagnose` and `extend`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.core.aircraft import MountPlace
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.measures import usual_load
from thrustd.diagnose.compare.check import learnt_from
from thrustd.diagnose.compare.checks import OVERRULED, check_length, check_not_own_output, check_recording, far_outside
from thrustd.diagnose.compare.compare import free_runs
from thrustd.diagnose.compare.measured_force import another_unit, no_load
from thrustd.diagnose.compare.reference import BROCHURE, BROCHURE_NEEDS, check_reference, referenced
from thrustd.diagnose.search.aboard import read_beside
from thrustd.diagnose.search.base import Base, base_of, learnt, plateau, records_of
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.library import Rig, rig_of
from thrustd.diagnose.search.records import stretches
from thrustd.diagnose.search.rig import RigPriors, shipped_rig
from thrustd.identify.artifact import data_sha256
from thrustd.identify.first_state import stretch_of
from thrustd.identify.regression.record import Record
from thrustd.identify.segments import FORCE, Segment
from thrustd.model.artifact import ModelSpec
from thrustd.model.calibrated import calibrated
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of, units_trusted


@dataclass(frozen=True, slots=True)
class Given:
    """Known beside the model: priors of the rig (none: PH-LAB's), records of the bench, reference, other mounts."""

    rig: RigPriors | None = None
    bench: Sequence[Recording] = ()
    against: str = ""
    mount: MountPlace | None = None
    deck: Deck | None = None
    others: Sequence[tuple[MountPlace, ModelSpec]] = ()  # mounts of the same engine, as their benches left them
    flies: bool = False  # what is added has to fly: thermal effects by the mount's own temperature alone


NOTHING = Given()


@dataclass(frozen=True, slots=True)
class Question:
    """Records with their reference, their stretches as the regression reads them, and what is known before."""

    spec: ModelSpec
    records: list[Recording]
    segments: list[Segment]
    base: Base
    rows: list[Record]
    rig: Rig


def asked(spec: ModelSpec, recordings: Sequence[Recording], given: Given) -> Question:
    """Checked; RecordingError or ModelError in one line where the data cannot answer."""
    in_flight = given.against == BROCHURE  # where the curve and its memory stay as the bench left them
    flies = calibrated(spec, given.mount, spec.name) if given.mount is not None else spec
    check_reference(given.against)
    records = referenced(recordings, given.against, given.mount, given.deck, [flies])
    for record in records:
        check_recording(record, flies)
        if line := far_outside(record, flies):  # the grid of a curve would reach from there to here
            raise RecordingError(line)
    for record in given.bench:
        check_recording(record, spec)
    if not in_flight:
        check_length(records, spec)
    also = [*BROCHURE_NEEDS, *read_beside(records, given.others)] if in_flight else []
    segments = stretches(flies, records, also)
    if not in_flight and flies is not spec:
        segments = [_as_on_the_bench(spec, flies, segment) for segment in segments]
    output = [simulate(spec, segment) for segment in segments]
    measured = np.concatenate([segment.force_n for segment in segments])
    check_not_own_output(records[0], np.concatenate(output), measured)
    if not in_flight:
        _check_measured(spec, records, segments, output)
    bench = stretches(spec, given.bench) if given.bench else []
    priors = given.rig or shipped_rig()
    known = _known_elsewhere(spec, recordings)
    roles, ours = roles_of(records), _ours(spec, segments, priors) and roles_of(records).own
    base = replace(base_of(known, segments, bench), roles=roles, ours=ours, calibration=priors.calibration)
    if not in_flight:
        benched = learnt(known) is not None or bool(given.bench)
        base = replace(base, own_mse=np.inf if benched else 0.0)  # `of_segments` says what the model leaves
    rows = records_of(base, spec, segments)
    question = Question(spec, records, segments, base, rows, rig_of(rows, base, spec, priors))
    return question if in_flight else of_segments(question, segments)


def _check_measured(
    spec: ModelSpec, records: Sequence[Recording], segments: Sequence[Segment], output: Sequence[Floats]
) -> None:
    """A force that another unit explains, and samples that are none: no effect is asked for them."""
    roles = roles_of(records)
    for record in records:
        mine = [i for i, segment in enumerate(segments) if segment.record == record.name]
        if not mine:
            continue
        model_n = np.concatenate([output[i] for i in mine])
        measured_n = np.concatenate([segments[i].force_n for i in mine])
        time_s = np.concatenate([segments[i].time_s for i in mine])
        if line := no_load(model_n, measured_n, time_s, spec, roles):
            raise RecordingError(f"{record.name}: {line}")
        if not units_trusted(record, FORCE) and (line := another_unit(model_n, measured_n, roles)):
            raise RecordingError(f"{record.name}: {line} (convert it{OVERRULED})")


def _ours(spec: ModelSpec, segments: Sequence[Segment], priors: RigPriors) -> bool:
    force_n = np.concatenate([segment.force_n for segment in segments])
    return priors == shipped_rig() and usual_load(force_n, *spec.valid.force_n)


def of_segments(question: Question, segments: list[Segment]) -> Question:
    """The same of these segments: what the model as it is leaves of them."""
    spec, base = question.spec, question.base
    runs = [(s, free_runs(spec, s)[1]) for s in segments]
    missed = [(s.force_n - run)[stretch_of(s) :] for s, run in runs]  # behind a first stretch that shows the state
    opposes = bool(np.nanmean(np.concatenate([s.force_n * run for s, run in runs])) < 0.0)
    base = replace(base, as_is_mse=float(np.nanmean(np.concatenate(missed) ** 2)) / base.scale**2, opposes=opposes)
    if not base.benched:
        fast = plateau(missed, [segment.step_share for segment in segments]) / base.scale
        base = replace(base, own_mse=base.as_is_mse, own_plateau=fast)
    return replace(question, segments=segments, base=base, rows=records_of(base, spec, segments))


def _known_elsewhere(spec: ModelSpec, recordings: Sequence[Recording]) -> ModelSpec:
    """Without what it knows of its core where it has learnt that from these records alone.

    They would count twice, and hold a core that stands for a law that is missing where it is.
    """
    told = learnt_from(spec)
    own = bool(told) and told <= {data_sha256(record) for record in recordings}
    return msgspec.structs.replace(spec, posterior=None) if own else spec


def _as_on_the_bench(spec: ModelSpec, flies: ModelSpec, segment: Segment) -> Segment:
    """What the calibration of a mount makes of its model taken off the reference: the search is about the bench's."""
    return replace(segment, force_n=segment.force_n - simulate(flies, segment) + simulate(spec, segment))


def asked_for(effects: Sequence[Effect | str], recordings: Sequence[Recording]) -> list[Effect]:
    """Effects by name or formula; a formula may read any column of the recordings."""
    columns = recordings[0].channels if recordings else {}
    return [effect_named(effect, columns) if isinstance(effect, str) else effect for effect in effects]
