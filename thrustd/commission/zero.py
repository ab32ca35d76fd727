"""The zeros of all transducers from a stretch with the engines off, each with its sigma; what is no zero is refused.

    model at rest (d0; temperature, accelerations as recorded) = 0 N of thrust share,      zero = mean reading - d0
    sigma^2 = (model^2 + friction^2 + (share m g0 0.002)^2) / k^2 + noise of the mean^2

Only what was before the first engine start counts: afterwards friction holds a part of the last load. The noise is that
of means of a second, which is where slow noise shows.
"""

from dataclasses import dataclass
from math import hypot, sqrt

import msgspec
import numpy as np
from scipy.optimize import brentq

from thrustd.commission.recalibrate import recalibrate_by
from thrustd.core.aircraft import place_of
from thrustd.core.calibration import HELD_STD_MM, LARGEST_ZERO_MM, Calibration, MountCalibration, Zero
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import RecordingError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.model.compile import CompiledModel
from thrustd.model.region_error import cells
from thrustd.mounts.start import at_rest, resting_n
from thrustd.records.recording import Recording

LEAST_S = 10.0  # of engines off
STANDS_MACH = 0.05
LEVEL_G = 0.002  # one sigma of the longitudinal acceleration
MOVES_MM = 0.002  # from the first half to the second: the mount is not at rest
SHAKES_MM = 0.005  # one sigma of a second's means: somebody works on the aircraft
KEPT = 20  # zeros in the file


@dataclass(frozen=True, slots=True)
class MountZero:
    """What one mount showed."""

    mount: str
    zero_mm: float
    std_mm: float
    before_n: float  # what the zero costs in force when it is not taken off
    refused: str = ""  # why it is none


def zeros(record: Recording, installation: Installation) -> list[MountZero]:
    """One per mount of the configuration; RecordingError where the engines are never off."""
    config = installation.config
    off_pct = section(config.fusion, FusionSettings, "fusion").engine_off_n1_pct
    still = standing(record, list(config.aircraft.engines), off_pct)
    models = installation.parts().models
    return [_zero(record.rows(still), installation, i, model) for i, model in enumerate(models)]


def standing(record: Recording, engines: list[str], off_pct: float) -> slice:
    """Rows before the first engine start, aircraft at rest; RecordingError says what is missing."""
    speeds = np.array([record[f"n1_pct_{engine}"] for engine in engines])
    off = np.all(np.nan_to_num(speeds, nan=0.0) < off_pct, axis=0) & np.isfinite(speeds).any(axis=0)
    if "mach" in record:
        off &= ~(record["mach"] > STANDS_MACH)
    known = np.flatnonzero(np.isfinite(speeds).all(axis=0))
    if not known.size or not off[known[0]]:
        raise RecordingError(f"{record.name}: begins with an engine running; expected {LEAST_S:g} s with engines off")
    first = int(known[0])
    running = np.flatnonzero(~off[first:])
    last = first + int(running[0]) if running.size else len(record)
    found_s = float(record.time_s[last - 1] - record.time_s[first])
    if found_s < LEAST_S:
        raise RecordingError(f"{record.name}: {found_s:.1f} s with engines off; expected {LEAST_S:g} s at least")
    return slice(first, last)


def _zero(record: Recording, installation: Installation, number: int, model: CompiledModel) -> MountZero:
    mount = installation.config.mount[number]
    column = record[f"deformation_mm_{mount.name}"]
    shown = column[np.isfinite(column)]
    if len(shown) < max(3, len(column) // 2):
        return MountZero(mount.name, np.nan, np.nan, np.nan, "its transducer says nothing")
    row = at_rest(model, _measured(record, model, mount.name))

    def at_rest_n(mm: float) -> float:
        return resting_n(model, row(mm))

    low, high = model.spec.valid.deformation_mm
    ends = min(low, 0.0) - 0.2 * (high - low), high
    if not at_rest_n(ends[0]) < 0.0 < at_rest_n(ends[1]):
        return MountZero(mount.name, np.nan, np.nan, np.nan, "its model never shows 0 N: was it made for this mount?")
    loose_mm = float(brentq(at_rest_n, *ends))
    k_n_mm = (at_rest_n(loose_mm + 0.01) - at_rest_n(loose_mm)) / 0.01
    place = place_of(mount.name, installation.config, installation.aircraft())
    settings = section(installation.config.fusion, FusionSettings, "fusion")
    model_n = cells(model.spec.error)[2].item(0)
    level_n = place.share * installation.aircraft().engine_mass_kg * STANDARD_GRAVITY_M_S2 * LEVEL_G
    noise_mm = _seconds_std(column, record.sample_hz)
    force_n = hypot(model_n, settings.mount_friction_std_n, level_n)
    already_mm = installation_zero(installation, mount.name)
    zero_mm = float(np.mean(shown)) - loose_mm + already_mm
    found = MountZero(
        mount.name,
        zero_mm,
        hypot(force_n / k_n_mm, noise_mm / sqrt(record.duration_s)),
        k_n_mm * (zero_mm - already_mm),
    )
    return _judged(found, shown, noise_mm, k_n_mm)


def installation_zero(installation: Installation, mount: str) -> float:
    """What is taken off its readings already."""
    calibration = installation.calibration()
    return calibration.of(mount).zero_mm if calibration is not None else 0.0


def _judged(found: MountZero, shown: Floats, noise_mm: float, k_n_mm: float) -> MountZero:
    half = len(shown) // 2
    moved_mm = float(np.mean(shown[half:]) - np.mean(shown[:half]))
    why = ""
    if abs(found.zero_mm) > LARGEST_ZERO_MM:
        why = (
            f"{found.zero_mm:+.3f} mm ({k_n_mm * found.zero_mm:+.0f} N) is no zero, at most {LARGEST_ZERO_MM} mm is: "
            "something pushes (tow bar, wind, a cover), the transducer is loose, or the model is of another mount"
        )
    elif abs(moved_mm) > MOVES_MM:
        why = f"it moved by {1e3 * moved_mm:+.1f} um meanwhile, expected rest ({1e3 * MOVES_MM:g} um)"
    elif noise_mm > SHAKES_MM:
        why = f"it shakes, {1e3 * noise_mm:.1f} um; expected at most {1e3 * SHAKES_MM:g} um with nobody on the aircraft"
    return MountZero(found.mount, found.zero_mm, found.std_mm, found.before_n, why)


def _measured(record: Recording, model: CompiledModel, mount: str) -> dict[str, float]:
    """Means of what was recorded of the model's channels."""
    means = {}
    for name in model.channels[1:]:
        column = next((record[each] for each in (f"{name}_{mount}", name) if each in record), np.array([np.nan]))
        if np.isfinite(column).any():
            means[name] = float(np.mean(column[np.isfinite(column)]))
    return means


def _seconds_std(column: Floats, sample_hz: float) -> float:
    """One sigma of means of a second, between neighbours: a slow drift does not count."""
    n = max(round(sample_hz), 1)
    means = np.nanmean(column[: len(column) // n * n].reshape(-1, n), axis=1)
    return float(np.nanstd(np.diff(means)) / sqrt(2)) if len(means) > 2 else 0.0


def with_zeros(known: Calibration | None, found: list[MountZero], on: str) -> Calibration:
    """The file with these zeros behind those it has; refused ones are left out."""
    old = known or Calibration(on=on)
    mounts = dict(old.mount)
    for each in found:
        if not each.refused:
            mount = mounts.get(each.mount, MountCalibration())
            zero = Zero(on=on, mm=round(each.zero_mm, 6), std_mm=_std(each.std_mm))
            if mount.gain_std is not None and mount.zeros:
                kept_mm, std_mm = _beside(mount.zeros[-1], each)
                zero = Zero(on=on, mm=round(kept_mm, 6), std_mm=_std(std_mm), seen_mm=zero.mm, seen_std_mm=zero.std_mm)
            looks = sorted([*(kept for kept in mount.zeros if kept.on != on), zero], key=lambda look: look.on)
            mounts[each.mount] = msgspec.structs.replace(mount, zeros=tuple(looks[-KEPT:]))
    changed = msgspec.structs.replace(old, on=max(on, old.on), mount=mounts)
    return msgspec.structs.replace(changed, recalibrate_by=recalibrate_by(changed))


def _beside(known: Zero, found: MountZero) -> tuple[float, float]:
    """What it is and its sigma: a zero found under load is hardly moved by one at rest, where friction holds more."""
    gain = known.std_mm**2 / (known.std_mm**2 + found.std_mm**2 + HELD_STD_MM**2)
    return known.mm + gain * (found.zero_mm - known.mm), sqrt(1.0 - gain) * known.std_mm


def _std(mm: float) -> float:
    return max(round(mm, 6), 1e-6)
