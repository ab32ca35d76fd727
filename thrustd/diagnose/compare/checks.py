"""What is refused or said before anything is computed: one clear line each (RecordingError)."""

import shlex
from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import ModelError, RecordingError
from thrustd.core.signals import CATALOGUE, STANDARD_GRAVITY_M_S2
from thrustd.diagnose.compare.first_look import ONE_LEVEL
from thrustd.diagnose.search.candidates import moves, no_explanation
from thrustd.diagnose.search.records import complete
from thrustd.identify.checks import check_values
from thrustd.identify.regression.friction import GROWS
from thrustd.identify.segments import DEFORMATION, FORCE
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording, no_column
from thrustd.records.roles import roles_in, roles_of, unit_in_name, units_trusted
from thrustd.records.units import SPELLED, UNITS

THOUSAND = (200.0, 5000.0)  # a ratio to what the model was identified on that speaks of another unit
MIRRORED = 0.8  # of the samples: a record of the other sign
SAME_N = 1e-6  # of the reference's size: a reference that is the model's own output
SHORTEST_S = 10.0  # or this many samples: a fast drive is known in seconds
SHORTEST = 1000
COUNTS = 0.01  # of the DC gain: weaker modes hold nothing that could be mistaken
SLOWEST_S = 7200.0  # slower modes are drift to any record
EVEN = 3.0  # times the logarithm of the samples: the highest line of white noise stays below
FAR, FEW = 20.0, 1e-3  # widths beyond the model's range, share of the samples: no motion but what a logger wrote
KELVIN = (200.0, 420.0)
OVERRULED = ", or --trust-units when it is so"


def check_recording(record: Recording, spec: ModelSpec) -> None:
    """Refuse channels in the wrong unit and records in which nothing happens."""
    for name in (DEFORMATION, FORCE):
        if name not in record:
            asked = "--input" if name == DEFORMATION else "--output"
            raise RecordingError(f"{no_column(record.name, name, record.channels)}; expected its name with {asked}")
        check_values(record, name)
    _check_same_units(record, spec)
    if record.duration_s < SHORTEST_S and len(record) < SHORTEST:
        raise RecordingError(f"{record.name}: {record.duration_s:.1f} s long, expected at least {SHORTEST_S:g} s")
    if not moves(record[DEFORMATION]):
        raise RecordingError(f"{record.name}: {DEFORMATION} never moves; expected a record with changing load")
    if np.nanmin(record[FORCE]) == np.nanmax(record[FORCE]):
        raise RecordingError(f"{record.name}: {FORCE} never moves; expected the force of a changing load")
    if _is_noise(record[DEFORMATION]):
        raise RecordingError(f"{record.name}: {DEFORMATION} never moves beyond its noise; expected a changing load")
    if not units_trusted(record):
        _check_sizes(record, spec)


def _check_same_units(record: Recording, spec: ModelSpec) -> None:
    """Columns whose names say another unit than those of the columns that the model was identified on."""
    for ours, theirs in zip(roles_in(spec.provenance), roles_of([record]), strict=True):
        wanted, found = (SPELLED.get(said, said) for said in map(unit_in_name, (ours, theirs)))
        if wanted != found and {wanted, found} <= UNITS:
            raise ModelError(
                f"{spec.name}: {ours} of the model is in {wanted}, {theirs} of {record.name} in {found};"
                f" expected a column in {wanted} (convert it with --rename {shlex.quote(f'{theirs}={ours}*FACTOR')})"
            )


def _check_sizes(record: Recording, spec: ModelSpec) -> None:
    """Sizes that speak of another unit than the name; the user may say that it is so all the same."""
    _check_turned(record, spec)
    if roles_of([record]).own:
        _check_mount_units(record, spec)
    else:
        _check_other_units(record, spec)
    check_channel_units(record)


def _check_turned(record: Recording, spec: ModelSpec) -> None:
    """Both signs turned: what the model knows is where the record is mirrored, and nowhere else."""
    known, roles = (spec.valid.deformation_mm, spec.valid.force_n), roles_of([record])
    for name, (low, high) in zip((DEFORMATION, FORCE), known, strict=True):
        column = record[name][np.isfinite(record[name])]
        there, mirrored = (float(np.mean((low <= each) & (each <= high))) for each in (column, -column))
        if there > 1.0 - MIRRORED or mirrored < MIRRORED:
            return
    raise RecordingError(
        f"{record.name}: {roles.input} and {roles.output} are where the model knows them with the other sign"
        f" ({roles.output} from {np.nanmin(record[FORCE]):.3g} to {np.nanmax(record[FORCE]):.3g}, {spec.name} from"
        f" {known[1][0]:.3g} to {known[1][1]:.3g}): both signs turned? (turn them with --rename{OVERRULED})"
    )


def check_channel_units(record: Recording, overruled: str = OVERRULED) -> None:
    """Specific forces and temperature by their own size, whatever the mount; `overruled`: how to say that it is so."""
    for axis, rest in (("accel_x_g", 0.0), ("accel_y_g", 0.0), ("accel_z_g", 1.0)):
        if _asks_unit(record, axis):
            _check_accel(record, axis, rest, overruled)
    if _asks_unit(record, "temperature_degC"):
        middle = _median(record["temperature_degC"])
        if KELVIN[0] < middle < KELVIN[1]:
            raise RecordingError(
                f"{record.name}: temperature_degC is about {middle:.0f}: that is kelvin, expected degC"
                f" (subtract 273.15{overruled})"
            )


def _asks_unit(record: Recording, name: str) -> bool:
    """Whether a channel is there with a size to judge, and nobody vouches for its unit."""
    return name in record and not units_trusted(record, name) and bool(np.isfinite(record[name]).any())


def _check_other_units(record: Recording, spec: ModelSpec) -> None:
    """Columns in units of their own: a factor of a thousand to what the model was identified on is another unit."""
    for name, known in ((DEFORMATION, spec.valid.deformation_mm), (FORCE, spec.valid.force_n)):
        size, usual = _size(record[name]), max(map(abs, known))
        ratio = size / usual if usual > 0 else 1.0
        if THOUSAND[0] < max(ratio, 1 / max(ratio, 1e-12)) < THOUSAND[1]:
            raise RecordingError(
                f"{record.name}: {name} reaches {size:.3g}, the model knows {usual:.3g}: another unit?"
                f" (expected the one it was identified in{OVERRULED})"
            )


def _check_mount_units(record: Recording, spec: ModelSpec) -> None:
    """Deformation and force against what the model was identified on: a factor of a thousand is another unit."""
    mm, n = _size(record[DEFORMATION]), _size(record[FORCE])
    further = mm / max(map(abs, spec.valid.deformation_mm))
    stronger = n / max(map(abs, spec.valid.force_n))
    if THOUSAND[0] < further < THOUSAND[1]:
        raise RecordingError(
            f"{record.name}: {DEFORMATION} reaches {mm:.3g}, the model knows {spec.valid.deformation_mm[1]:.3g}:"
            f" that is micrometres, expected mm (divide by 1000{OVERRULED})"
        )
    if THOUSAND[0] < 1 / max(further, 1e-12) < THOUSAND[1] and stronger > 1 / THOUSAND[0]:
        raise RecordingError(
            f"{record.name}: {DEFORMATION} reaches only {mm:.3g} under {n:.0f} N: that is metres,"
            f" expected mm (multiply by 1000{OVERRULED})"
        )
    if THOUSAND[0] < 1 / max(stronger, 1e-12) < THOUSAND[1] and further > 1 / THOUSAND[0]:
        raise RecordingError(
            f"{record.name}: {FORCE} reaches only {n:.3g} at {mm:.2g} mm: that is kN,"
            f" expected N (multiply by 1000{OVERRULED})"
        )


def _check_accel(record: Recording, axis: str, rest: float, overruled: str) -> None:
    column = record[axis]
    middle, size = _median(column), _size(column)
    if (rest == 1.0 and 6.0 < abs(middle) < 13.0) or (rest == 0.0 and size > STANDARD_GRAVITY_M_S2 / 2):
        raise RecordingError(
            f"{record.name}: {axis} is about {middle:.3g} and reaches {size:.3g}: that is m/s2, expected g"
            f" (divide by {STANDARD_GRAVITY_M_S2}{overruled})"
        )
    signal = CATALOGUE[axis]
    if size > signal.high:
        raise RecordingError(
            f"{record.name}: {axis} reaches {size:.3g}, expected {signal.low:g} to {signal.high:g} g"
            f" (mend or exclude it{overruled})"
        )


def _is_noise(column: Floats) -> bool:
    """Whether a column stays at its level and no frequency stands out, as one of any motion there does.

    A drive may be as white as noise, but it does not stay at a level.
    """
    finite = column[np.isfinite(column)]
    low, high = np.quantile(finite, [0.005, 0.995])
    if len(finite) < SHORTEST or high - low >= ONE_LEVEL * abs(float(np.median(finite))):
        return False
    power = np.abs(np.fft.rfft(finite - finite.mean())[1:]) ** 2
    return bool(power.max() < EVEN * np.log(len(finite)) * power.mean())


def check_not_own_output(record: Recording, model_n: Floats, reference_n: Floats) -> None:
    """A reference computed by the model itself proves nothing."""
    if np.nanmax(np.abs(reference_n - model_n)) <= SAME_N * max(1.0, float(np.nanmax(np.abs(reference_n)))):
        raise RecordingError(
            f"{record.name}: {FORCE} is this model's own output; expected an independent reference"
            " (load cell, brochure)"
        )


def check_length(records: Sequence[Recording], spec: ModelSpec) -> None:
    """Diagnosis needs records that outlast the slowest mode it should not mistake for an effect.

    A mode slower than the whole identification is a guess of the estimation, nobody has seen it settle.
    """
    seen = spec.provenance.get("longest_train_s")
    known_s = float(seen) if isinstance(seen, int | float) and seen > 0 else SLOWEST_S
    least = COUNTS * abs(dc_gain(spec))
    slow = [m.tau_s for m in spec.linear.real_modes if abs(m.gain) > least and m.tau_s <= min(known_s, SLOWEST_S)]
    slowest = max(slow, default=0.0)
    total = sum(record.duration_s for record in records)
    if total < slowest:
        names = ", ".join(record.name for record in records)
        raise RecordingError(
            f"{names}: {total:.0f} s long, expected at least the model's slowest time constant, {slowest:.0f} s"
        )


def dc_gain(spec: ModelSpec) -> float:
    """Of the linear block: where a step ends."""
    return spec.linear.direct + sum(m.gain for m in spec.linear.real_modes)


def check_new(spec: ModelSpec, effect: Effect, where: str) -> None:
    """An effect is added once; more of what `identify` finds by itself may be found on top."""
    for present in spec.effects:
        known = effect_named(present.name)
        if present.name in GROWS:
            continue
        if known.word == effect.word and (known.name == effect.name or known.variant_of or effect.variant_of):
            raise ModelError(f"{where}: effect '{effect.word}' is already in the model, expected one that is not")


def far_outside(record: Recording, spec: ModelSpec) -> str:
    """One line where a few samples of the input are values that no motion reaches; empty where none are."""
    known, roles = spec.valid.deformation_mm, roles_of([record])
    x, (low, high) = record[DEFORMATION], known
    reach = FAR * (high - low)
    far = (x < low - reach) | (x > high + reach)
    line = single_samples((roles.input, roles.input_unit), x, record.time_s, far, known, "no motion reaches")
    return f"{record.name}: {line}" if line else ""


def single_samples(
    said: tuple[str, str], column: Floats, time_s: Floats, far: Flags, known: tuple[float, float], why: str
) -> str:
    """The first of a few samples that are `far` (n,), one line; empty where there are none, or many.

    said: name and unit of the column; known: what the model knows of it; why: what makes them none.
    """
    found, unit = np.flatnonzero(far), f" {said[1]}".rstrip()
    if not 0 < len(found) <= FEW * len(column):
        return ""
    return (
        f"{said[0]} is {column[found[0]]:.4g}{unit} at {time_s[found[0]]:.1f} s, one of {len(found)} (of"
        f" {len(column)}) that {why}: the model knows {known[0]:.3g} to {known[1]:.3g}{unit};"
        " expected such samples empty or excluded"
    )


def check_channels(records: Sequence[Recording], effect: Effect) -> None:
    """The channels of an effect must be there, move, and be able to explain, or nothing can be estimated."""
    if why := no_explanation(effect):
        raise RecordingError(f"{records[0].name}: effect {effect.word}: {why}; expected another column")
    for record in records:
        for channel in effect.channels:
            if channel != "time_s" and channel not in record:
                raise RecordingError(
                    f"{record.name}: no column '{channel}', which effect {effect.word} reads;"
                    f" it has {', '.join(sorted(record.channels))}"
                )
            if channel != "time_s" and not complete(record[channel]):
                raise RecordingError(f"{record.name}: {channel}, which effect {effect.word} reads, has values missing")
    for channel in effect.channels:
        if channel != "time_s" and not moves(np.concatenate([record[channel] for record in records])):
            names = ", ".join(record.name for record in records)
            value = _median(records[0][channel])
            raise RecordingError(
                f"{names}: {channel} is constant ({value:.4g}): effect {effect.word} cannot be estimated"
            )


def _median(column: Floats) -> float:
    return float(np.nanmedian(column))


def _size(column: Floats) -> float:
    return float(np.nanquantile(np.abs(column), 0.999))
