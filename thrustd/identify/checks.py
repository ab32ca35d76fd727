"""What is wrong with records before anything is fitted: refused where it cannot be handled, else said in a warning."""

from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.identify.segments import DEFORMATION, FORCE, SHORTEST
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of

METRE_SPAN = 0.02  # mm: a mount that moves less under kilonewtons was recorded in metres
METRE_FORCE_N = 500.0
CLIPPED_SHARE = 0.002  # of the samples at exactly the largest force
STUCK, STUCK_SHARE = 50, 0.02  # samples of one value running, and of the record, while the other transducer moves
STUCK_MOVES = 0.1  # of its span
FEWEST = 1000  # samples: less identifies a few numbers at most
RATE_SPREAD = 1.02
UNIT_RATIO = 50.0  # of spans: a record to judge that moves so much more or less was written in another unit


def check_records(records: Sequence[Recording], mount: bool = True) -> list[str]:
    """Warnings; RecordingError for what cannot be used. `mount`: mm and N, no other quantities."""
    for record in records:
        _refuse(record)
    warnings = [line for record in records for line in _warnings(record, mount)]
    rates = {record.name: record.sample_hz for record in records}
    if max(rates.values()) > RATE_SPREAD * min(rates.values()):
        each = ", ".join(f"{name} {rate:g} Hz" for name, rate in rates.items())
        warnings.append(f"records at different rates ({each}); each is used at its own")
    return warnings


def check_apart(train: Sequence[Recording], validate: Sequence[Recording]) -> list[str]:
    """Warnings about records to judge: another unit than that of the records fitted to, or the very same data."""
    lines = []
    for record in validate:
        if any(np.array_equal(record[FORCE], other[FORCE], equal_nan=True) for other in train):
            lines.append(f"{record.name}: fitted to as well; its error says nothing about other data")
        for name in (DEFORMATION, FORCE):
            span, usual = _span(record, name), max(_span(other, name) for other in train)
            if not usual / UNIT_RATIO < span < usual * UNIT_RATIO:
                lines.append(
                    f"{record.name}: {name} spans {span:.4g}, {usual:.4g} in the records fitted to: another unit? "
                    "expected the same"
                )
    return lines


def _span(record: Recording, name: str) -> float:
    return float(np.nanmax(record[name]) - np.nanmin(record[name]))


def check_values(record: Recording, name: str) -> None:
    """RecordingError where a column is there, and nothing in it."""
    if not np.isfinite(record[name]).any():
        raise RecordingError(f"{record.name}: {name} has no value at all; expected numbers")


def _refuse(record: Recording) -> None:
    for name in (DEFORMATION, FORCE):
        check_values(record, name)
    if len(record) < SHORTEST:
        raise RecordingError(f"{record.name}: {len(record)} samples; expected at least {SHORTEST}")
    for name in (DEFORMATION, FORCE):
        if _span(record, name) == 0.0:
            level = float(np.nanmean(record[name]))
            raise RecordingError(f"{record.name}: {name} is {level:g} all the time; a constant identifies nothing")


def _warnings(record: Recording, mount: bool) -> list[str]:
    lines = list(record.notes)
    deformation, force_n = record[DEFORMATION], record[FORCE]
    span_mm, span_n = np.nanmax(deformation) - np.nanmin(deformation), np.nanmax(force_n) - np.nanmin(force_n)
    if mount and span_mm < METRE_SPAN and span_n > METRE_FORCE_N:
        lines.append(f"{DEFORMATION} spans {span_mm:g} for {span_n:g} N: is it in m? expected mm")
    if mount and _falls(deformation, force_n):
        lines.append(f"{FORCE} falls while {DEFORMATION} grows: expected both to grow with forward thrust; a sign?")
    if span_n == 0.0:
        lines.append(f"{FORCE} is {np.nanmean(force_n):g} all the time")
    held = _clipped(force_n) or stuck(record)
    if held:
        lines.append(held)
    if len(record) < FEWEST:
        lines.append(f"only {len(record)} samples; a model with many parameters will follow the noise")
    return [f"{record.name}: {line}" for line in lines]


def _falls(deformation: Floats, force_n: Floats) -> bool:
    both = np.isfinite(deformation) & np.isfinite(force_n)
    moved, pushed = deformation[both], force_n[both]
    return bool(len(moved)) and float(np.mean((moved - moved.mean()) * (pushed - pushed.mean()))) < 0.0


def _clipped(force_n: Floats) -> str:
    """A load cell at its end stop repeats one value; noise never does."""
    good = force_n[np.isfinite(force_n)]
    for word, limit in (("above", good.max()), ("below", good.min())):
        share = float(np.mean(good == limit))
        runs = np.flatnonzero((good[1:] == limit) & (good[:-1] == limit))
        if share > CLIPPED_SHARE and len(runs) > 10 and np.ptp(good) > 0.0:
            return f"{FORCE} stays at {limit:g} for {100 * share:.1f} % of the samples: clipped {word}, by the sensor?"
    return ""


def stuck(record: Recording) -> str:
    """The longest run of one value of a transducer, when the other one moves to and fro meanwhile; empty without one.

    One way alone is what rubber does that is held: its force relaxes, or it creeps.
    """
    roles = roles_of([record])
    said = {DEFORMATION: roles.input, FORCE: roles.output}
    for name, other in ((FORCE, DEFORMATION), (DEFORMATION, FORCE)):
        held, moving = record[name], record[other]
        edges = np.flatnonzero(np.concatenate(([True], np.diff(held) != 0.0, [True])))
        longest = int(np.argmax(np.diff(edges)))
        part = slice(int(edges[longest]), int(edges[longest + 1]))
        count, meanwhile = part.stop - part.start, moving[part][np.isfinite(moving[part])]
        if count < max(STUCK, STUCK_SHARE * len(record)) or not len(meanwhile):
            continue
        rises, falls = meanwhile - np.minimum.accumulate(meanwhile), np.maximum.accumulate(meanwhile) - meanwhile
        if min(rises.max(), falls.max()) >= STUCK_MOVES * _span(record, other):
            since = f"{count} samples from {record.time_s[part.start]:g} s on"
            return (
                f"{said[name]} stays at {held[part.start]:g} for {since}"
                f" while {said[other]} moves: a stuck sensor, or a dead zone? leave out what is no measurement"
            )
    return ""
