"""The reference that a model is judged against, and the mount's view of a flight recording.

On a bench that is the load cell, `force_N`. In flight a mount carries `share` of its engine's thrust: `against` names
any column of force, or `brochure`, which asks a brochure deck with the recording's engine and air data.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from thrustd.brochure.deck import Deck, DeckRows
from thrustd.core.aircraft import MountPlace
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.signals import CATALOGUE
from thrustd.identify.segments import DEFORMATION, FORCE, bridged
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.records.flight_log import FLIGHT_LOG, REPLAY_FIRST
from thrustd.records.offer import advised
from thrustd.records.once import check_each_once
from thrustd.records.recording import TIME, Recording

THRUST = "thrust_N"
BROCHURE = "brochure"
# of a flight log; its truth, too
ESTIMATE = "estimate_"  # every one of a log is of a whole engine
OWN_OUTPUTS = (ESTIMATE, "mount_", "check_", "terms_", "model_N", "thrust_N", "force_N_")
BY_THE_MOUNTS = (f"{ESTIMATE}thrust_", f"{ESTIMATE}mount_", "mount_force_n_", "model_N")
BROCHURE_HZ = 5.0  # the deck is asked so often; its inputs come at 10 to 50 Hz
BROCHURE_NEEDS = ("fuel_flow_kg_s", "mach", "pressure_altitude_m", "sat_degC")
_BROCHURE_INPUTS = ("fuel_flow_kg_s", "n1_pct", "n2_pct", "mach", "pressure_altitude_m", "sat_degC")


def is_own_output(column: str) -> bool:
    """Made by thrustd, or what it is judged by: never an explanation."""
    return column.startswith(OWN_OUTPUTS)


def as_mount(record: Recording, place: MountPlace | None) -> Recording:
    """Columns of one mount and its engine under plain names: `deformation_mm_left_upper` -> `deformation_mm`."""
    if {"mach", "pressure_altitude_m"} <= set(record.channels) and "dynamic_pressure_Pa" not in record:
        air = zip(record["mach"].tolist(), record["pressure_altitude_m"].tolist(), strict=True)
        record = record.with_channels(dynamic_pressure_Pa=np.array([dynamic_pressure_pa(*each) for each in air]))
    if place is None:
        return record
    mount, plain = place.mount, dict(record.channels)
    kept = {name for name in (FORCE, THRUST) if name in record}  # a reference of the user's own is not the log's truth
    for suffix in (place.engine, mount):
        for name in CATALOGUE:
            if f"{name}_{suffix}" in record and name not in kept:
                plain[name] = record[f"{name}_{suffix}"]
    taken = [name for name in sorted(kept) if f"{name}_{mount}" in record]
    notes = tuple(f"{name}: the column of the file is kept, {name}_{mount} of the log is not used" for name in taken)
    if f"{DEFORMATION}_{mount}" not in record:
        known = sorted(n.removeprefix(DEFORMATION + "_") for n in record.channels if n.startswith(DEFORMATION + "_"))
        raw = not known and record.metadata.get("source") == FLIGHT_LOG
        has = ", ".join(known) or "none with a name" + (f"; {REPLAY_FIRST}" if raw else "")
        raise RecordingError(f"{record.name}: no mount '{mount}', it has {has}")
    return replace(record, channels=plain, notes=(*record.notes, *notes))


def check_reference(against: str) -> None:
    """RecordingError where what a model is to be judged against was estimated with it."""
    if against.startswith(BY_THE_MOUNTS):
        raise RecordingError(
            f"{against} is made with the mounts themselves and tells nothing of their models; expected another"
            f" reference (a load cell, {BROCHURE})"
        )


def referenced(
    recordings: Sequence[Recording],
    against: str,
    place: MountPlace | None,
    deck: Deck | None,
    specs: Iterable[ModelSpec],
) -> list[Recording]:
    """Every recording as one mount sees it, with its reference as `force_N`; what it lacks for `specs` at rest."""
    check_each_once(recordings)
    mounts = [as_mount(record, place) for record in recordings]
    found = [_while_read(with_reference(record, against, place, deck)) for record in mounts]
    return [r.with_channels(**{n: np.full(len(r), v) for n, v in unrecorded(r, specs).items()}) for r in found]


def _while_read(record: Recording) -> Recording:
    """Without what was recorded before the mount was first read, or while it was not: no channel is missed there."""
    there = np.isfinite(bridged(record[DEFORMATION]))
    kept = {name: column[there] for name, column in record.channels.items()}
    return record if there.all() or not there.any() else replace(record, time_s=record.time_s[there], channels=kept)


def unrecorded(record: Recording, specs: Iterable[ModelSpec]) -> dict[str, float]:
    """Channels that the models read and the recording may lack, with their value at rest.

    A bench stands still at 1 g; what flew must have recorded how, but a mount without a thermometer is taken to be
    at 20 degC, as the daemon takes it.
    """
    wanted = {name for spec in specs for stage in model_stages(spec, 1.0) for name in stage.channels}
    rest = sorted(wanted - {DEFORMATION, TIME})
    missing = [CATALOGUE[name] for name in rest if name in CATALOGUE and name not in record]
    flew = "mach" in record
    return {s.name: s.rest for s in missing if isfinite(s.rest) and (s.scope == "mount" or not flew)}


def rest_remarks(recordings: Sequence[Recording], place: MountPlace | None, specs: Iterable[ModelSpec]) -> list[str]:
    """What `referenced` takes for granted, one line each."""
    specs = list(specs)
    return [
        f"{record.name}: {name} is not recorded, {value:g} {CATALOGUE[name].unit} taken for it"
        + "".join(f"; {said}" for ours, said in advised(record.channels).items() if ours == name)
        for record in recordings
        for name, value in unrecorded(as_mount(record, place), specs).items()
    ]


def with_reference(
    record: Recording, against: str = "", place: MountPlace | None = None, deck: Deck | None = None
) -> Recording:
    """The recording with its reference as `force_N`; RecordingError in one line when there is none."""
    if against == BROCHURE:
        return record.with_channels(**{FORCE: _share(record, place) * _brochure_n(record, deck, place)})
    if against and against != FORCE:
        of_engine = "thrust" in against.lower() or against.startswith(ESTIMATE)
        return record.with_channels(**{FORCE: (_share(record, place) if of_engine else 1.0) * record[against]})
    if FORCE in record:
        return record
    if THRUST in record:
        return record.with_channels(**{FORCE: _share(record, place) * record[THRUST]})
    has = ", ".join(sorted(record.channels)) or "no column"
    raise RecordingError(
        f"{record.name}: no reference: expected {FORCE} or {THRUST} (or against brochure), it has {has}"
    )


def _share(record: Recording, place: MountPlace | None) -> float:
    if place is None:
        raise RecordingError(f"{record.name}: a mount carries a part of its engine's thrust: expected --mount")
    return place.share


def _brochure_n(record: Recording, deck: Deck | None, place: MountPlace | None) -> Floats:
    if deck is None:
        raise RecordingError(f"{record.name}: against brochure: expected a brochure deck, none is given")
    _require(record, BROCHURE_NEEDS)
    return deck_says(record.channels, record.time_s, deck, place.number if place else 0).thrust_n


def deck_says(channels: Mapping[str, Floats], time_s: Floats, deck: Deck, engine: int) -> DeckRows:
    """At these times, each (n,): lines between what it says `BROCHURE_HZ` times a second."""
    rows = np.arange(0, len(time_s), max(1, round((len(time_s) - 1) / (time_s[-1] - time_s[0]) / BROCHURE_HZ)))
    given = [channels[name][rows] if name in channels else np.full(len(rows), np.nan) for name in _BROCHURE_INPUTS]
    rate = np.gradient(given[1], time_s[rows]) if len(rows) > 1 else np.zeros(len(rows))
    said = deck.along(np.column_stack((*given, rate)), engine)
    return DeckRows(*(np.interp(time_s, time_s[rows], column) for column in said))


def _require(record: Recording, names: Sequence[str]) -> None:
    missing = [name for name in names if name not in record or not np.isfinite(record[name]).any()]
    if missing:
        raise RecordingError(f"{record.name}: against brochure needs {', '.join(missing)}, which is not in the data")
