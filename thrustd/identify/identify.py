"""The verb `identify`: fit structures to records, score all of them on held-out data, make the winner an artifact."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import cast

import msgspec
import numpy as np
from rich.console import Console

from thrustd.core.blas import one_thread
from thrustd.core.columns import Flags
from thrustd.core.errors import RecordingError, ThrustdError
from thrustd.core.measures import held_out_groups
from thrustd.identify.artifact import data_sha256, finished
from thrustd.identify.checks import check_apart, check_records
from thrustd.identify.first_state import beginnings_of
from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.solve import Progress as Told
from thrustd.identify.report import Score, as_rows, as_table, errors_of, information
from thrustd.identify.segments import FORCE, Segment, segments_of
from thrustd.identify.structures import Fitted, Structure, structure_named
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.model.artifact import ModelSpec
from thrustd.records.once import check_each_once
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of

PARTS, GROUPS = 20, 5  # of every record; one group of parts is held out when no other records are given
CHANCE = 15.1  # z squared, once in 10 000
STILL = 0.1  # of the deviation of the data fitted to: what moves less tells nothing of a model
USUAL = "hw-pwl+prandtl-ishlinskii"
EXPLAINED_PCT = 97.0  # fit on validation data; with less other structures are tried, when none was named
OTHERS = ("oe-2-2", "oe-6-4", "hammerstein", "wiener", "hammerstein-wiener", "wiener-hammerstein", "feedback")
HALFWAY = 30  # steps of a search, after which half of its share is told: nobody knows how many it takes
Progress = Callable[[float], None]  # share done, 0 to 1


@dataclass(frozen=True, slots=True)
class Identified:
    """What came out. `spec` is the best structure that an artifact can hold; `usable`: better than a constant."""

    spec: ModelSpec
    scores: tuple[Score, ...]
    warnings: tuple[str, ...]
    unit: str = "N"  # of the output, empty when nobody knows it
    usable: bool = True
    records: tuple[str, ...] = ()  # how long each is, and at what rate

    def to_json(self) -> dict[str, object]:
        return {
            "model": self.spec.name,
            "structure": self.spec.structure,
            "unit": self.unit,
            "usable": self.usable,
            "structures": as_rows(self.scores),
            "records": list(self.records),
            "warnings": list(self.warnings),
        }

    def print(self, console: Console) -> None:
        console.print(as_table(self.scores, self.unit))
        for line in self.records:
            console.print(line, highlight=False)
        for line in self.warnings:
            console.print(f"warning: {line}", style="yellow")


@one_thread()
def identify(
    train: Sequence[Recording],
    validate: Sequence[Recording] = (),
    structures: Sequence[str] = (),
    settings: Asked | None = None,
    name: str = "mount",
    progress: Progress | None = None,
    others: Sequence[str] = (),
) -> Identified:
    """Fit `structures` to `train`, score on `validate` (or a fifth of `train`, then not fitted to).

    None named: HW-PWL, and where it leaves much unexplained `others` beside it. The best on data not fitted to wins.
    A mount needs no others: what HW-PWL leaves of it is an absent effect, which `diagnose` names.
    """
    check_each_once(train, validate)
    chosen = [structure_named(structure) for structure in structures or (USUAL,)]
    fitting, held_out = (list(train), list(validate)) if validate else split(train)
    warnings = check_records([*train, *validate], mount=not others) + check_apart(train, validate)
    total = len(structures) or 1 + len(others)
    fits = BlockFits(settings or Asked())

    def scored(structure: Structure, place: int) -> tuple[Fitted, Score]:
        return score_structure(structure, fitting, held_out, fits, _share(progress, place, total))

    results = [scored(structure, place) for place, structure in enumerate(chosen)]
    if not structures and not results[0][1].validation.fit_pct > EXPLAINED_PCT:
        beside = [structure_named(structure) for structure in others]
        results += [scored(structure, place) for place, structure in enumerate(beside, 1)]
        then = "others were tried" if beside else "`thrustd diagnose` looks for an absent effect, --all tries others"
        warnings.append(f"{USUAL} leaves more than {100 - EXPLAINED_PCT:g} % of the output unexplained: {then}")
    warnings += [f"{score.structure}: {fitted.note}" for fitted, score in results if fitted.note]
    fitted, best = _best(results, check_apart(train, validate))
    if not validate and fitted.again is not None:  # judged on what was held back; what flies has seen all of it
        fitted = fitted.again(_segments(structure_named(best.structure), train))
    worse = useless(best, fitting)
    warnings = [*worse, *warnings, *fitted.warnings]
    options: dict[str, str | float] = {"structure": best.structure}
    options |= {key: wish for key in ("order", "segments") if (wish := getattr(fits.wish, key))}
    spec = finished(msgspec.structs.replace(cast(ModelSpec, fitted.spec), name=name), fitting, held_out, options)
    return _identified(spec, [score for _, score in results], warnings, [*train, *validate], not worse)


def _identified(
    spec: ModelSpec, scores: Sequence[Score], warnings: Sequence[str], records: Sequence[Recording], usable: bool
) -> Identified:
    """In the words and the unit of the file."""
    roles = roles_of(records)
    said = tuple(map(roles.in_words, dict.fromkeys(warnings)))
    extents = tuple(record.extent for record in records)
    return Identified(spec, tuple(scores), said, roles.output_unit, usable, extents)


def _best(results: Sequence[tuple[Fitted, Score]], apart: Sequence[str]) -> tuple[Fitted, Score]:
    """The stable artifact with the least error on data not fitted to; RecordingError where there is none."""
    usable = [(f, s) for f, s in results if f.spec is not None and s.validation.stable]
    if not usable:
        notes = [f"{score.structure}: {fitted.note}" for fitted, score in results if fitted.note]
        why = "; ".join(("no structure gave a stable model that an artifact can hold", *notes, *apart))
        raise RecordingError(f"{results[0][1].structure}: {why}")
    return min(usable, key=lambda result: result[1].validation.rmse_n)


def useless(best: Score, fitting: Sequence[Recording]) -> list[str]:
    """A plain word when a constant would predict as well as the best model, on data that move enough to say so.

    A model that knows nothing is better by chance: of n samples it explains z^2 / n of their variance, z: N(0, 1).
    """
    new = best.validation
    explained = 1.0 - (1.0 - new.fit_pct / 100.0) ** 2 if new.fit_pct < 100.0 else 1.0
    if explained * new.samples > CHANCE:
        return []
    spread = new.rmse_n / (1 - new.fit_pct / 100)
    usual = max(float(np.nanstd(record[FORCE])) for record in fitting)
    known = f"the best of them ({best.structure}) is {new.rmse_n:.4g} wrong on data not fitted to, which only vary by "
    if spread < STILL * usual:
        return [
            f"NOT JUDGED: {known}{spread:.4g} about their mean (those fitted to by {usual:.4g}): give --validate "
            "another record, or a longer one"
        ]
    return [
        f"DO NOT USE THIS MODEL: {known}{spread:.4g} about their mean; the records fitted to show too little of what "
        "happens there"
    ]


def _share(progress: Progress | None, place: int, total: int) -> Told | None:
    """What a fit tells of its steps as a share of everything: structures before this one, steps of this one."""
    if progress is None:
        return None
    steps = 0

    def heard(iteration: int, rmse: float) -> None:
        nonlocal steps
        steps += 1
        progress((place + steps / (steps + HALFWAY)) / total)

    return heard


def split(records: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """Every record without a reference in a fifth of it, four parts of 20, and with one there only.

    The model runs through with the memory that the mount has there. Parts all over a record ask what happens between
    its first and last load; its last fifth alone often holds loads that nothing else of it showed.
    """
    held_out = held_out_groups(PARTS, GROUPS) == GROUPS // 2
    out = [held_out[np.arange(len(record)) * PARTS // len(record)] for record in records]
    pairs = list(zip(records, out, strict=True))
    return [_without(record, ~kept) for record, kept in pairs], [_without(record, kept) for record, kept in pairs]


def _without(record: Recording, kept: Flags) -> Recording:
    """Reference hidden where it is not kept; hidden is not missing: no new note, and the same record."""
    hidden = record.with_channels(**{FORCE: np.where(kept, record[FORCE], np.nan)})
    return replace(hidden, notes=record.notes, sha256=data_sha256(record))


def score_structure(
    structure: Structure,
    train: Sequence[Recording],
    validate: Sequence[Recording],
    fits: BlockFits,
    progress: Told | None = None,
) -> tuple[Fitted, Score]:
    """Fit one structure and score it."""
    segments = _segments(structure, train)
    unseen = _segments(structure, validate)
    started = perf_counter()
    fitted = _fitted(structure, segments, fits, progress)
    fit_s = perf_counter() - started
    known = beginnings_of(fitted.simulate, segments)  # what is held back of a record began where the record did
    seen, new = errors_of(fitted, segments, known), errors_of(fitted, unseen, known)
    aic, bic = information(seen, fitted.n_parameters)
    figures = (seen, new, fit_s, fitted.n_parameters, aic, bic, fitted.same_as)
    return fitted, Score(structure.name, structure.title, structure.family, *figures)


def _fitted(structure: Structure, segments: list[Segment], fits: BlockFits, progress: Told | None) -> Fitted:
    """One that cannot be fitted to these data is a line of the table and no end of the others."""
    try:
        return structure.fit(segments, fits, progress)
    except (ArithmeticError, np.linalg.LinAlgError, ThrustdError) as error:
        return Fitted(0, lambda segment: np.full(len(segment), np.nan), note=f"could not be fitted: {error}")


def _segments(structure: Structure, records: Sequence[Recording]) -> list[Segment]:
    """Channels which a structure reads and a record lacks stand at rest."""
    filled = []
    for record in records:
        missing = {name: record.time_s * 0.0 + 1.0 for name in structure.channels if name not in record}
        filled.append(record.with_channels(**missing) if missing else record)
    return segments_of(filled, structure.channels)
