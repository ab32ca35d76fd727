"""The aircraft's file in an installation: its mounts by their names, and what calibrations leave of its errors.

A lean that a flight told replaces the cant that the aircraft's file has: it is all of the lean, the cant was its prior.
So does a mass that a model has estimated: how unsure it is stands in the model's error map, which `extend` widened.
"""

from collections.abc import Sequence
from math import hypot

import msgspec

from thrustd.core.aircraft import AircraftData, Cant
from thrustd.core.calibration import Calibration
from thrustd.core.config import Config
from thrustd.core.errors import ConfigError
from thrustd.model.artifact import ModelSpec
from thrustd.model.effects.axial_inertia import EFFECT as INERTIA

WARMS_K, EXPANSION_STD_MM_K = 20.0, 4e-4  # a mount in flight against where its zero is, one sigma; where not measured


def placed(aircraft: AircraftData, config: Config, where: str) -> AircraftData:
    """With the cant of every mount by its own name; ConfigError where the file names what the configuration has not."""
    engines = config.aircraft.engines
    owners = [*engines, *(mount.name for mount in config.mount)]
    for key, names, known in (("cant", aircraft.cant, owners), ("accelerometer_m", aircraft.accelerometer_m, engines)):
        if unknown := sorted(set(names) - set(known)):
            raise ConfigError(f"{where}: {key}.{unknown[0]}: expected one of {', '.join(known)}")
    found = {mount.name: aircraft.cant_of(mount.name, mount.engine) for mount in config.mount}
    return msgspec.structs.replace(aircraft, cant={name: cant for name, cant in found.items() if cant is not None})


def check_names(calibration: Calibration, config: Config, where: str) -> None:
    """ConfigError where the file names a mount or an engine that the configuration has not."""
    mounts, engines = [mount.name for mount in config.mount], config.aircraft.engines
    for table, owners, known in (("mount", calibration.mount, mounts), ("engine", calibration.engine, engines)):
        if unknown := [owner for owner in owners if owner not in known]:
            raise ConfigError(f"{where}: {table}.{unknown[0]}: expected one of {', '.join(known)}")


def as_estimated(aircraft: AircraftData, specs: Sequence[ModelSpec]) -> AircraftData:
    """With nothing unsure of the inertia where all models have a sigma of their own for it."""
    if not all(_estimated(spec) for spec in specs):
        return aircraft
    return msgspec.structs.replace(aircraft, installation=msgspec.structs.replace(aircraft.installation, mass_kg=0.0))


def _estimated(spec: ModelSpec) -> bool:
    return any(each.std for each in spec.effects if each.name == INERTIA.name)


def as_calibrated(aircraft: AircraftData, calibration: Calibration | None) -> AircraftData:
    """Without zeros and scales that a tethered run has told; what flight at idle leaves of the drag.

    What the run leaves of zeros and gains is in the sigma of each mount (`mounts.step`), and only there. Added up in
    squares these hold what the run leaves of both together: the difference of two mounts is what it does not tell.
    What both share, the scale that somebody may doubt, is the run's for all mounts of an engine; an older file has each
    mount's alone, which has the difference in it.
    """
    if calibration is not None and calibration.drag is not None:
        left = msgspec.structs.replace(aircraft.installation, drag_m2=calibration.drag.std_m2)
        aircraft = msgspec.structs.replace(aircraft, installation=left)
    if calibration is not None:
        told = {m: Cant(deg=c.lean_deg, std_deg=c.lean_std_deg or 0.0) for m, c in calibration.mount.items() if c.leans}
        aircraft = msgspec.structs.replace(aircraft, cant=aircraft.cant | told)
    if calibration is None or calibration.tethered is None:
        return aircraft
    mounts, known = list(calibration.mount.values()), aircraft.installation
    grows_mm = [WARMS_K * (mount.expansion_std_mm_k or EXPANSION_STD_MM_K) for mount in mounts]
    before = hypot(known.zero_n, known.temperature_n), known.scale
    now = {"temperature_n": sum(aircraft.spring_n_mm) * max(grows_mm, default=1.0), "before": before}
    gain_stds = [mount.gain_std for mount in mounts if mount.gain_std is not None]
    if len(gain_stds) == len(mounts) > 0:
        shared = [engine.gain_std for engine in calibration.engine.values()] or gain_stds
        now |= {"scale": 0.0, "told_scale": min(known.scale, max(shared))}
    if mounts and all(mount.zeros for mount in mounts):
        now |= {"zero_n": 0.0}
    return msgspec.structs.replace(aircraft, installation=msgspec.structs.replace(known, **now))
