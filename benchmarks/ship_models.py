"""The four mount models that the daemon flies: `python benchmarks/ship_models.py [FOLDER] [--hours H]`.

Every mount gets its own campaign on the twin's bench (another seed each), from no load to full load, as it is flown:
throttle steps held for half a minute to five minutes and a multisine to fit, other steps and another multisine to
measure the error on. The bench knows neither acceleration nor weight; both
effects are added with the values of the thesis (373 kg per engine, eq. 4.5 and section 12.1.2).
"""

import argparse
import os
from pathlib import Path

import msgspec
import numpy as np

from thrustd.identify.artifact import finished, fitted_rmse
from thrustd.identify.segments import segments_of
from thrustd.identify.sensitivity import segments_for
from thrustd.identify.structures import structure_named
from thrustd.model.artifact import EffectSpec, write_model
from thrustd.model.compile import check_witness
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording
from thrustd.twin.bench import RIG, multisine_bench, run_bench
from thrustd.twin.mount import LOWER, UPPER, MountPhysics
from thrustd.twin.programme import HIGH_N, random_steps

MOUNTS = {"left-upper": UPPER, "left-lower": LOWER, "right-upper": UPPER, "right-lower": LOWER}
STRUCTURE = "hw-pwl+prandtl-ishlinskii"  # friction keeps a branch for minutes: without it 140 N are left in flight
EFFECTS = [
    EffectSpec("axial_inertia", {"mass_kg": 186.5}),
    EffectSpec("engine_weight", {"stiffening_1_n": 1e-5}),
]


def throttle_bench(hours: float, seed: int, mount: MountPhysics) -> Recording:
    """Random steps from no load to full load, held and ramped as a throttle is moved in flight."""
    rng = np.random.default_rng(seed)
    command_n = random_steps(hours * 3600, RIG.sample_hz, rng, 0.0, HIGH_N, (30.0, 300.0), (1.0, 8.0), start=0.0)
    return run_bench(f"throttle_{hours:g}h_seed{seed}", command_n, seed, mount, RIG)


def campaign(mount: MountPhysics, seed: int, hours: float) -> tuple[list[Recording], list[Recording]]:
    """Records to fit and records to hold out."""
    fit = [throttle_bench(hours, seed, mount), multisine_bench(hours / 4, seed + 1, mount)]
    held_out = [throttle_bench(hours / 2, seed + 2, mount), multisine_bench(hours / 8, seed + 3, mount)]
    return fit, held_out


def ship(name: str, mount: MountPhysics, seed: int, hours: float, folder: Path) -> None:
    fit, held_out = campaign(mount, seed, hours)
    fitted = structure_named(STRUCTURE).fit(segments_of(fit), None).spec
    assert fitted is not None  # this structure is one that an artifact can hold
    core = msgspec.structs.replace(fitted, name=name, structure=STRUCTURE)
    options: dict[str, str | float] = {"structure": STRUCTURE, "bench": "simulated (thrustd.twin)"}
    installed = [EffectSpec(e.name, effect_named(e.name).neutral() | e.parameters) for e in EFFECTS]
    whole = [*core.effects, *installed]
    rest = [at_rest(record) for record in held_out]
    spec = finished(msgspec.structs.replace(core, effects=whole), [at_rest(r) for r in fit], rest, options)
    check_witness(spec, name)
    target = folder / f"{name}.json"
    draft = target.with_suffix(".part")
    draft.write_text(write_model(spec))
    os.replace(draft, target)
    each = ", ".join(f"{r.name} {fitted_rmse(spec, segments_for(spec, [r])):.1f} N" for r in rest)
    print(f"{target}: held out {each}")


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
