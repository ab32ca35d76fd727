"""Of what the error of a commissioned aircraft is made: `python -m benchmarks.error_budget FOLDER --aircraft N`.

FOLDER is what `benchmarks.commission` left of aircraft N. One ingredient at a time becomes what the bench, the deck or
the reader knows, everything else stays, and the same aircraft flies again: what falls is that ingredient's part. Each
mount is judged by its share of the true thrust, both of an engine by the whole, without wires, zeros and filter.
`--fused` flies through all of these instead, `--tethered` behind zeros and a tethered run of its own.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.commission import said
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.measures import rms
from thrustd.installation.installation import read_installation
from thrustd.model.compile import compile_model
from thrustd.records.files import write_recording
from thrustd.records.recording import Recording
from thrustd.twin.aircraft import scripted
from thrustd.twin.airframe import (
    UPPER_SHARE,
    Airframe,
    carried_n,
    draw_airframe,
    mount_temperature_degc,
    rigged_mm,
    settled,
    thrust_shares_n,
)
from thrustd.twin.engine import Health
from thrustd.twin.flight import ACCEL_SIGNALS, Rates, write_flight
from thrustd.twin.installation import PLAIN, Knobs, hostile, seen_mm
from thrustd.twin.mount import LOWER, REFERENCE_DEG_C, UPPER, MountPhysics, advance
from thrustd.twin.sensors import Lvdt
from thrustd.twin.static_run import static_run

SIDES = "left", "right"
HZ, PULLS_N = 20.0, 300.0
NOMINAL = UPPER, LOWER, UPPER, LOWER
LIKE_THE_NOMINAL = tuple(Health(0.0, 0.0, 0.0, factor) for factor in (0.97, 1.03))
Warmth = Callable[[Recording, str], Floats]
Ingredient = Callable[[Airframe], Airframe]


def _mounts(airframe: Airframe, change: Callable[[MountPhysics, MountPhysics], MountPhysics]) -> Airframe:
    mounts = zip(airframe.mounts, NOMINAL, strict=True)
    return airframe._replace(mounts=tuple(change(own, nominal) for own, nominal in mounts))


def _stiffness(airframe: Airframe) -> Airframe:
    return _mounts(airframe, lambda own, n: own._replace(stiffness_n_mm=n.stiffness_n_mm, cubic_n_mm3=n.cubic_n_mm3))


def _friction(airframe: Airframe) -> Airframe:
    return _mounts(airframe, lambda own, n: own._replace(friction_n=n.friction_n))


INGREDIENTS: dict[str, Ingredient] = {
    "stiffness": _stiffness,
    "friction": _friction,
    "zeros": lambda airframe: airframe._replace(lvdts=(Lvdt(),) * len(NOMINAL)),
    "share": lambda airframe: airframe._replace(upper_share=(UPPER_SHARE, UPPER_SHARE)),
    "engines": lambda airframe: airframe._replace(healths=LIKE_THE_NOMINAL),
    "temperature": lambda airframe: airframe,  # see `_at_reference`
}


def variants(airframe: Airframe) -> Iterator[tuple[str, Airframe, bool]]:
    """What is called what, and whether the mounts stay at the bench's temperature."""
    known = airframe
    for change in INGREDIENTS.values():
        known = change(known)
    yield ("as drawn", airframe, False)
    yield ("all as known", known, True)
    for name, change in INGREDIENTS.items():
        yield (f"{name} as known", change(airframe), name == "temperature")


def _at_reference(profile: Recording, engine: str) -> Floats:
    """The mounts as warm as on their bench."""
    return np.full_like(mount_temperature_degc(profile, engine), REFERENCE_DEG_C)


def alone(config: Path, airframe: Airframe, seed: int, minutes: float, warmth: Warmth) -> dict[str, dict[str, float]]:
    """By engine: RMSE and mean error of both mounts together, mean error of each, N, while it pulls."""
    installation, profile = read_installation(config), scripted(60.0 * minutes, seed, airframe.healths)
    flight = profile.resample(HZ)
    columns = {name: flight[name] for name in flight.channels} | {"time_s": flight.time_s}
    air = zip(flight["mach"].tolist(), flight["pressure_altitude_m"].tolist(), strict=True)
    columns["dynamic_pressure_Pa"] = np.array([dynamic_pressure_pa(*each) for each in air])
    thrust_n = np.stack([flight[f"thrust_N_{side}"] for side in SIDES])
    accel_g = np.stack([flight[name] for name in ACCEL_SIGNALS])
    loads_n = carried_n(airframe, thrust_n, accel_g, columns["dynamic_pressure_Pa"])
    shares_n, states, rigged = (
        thrust_shares_n(airframe, thrust_n),
        settled(airframe, loads_n[:, 0]),
        rigged_mm(airframe),
    )
    errors_n = []
    for i, mount in enumerate(installation.config.mount):
        warm_degc = warmth(flight, SIDES[i // 2])
        true_mm = advance(airframe.mounts[i], states[i], loads_n[i], 1.0 / HZ, warm_degc, accel_g[2])
        seen = {
            "deformation_mm": seen_mm(i, true_mm - rigged[i], warm_degc, airframe.knobs),
            "temperature_degC": warm_degc,
        }
        model = compile_model(installation.model(mount), HZ)
        errors_n.append(model.simulate(model.inputs(columns | seen)) - shares_n[i])
    found = {}
    for engine, side in enumerate(SIDES):
        upper, lower = (errors_n[2 * engine + i][thrust_n[engine] > PULLS_N] for i in (0, 1))
        both = upper + lower
        found[side] = {"both rmse": rms(both), "bias": both.mean(), "upper": upper.mean(), "lower": lower.mean()}
    return found


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
    parser.add_argument("--fused", action="store_true")
    parser.add_argument("--tethered", action="store_true")
    given = parser.parse_args()
    config = given.folder / str(given.aircraft) / "aircraft" / "hil.toml"
    airframe = draw_airframe(given.aircraft, knobs_of(given.kind, given.aircraft))
    for name, variant, reference in variants(airframe):
        warmth: Warmth = _at_reference if reference else mount_temperature_degc
        with patch("thrustd.twin.flight.mount_temperature_degc", warmth):
            if given.fused or given.tethered:
                found = flown(config, variant, given.aircraft, given.minutes, given.tethered)
            else:
                found = alone(config, variant, given.aircraft, given.minutes, warmth)
        words = [", ".join(f"{what} {value:.1f}" for what, value in found[side].items()) for side in found]
        print(f"{name:22s}", *words, sep=" | ", flush=True)


if __name__ == "__main__":
    main()
