"""Of what the error of a commissioned aircraft is made: `python -m benchmarks.error_budget FOLDER --aircraft N`.

FOLDER is what `benchmarks.commission` left of aircraft N. One ingredient at a time becomes what the bench, the deck or
the reader knows, everything else stays: the same aircraft is flown again, commissioned or after its own zeros and
tethered run. What falls is that ingredient's part. `--only` begins from the opposite: everything is as known, and one
ingredient is as drawn.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.commission import said
from thrustd.core.columns import Floats
from thrustd.installation.installation import read_installation
from thrustd.records.files import write_recording
from thrustd.records.recording import Recording
from thrustd.twin.aircraft import scripted
from thrustd.twin.airframe import UPPER_SHARE, Airframe, draw_airframe, mount_temperature_degc
from thrustd.twin.engine import Health
from thrustd.twin.flight import Rates, write_flight
from thrustd.twin.installation import PLAIN, Knobs, hostile
from thrustd.twin.mount import LOWER, REFERENCE_DEG_C, UPPER, MountPhysics
from thrustd.twin.sensors import Lvdt
from thrustd.twin.static_run import static_run

NOMINAL = UPPER, LOWER, UPPER, LOWER
LIKE_THE_NOMINAL = tuple(Health(0.0, 0.0, 0.0, factor) for factor in (0.97, 1.03))
Ingredient = Callable[[Airframe], Airframe]


def _mounts(airframe: Airframe, change: Callable[[MountPhysics, MountPhysics], MountPhysics]) -> Airframe:
    mounts = zip(airframe.mounts, NOMINAL, strict=True)
    return airframe._replace(mounts=tuple(change(own, nominal) for own, nominal in mounts))


def _stiffness(airframe: Airframe) -> Airframe:
    return _mounts(airframe, lambda own, n: own._replace(stiffness_n_mm=n.stiffness_n_mm, cubic_n_mm3=n.cubic_n_mm3))


def _friction(airframe: Airframe) -> Airframe:
    return _mounts(airframe, lambda own, n: own._replace(friction_n=n.friction_n))


def _weight(airframe: Airframe) -> Airframe:
    return _mounts(airframe, lambda own, n: own._replace(weight_gain_per_g=0.0))


INGREDIENTS: dict[str, Ingredient] = {
    "stiffness": _stiffness,
    "friction": _friction,
    "zeros": lambda airframe: airframe._replace(lvdts=(Lvdt(),) * len(NOMINAL)),
    "share": lambda airframe: airframe._replace(upper_share=(UPPER_SHARE, UPPER_SHARE)),
    "engines": lambda airframe: airframe._replace(healths=LIKE_THE_NOMINAL),
    "temperature": lambda airframe: airframe,  # see `_at_reference`
}


def variants(airframe: Airframe, only: bool) -> Iterator[tuple[str, Airframe, bool]]:
    """What is called what, and whether the mounts stay at the bench's temperature."""
    known = airframe
    for change in INGREDIENTS.values():
        known = change(known)
    yield ("all as known", known, True)
    yield ("as drawn", airframe, False)
    for name, change in INGREDIENTS.items():
        if not only:
            yield (f"{name} as known", change(airframe), name == "temperature")
            continue
        whole = airframe
        for other, each in INGREDIENTS.items():
            whole = whole if other == name else each(whole)
        yield (f"only {name} as drawn", whole, name != "temperature")


def _at_reference(profile: Recording, engine: str) -> Floats:
    """The mounts as warm as on their bench."""
    return np.full_like(mount_temperature_degc(profile, engine), REFERENCE_DEG_C)


def flown(config: Path, airframe: Airframe, seed: int, minutes: float, tethered: bool) -> dict[str, dict[str, float]]:
    """By engine: RMSE and mean error of the fused thrust and of the mounts alone, N."""
    installation, folder = read_installation(config), config.parent
    table, rates = installation.heard(), Rates(adc_hz=installation.config.adc.sample_hz)
    log, used = folder / "budget.mcap", config
    if tethered:
        profile, cell = static_run(seed, airframe.healths)
        write_flight(log, profile, airframe, table, installation.log_header(), seed, rates)
        write_recording(cell, folder / "budget-cell.csv")
        calibration, used = folder / "budget.calibration.toml", folder / "budget.toml"
        calibration.unlink(missing_ok=True)
        said("zero", str(log), "-o", str(calibration))
        said("calibrate", "tether", str(log), "--cell", str(folder / "budget-cell.csv"), "-o", str(calibration))
        used.write_text(f'calibration = "{calibration.name}"\n{config.read_text()}')
    profile = scripted(60.0 * minutes, seed, airframe.healths)
    write_flight(log, profile, airframe, table, installation.log_header(), seed, rates)
    scores = json.loads(said("replay", str(log), "--config", str(used), "--json"))["scores"]
    log.unlink()
    return {
        side: {
            f"{source} {what}": scores[side][source][f"{what}_n"]
            for source in ("fused", "mount")
            for what in ("rmse", "bias")
        }
        for side in ("left", "right")
    }


def knobs_of(kind: str, seed: int) -> Knobs:
    return hostile(seed) if kind == "hostile" else PLAIN._replace(statics=kind == "statics")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--aircraft", type=int, required=True)
    parser.add_argument("--kind", choices=("plain", "statics", "hostile"), default="plain")
    parser.add_argument("--minutes", type=float, default=12.0)
    parser.add_argument("--tethered", action="store_true")
    parser.add_argument("--only", action="store_true")
    parser.add_argument("--config", default="hil.toml")
    given = parser.parse_args()
    config = given.folder / str(given.aircraft) / "aircraft" / given.config
    airframe = draw_airframe(given.aircraft, knobs_of(given.kind, given.aircraft))
    for name, variant, reference in variants(airframe, given.only):
        warm: Any = patch("thrustd.twin.flight.mount_temperature_degc", _at_reference) if reference else nullcontext()
        with warm:
            found = flown(config, variant, given.aircraft, given.minutes, given.tethered)
        words = [", ".join(f"{what} {value:.1f}" for what, value in found[side].items()) for side in found]
        print(f"{name:28s}", *words, sep=" | ", flush=True)


if __name__ == "__main__":
    main()
