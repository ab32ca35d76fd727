"""The loop in the air: effects estimated on recorded flights against the brochure, judged by truth on another.

    python -m benchmarks.loop_in_air [--case NAME] [--mount left_upper] [--aircraft 7 1 2] [--flights 0 1 01]

Engines, air data and accelerations of PH-LAB as recorded; a twin aircraft supplies the deformations, without wires:
2 Hz, the noise of its sensors in it. Nobody tells the loop what is hidden, and no truth is among its inputs. A row
takes some seconds of processor time and is kept in `out/loop_in_air`: an interrupted run of this code goes on there.
"""

import argparse
import itertools
import time
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import FLIGHTS, PH_LAB
from benchmarks.made_with import keep, kept_of, way_of
from thrustd.cli.files import read_models
from thrustd.core.aircraft import MountPlace
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.errors import ModelError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.question import Given
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import read_deck, shipped
from thrustd.model.artifact import ModelSpec
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.aircraft import as_flown
from thrustd.twin.airframe import MOUNTS, carried_n, draw_airframe, mount_temperature_degc, settled
from thrustd.twin.flight import ACCEL_SIGNALS, NOISE, body_rates_deg_s, vibration_mm_s
from thrustd.twin.installation import PLAIN, Knobs, felt_g, seen_mm
from thrustd.twin.mount import advance
from thrustd.twin.sensors import lvdt_reading

HZ, FINE_HZ = 2.0, 50.0
JUDGED = FLIGHTS[2]
ALONE = ", in this mount alone"  # else in every mount of the aircraft, and an effect is left out of every model
CASES: dict[str, tuple[Knobs, str]] = {
    "nothing hidden": (PLAIN, ""),
    "axial inertia left out": (PLAIN, "axial_inertia"),
    "stiffness +5 %": (PLAIN._replace(stiffness=0.05), ""),
    "expansion 2 um/K": (PLAIN._replace(expansion_mm_k=0.002), ""),
    "nacelle drag 0.04 m2": (PLAIN._replace(drag_m2=0.04), ""),
    "stiffness -5 %": (PLAIN._replace(stiffness=-0.05), ""),
    "expansion -1 um/K": (PLAIN._replace(expansion_mm_k=-0.001), ""),
    "nacelle drag 0.02 m2": (PLAIN._replace(drag_m2=0.02), ""),
    f"axial inertia left out{ALONE}": (PLAIN, "axial_inertia"),
    f"stiffness +5 %{ALONE}": (PLAIN._replace(stiffness=0.05), ""),
    f"expansion 2 um/K{ALONE}": (PLAIN._replace(expansion_mm_k=0.002), ""),
    f"expansion -1 um/K{ALONE}": (PLAIN._replace(expansion_mm_k=-0.001), ""),
}


@cache
def flown(file: str, seed: int, knobs: Knobs, alone: str = "") -> Recording:
    """One recorded flight with the mounts of a twin aircraft: columns of a log's names, truth in force_N_<mount>.

    `alone`: the only mount that has what the knobs say.
    """
    hidden = draw_airframe(seed, knobs)
    plain = draw_airframe(seed) if alone else hidden
    mounts = [(hidden if name == alone else plain).mounts[number] for number, name in enumerate(MOUNTS)]
    airframe = plain._replace(mounts=tuple(mounts))
    profile = as_flown(read_recording(PH_LAB / file), airframe.healths).resample(FINE_HZ)
    rng = np.random.default_rng([seed, 21])
    thrust_n = np.stack([profile["thrust_N_left"], profile["thrust_N_right"]])
    accel_g = np.stack([profile[name] for name in ACCEL_SIGNALS])
    air = zip(profile["mach"].tolist(), profile["pressure_altitude_m"].tolist(), strict=True)
    loads_n = carried_n(airframe, thrust_n, accel_g, np.array([dynamic_pressure_pa(*each) for each in air]))
    felt = felt_g(accel_g, body_rates_deg_s(profile), profile.time_s, knobs)
    columns = dict(profile.channels) | dict(zip(ACCEL_SIGNALS, felt, strict=True))
    for name in sorted(set(NOISE) & set(columns)):  # a set has another order in every process
        columns[name] = columns[name] + NOISE[name] * rng.standard_normal(len(profile))
    states = settled(airframe, loads_n[:, 0])
    for number, (name, mount, state) in enumerate(zip(MOUNTS, airframe.mounts, states, strict=True)):
        side = name.partition("_")[0]
        warm_degc = mount_temperature_degc(profile, side)
        true_mm = advance(mount, state, loads_n[number], 1 / FINE_HZ, warm_degc, profile["accel_z_g"])
        columns[f"deformation_mm_{name}"] = lvdt_reading(
            airframe.lvdts[number],
            seen_mm(number, true_mm, warm_degc, knobs if alone in ("", name) else PLAIN),
            rng,
        )
        columns[f"temperature_degC_{name}"] = warm_degc
        shaken = vibration_mm_s(profile, side)
        columns[f"vibration_mm_s_{name}"] = shaken + NOISE["vibration_mm_s"] * rng.standard_normal(len(shaken))
        share = airframe.upper_share[number // 2] + knobs.share
        columns[f"truth_N_{name}"] = thrust_n[number // 2] * (share if number % 2 == 0 else 1.0 - share)
    return make_recording(profile.name, {"time_s": profile.time_s, **columns}).resample(HZ)


def error_n(spec: ModelSpec, flight: Recording, place: MountPlace) -> float:
    """RMS of a model against the truth of one mount, N."""
    report = compare({"model": spec}, [flight], against=f"truth_N_{place.mount}", mount=place)
    return report.comparisons[0].rmse_n


def row_of(case: str, mount: str, aircraft: int, flights: str) -> list[str]:
    """What the loop says of one case from these flights, by their numbers, and what that is worth on another one."""
    knobs, left_out = CASES[case]
    installation = read_installation(shipped("deploy/hil.toml", "config"))
    place = installation.place(mount)
    alone = mount if case.endswith(ALONE) else ""
    others = [(at, other if alone else _without(other, left_out)) for at, other in installation.others_of(mount)]
    given = Given(against="brochure", mount=place, deck=read_deck(), others=others)
    (whole,) = read_models([shipped(f"models/{mount.replace('_', '-')}.json", "model")]).values()
    spec = _without(whole, left_out)
    seen, other = (
        [untold(flown(FLIGHTS[int(number)], aircraft, knobs, alone)) for number in flights],
        flown(JUDGED, aircraft, knobs, alone),
    )
    began = time.process_time()
    report = diagnose(spec, seen, given=given)
    words, after = [w for w in report.verdict if w not in ("none", "unknown")], spec
    sizes = "".join(line for line in report.advice if line.startswith("what may hide"))
    if words:
        try:
            longer = extend(spec, seen, words, given=given)
            after, sizes = longer.spec, "; ".join(p.sentence.split(" = ")[1].split(" (")[0] for p in longer.parameters)
        except ModelError as problem:
            sizes = str(problem)[:80]
    spent = time.process_time() - began
    before_n, after_n = error_n(spec, other, place), error_n(after, other, place)
    verdict = f"{'+'.join(report.verdict)} ({report.grade})"
    return [case, str(aircraft), flights, verdict, f"{before_n:.1f}, {after_n:.1f}", sizes, f"{spent:.0f}"]


def _without(spec: ModelSpec, effect: str) -> ModelSpec:
    return msgspec.structs.replace(spec, effects=[e for e in spec.effects if e.name != effect], witness=None)


def untold(known: Recording) -> Recording:
    """Without the truth."""
    hidden = {n: c for n, c in known.channels.items() if not n.startswith(("thrust_N", "truth_N", "force_N"))}
    return make_recording(known.name, {"time_s": known.time_s, **hidden})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", action="append", default=[], help="a beginning of its name; may be repeated")
    parser.add_argument("--mount", default="left_upper")
    parser.add_argument("--aircraft", type=int, nargs="+", default=[7, 1, 2], metavar="SEED")
    parser.add_argument(
        "--flights", nargs="+", default=["0", "1", "01"], choices=("0", "1", "01"), help="to estimate on"
    )
    parser.add_argument("--folder", type=Path, default=Path("out/loop_in_air"), help="where it goes on")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    way = way_of()
    shown = Table("hidden", "aircraft", "from", "verdict", "N before, after", "sizes", "s", title=given.mount)
    every = itertools.product(enumerate(CASES), given.flights, given.aircraft)
    for (number, case), flights, aircraft in every:
        if given.case and not any(case.startswith(word) for word in given.case):
            continue
        kept = given.folder / f"{aircraft}-{given.mount}-{flights}-{number}.json"
        found = kept_of(kept, way) or keep(kept, way, {"row": row_of(case, given.mount, aircraft, flights)})
        row = found["row"]
        print(*row, sep=" | ", flush=True)
        shown.add_row(*row)
    Console(width=150).print(shown)


if __name__ == "__main__":
    main()
