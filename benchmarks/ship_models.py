"""The four mount models that the daemon flies: `python -m benchmarks.ship_models [FOLDER] [--hours H]`.

Every mount gets its own campaign on the twin's bench (another seed each), from no load to full load, as it is flown.
To fit: throttle steps held for half a minute to five minutes, a multisine, and in the chamber shorter steps, cold and
hot, for the thermal effects. To measure the error on: other steps, another multisine, another temperature. Every
record begins with the mount unloaded, as it lay for hours. The bench knows neither acceleration nor weight; both
effects are added with the values of the thesis (373 kg per engine, eq. 4.5 and section 12.1.2). Both mounts of an
engine move together: each carries as much of its mass as of its thrust, in the ratio of their spring rates.
"""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.bench.programme import HIGH_N, Levels, multisine, random_steps
from thrustd.core.aircraft import DATA, read_aircraft
from thrustd.core.columns import Floats
from thrustd.core.measures import rms
from thrustd.identify.artifact import finished
from thrustd.identify.estimate import estimate
from thrustd.identify.segments import Segment, segments_of
from thrustd.identify.sensitivity import residuals, segments_for
from thrustd.identify.structures import structure_named
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.installation.shipped import shipped
from thrustd.model.artifact import EffectSpec, ModelSpec, write_model
from thrustd.model.compile import check_witness
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording
from thrustd.twin.bench import RIG, run_bench
from thrustd.twin.mount import LOWER, UPPER, MountPhysics

MOUNTS = {"left-upper": UPPER, "left-lower": LOWER, "right-upper": UPPER, "right-lower": LOWER}
STRUCTURE = "hw-pwl+prandtl-ishlinskii"  # friction keeps a branch for minutes: without it 140 N are left in flight
FITTED_HZ = 20.0  # means of the bench's 100 Hz: the load cell's noise is not the model's
CHAMBER_DEGC, OTHER_DEGC = (-10.0, 50.0), 35.0
THERMAL = {"thermal_stiffness": "stiffness_1_k", "thermal_expansion": "expansion_mm_k"}
STIFFENING_1_N = 1e-5


def throttle_bench(hours: float, seed: int, mount: MountPhysics, room_degc: float = RIG.room_degc) -> Recording:
    """Random steps from no load to full load, held and ramped as a throttle is moved in flight."""
    rng = np.random.default_rng(seed)
    command_n = random_steps(hours * 3600, RIG.sample_hz, rng, Levels(0.0, HIGH_N, (30.0, 300.0), (1.0, 8.0)))
    rig = RIG._replace(room_degc=room_degc)
    return run_bench(f"throttle_{hours:g}h_{room_degc:g}degC_seed{seed}", command_n, seed, mount, rig).resample(
        FITTED_HZ
    )


def multisine_bench(hours: float, seed: int, mount: MountPhysics) -> Recording:
    """The multisine from no load to full load, behind a ramp from the unloaded mount."""
    waves_n = multisine(hours * 3600, RIG.sample_hz, np.random.default_rng(seed), low=0.0)
    command_n = np.concatenate((_ramp_to(float(waves_n[0])), waves_n))
    return run_bench(f"multisine_{hours:g}h_seed{seed}", command_n, seed, mount).resample(FITTED_HZ)


def _ramp_to(force_n: float, still_s: float = 60.0, ramp_s: float = 5.0) -> Floats:
    time_s = np.arange(round((still_s + ramp_s) * RIG.sample_hz)) / RIG.sample_hz
    return force_n * np.clip((time_s - still_s) / ramp_s, 0.0, 1.0)


class Campaign(NamedTuple):
    fit: list[Recording]
    chamber: list[Recording]
    held_out: list[Recording]


def campaign(mount: MountPhysics, seed: int, hours: float) -> Campaign:
    return Campaign(
        [throttle_bench(hours, seed, mount), multisine_bench(hours / 4, seed + 1, mount)],
        [throttle_bench(hours / 8, seed + 4 + i, mount, degc) for i, degc in enumerate(CHAMBER_DEGC)],
        [
            throttle_bench(hours / 2, seed + 2, mount),
            multisine_bench(hours / 8, seed + 3, mount),
            throttle_bench(hours / 8, seed + 6, mount, OTHER_DEGC),
        ],
    )


def installed(name: str) -> list[EffectSpec]:
    """What acts on the mount `name` in the aircraft and on no bench."""
    path = shipped(f"deploy/{DATA}", "aircraft data")
    aircraft = read_aircraft(path.read_text(), str(path))
    share = aircraft.share(int(name.endswith("lower")))
    mine = {
        "axial_inertia": {"mass_kg": round(share * aircraft.engine_mass_kg, 1)},
        "engine_weight": {"stiffening_1_n": STIFFENING_1_N},
    }
    return [EffectSpec(effect, effect_named(effect).neutral() | values) for effect, values in mine.items()]


def ship(name: str, mount: MountPhysics, seed: int, hours: float, folder: Path) -> None:
    records = campaign(mount, seed, hours)
    core = structure_named(STRUCTURE).fit(segments_of(records.fit), BlockFits(), None).spec
    assert core is not None  # this structure is one that an artifact can hold
    thermal = [EffectSpec(effect, effect_named(effect).neutral()) for effect in THERMAL]
    warm = msgspec.structs.replace(core, name=name, structure=STRUCTURE, effects=[*core.effects, *thermal])
    which = [f"{effect}.{parameter}" for effect, parameter in THERMAL.items()]
    warm = estimate(warm, segments_for(warm, [*records.chamber, records.fit[0]]), which).spec
    options: dict[str, str | float] = {"structure": STRUCTURE, "bench": "simulated (thrustd.twin)"}
    whole = msgspec.structs.replace(warm, effects=[*warm.effects, *installed(name)])
    fit, held_out = ([at_rest(r) for r in part] for part in ([*records.fit, *records.chamber], records.held_out))
    spec = finished(whole, fit, held_out, options)
    check_witness(spec, name)
    target = folder / f"{name}.json"
    draft = target.with_suffix(".part")
    draft.write_text(write_model(spec))
    os.replace(draft, target)
    each = ", ".join(f"{r.name} {fitted_rmse(spec, segments_for(spec, [r])):.1f} N" for r in held_out)
    print(f"{target}: held out {each}", flush=True)


def fitted_rmse(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    """Free-run error from rest over all segments, N."""
    return rms(np.concatenate([residuals(spec, segment) for segment in segments]))


def at_rest(record: Recording) -> Recording:
    """The bench stands still at 1 g: say so in channels."""
    zero = record["force_N"] * 0.0
    return record.with_channels(accel_x_g=zero, accel_z_g=zero + 1.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", default="models", type=Path)
    parser.add_argument("--hours", type=float, default=8.0, help="of random steps per mount")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for i, (name, mount) in enumerate(MOUNTS.items()):
        ship(name, mount, 100 + 10 * i, given.hours, given.folder)


if __name__ == "__main__":
    main()
