"""From benches to the models of all mounts: identified, then what weight, temperature and mass do to them.

Mounts whose benches are the same records have one model. A weight or chamber record is of one mount. It goes to the
model that it fits best; what is estimated there is given to the others, which are of the same rubber. Nothing is
looked for that no record moves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import ceil

import msgspec
import numpy as np

from thrustd.commission.beside import processors
from thrustd.commission.one_mount import Answer, all_identified, identified
from thrustd.commission.pieces import Pieces
from thrustd.commission.places import check_places, misnamed
from thrustd.core.aircraft import place_of
from thrustd.core.errors import ModelError
from thrustd.core.measures import rms
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.extend.given import with_given
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.question import Given
from thrustd.diagnose.search.records import stretches
from thrustd.installation.installation import Installation
from thrustd.model.artifact import EffectSpec, ModelSpec, read_model
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording

WEIGHT, THERMAL = ("engine_weight",), ("thermal_stiffness", "thermal_expansion")
REACH_N = 100.0  # a bench is asked for in steps of this
MOMENTS = ("forward_kg_m", "right_kg_m", "down_kg_m")  # of `lever_arm`
AND = ", "
LONG = 50_000  # samples of benches: fewer are identified before a process has begun
Told = Callable[[float, str], None]  # share done, what is under way


@dataclass(slots=True)
class Made:
    """One mount's model on its way, and what to tell of it."""

    spec: ModelSpec
    train_n: float
    unseen_n: float  # on data not used
    benches: list[str]
    lines: list[str] = field(default_factory=list)
    taught_nothing: list[str] = field(default_factory=list)  # by a record that was brought
    untold: list[str] = field(default_factory=list)  # by its benches: of its loads and its place


def mount_models(pieces: Pieces, installation: Installation, told: Told) -> dict[str, Made]:
    """By mount; mounts of the same benches are one model: no record tells one of them from the other."""
    alike: dict[tuple[int, ...], list[str]] = {}
    for mount, records in pieces.bench.items():
        alike.setdefault(tuple(map(id, records)), []).append(mount)
    steps = len(alike) + len(pieces.weight[:1]) + len(pieces.chamber[:1])
    given = [(mounts[0], pieces.bench[mounts[0]]) for mounts in alike.values()]
    found = _all_identified(given, lambda done, what: told(done / steps, what))
    made = dict(zip(map(AND.join, alike.values()), found, strict=True))  # by the mounts that it is of
    untold = check_places(
        {mount: one.spec for mounts, one in made.items() for mount in mounts.split(AND)}, installation
    )
    at = len(made) / steps
    for records, effects, word in ((pieces.weight, WEIGHT, "weight"), (pieces.chamber, THERMAL, "temperature")):
        if records:
            told(at, word)
            learn(made, records, effects, word)
            at += 1 / steps
    named = misnamed({mount: [record.name for record in records] for mount, records in pieces.bench.items()})
    own = {mount: _copy(made[AND.join(mounts)], mount) for mounts in alike.values() for mount in mounts}
    for mount, one in own.items():
        _hang(one, mount, installation)
        said = [lines[mount] for lines in (untold, named) if mount in lines]
        one.untold += said
        one.lines += said
    return {mount: own[mount] for mount in pieces.bench}


def _copy(one: Made, mount: str) -> Made:
    spec = msgspec.structs.replace(one.spec, name=mount.replace("_", "-"))
    return replace(one, spec=spec, lines=list(one.lines), taught_nothing=list(one.taught_nothing), untold=[])


def _all_identified(given: Sequence[tuple[str, Sequence[Recording]]], told: Callable[[int, str], None]) -> list[Made]:
    """Long benches side by side."""
    if min(len(given), processors()) > 1 and min(sum(map(len, records)) for _, records in given) > LONG:
        words = f"identify {', '.join(mount for mount, _ in given)}"
        told(0, words)
        every = all_identified(given, lambda done: told(done, words))
        return [_made(answer, *one) for answer, one in zip(every, given, strict=True)]
    found: list[Made] = []
    for mount, records in given:
        told(len(found), f"identify {mount}")
        found.append(_identified(mount, records))
    return found


def _identified(mount: str, records: Sequence[Recording]) -> Made:
    return _made(identified(mount, records), mount, records)


def _made(answer: Answer, mount: str, records: Sequence[Recording]) -> Made:
    names, spec = [record.name for record in records], read_model(answer.model, mount)
    return Made(spec, answer.train_n, answer.unseen_n, names, list(answer.lines))


def learn(made: dict[str, Made], records: Sequence[Recording], effects: Sequence[str], word: str) -> None:
    """Estimate on the mount that the records are of, give to the others."""
    errors = {mount: _rms_n(one.spec, records) for mount, one in made.items()}
    owner = min(errors, key=lambda mount: errors[mount])
    one = made[owner]
    known = {effect.name for effect in one.spec.effects}
    try:
        report = extend(one.spec, records, effects, name=one.spec.name, given=Given(flies=True))
    except ModelError as problem:
        one.taught_nothing.append(f"{word}: {problem}")
        one.lines += one.taught_nothing[-1:]
        for mount, other in made.items():
            if mount != owner:
                other.lines.append(f"{word}: nothing added, as on {owner}")
        return
    one.spec = report.spec
    said = f"{', '.join(report.effects)}: {report.rmse_before_n:.1f} -> {report.rmse_after_n:.1f} N on held-back blocks"
    one.lines.append(f"{word}: {said} of {', '.join(record.name for record in records)}")
    asked = [
        effect for effect in report.spec.effects if effect_named(effect.name).word in effects
    ]  # friction is its own
    new = [effect for effect in asked if effect.name not in known]
    for mount, other in made.items():
        if mount != owner:
            other.spec = _given(other.spec, new)
            other.lines.append(f"{word}: as measured on {owner}")


def _given(spec: ModelSpec, effects: Sequence[EffectSpec]) -> ModelSpec:
    there = {effect.name for effect in spec.effects}
    return with_given(spec, {effect.name: effect.parameters for effect in effects if effect.name not in there})


def _rms_n(spec: ModelSpec, records: Sequence[Recording]) -> float:
    parts = [segment.force_n - simulate(spec, segment) for segment in stretches(spec, records)]
    return rms(np.concatenate(parts))


def _hang(one: Made, mount: str, installation: Installation) -> None:
    """Put in the mass that the mount carries, and where the accelerometer is, from the aircraft's file."""
    aircraft = installation.aircraft()
    place = place_of(mount, installation.config, aircraft)
    mass_kg = place.share * aircraft.engine_mass_kg
    one.spec = with_given(one.spec, {"axial_inertia": {"mass_kg": round(mass_kg, 1)}})
    if (arm_m := aircraft.accelerometer_m.get(place.engine)) is not None:
        moments = dict(zip(MOMENTS, (round(mass_kg * each, 1) for each in arm_m), strict=True))
        one.spec = with_given(one.spec, {"lever_arm": moments})
        one.lines.append(
            f"accelerometer: {', '.join(f'{each:g}' for each in arm_m)} m forward, right, down of the engine"
        )
    one.lines.append(f"mass: {mass_kg:.1f} of {aircraft.engine_mass_kg:g} kg, its share of a thrust")
    least_n = one.spec.valid.force_n[0]
    if place.couple_n < min(least_n, 0.0):
        reach = f"its benches begin at {least_n:.0f} N, the engine's weight leaves it at {place.couple_n:.0f} N"
        low_n = -REACH_N * ceil(-place.couple_n / REACH_N)
        one.untold.append(f"{reach}: taken for the same to both sides; plan-test steps --low {low_n:.0f}")
        one.lines += one.untold
