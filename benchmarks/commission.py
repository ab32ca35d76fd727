"""A stranger's aircraft from bench records to a scored flight: `python -m benchmarks.commission [--aircraft N]`.

Per aircraft: bench, weight and chamber records of other mounts as `plan-test` asks for them, `commission`, zero,
tethered run, a first flight for the nacelles' drag (a recorded one, where it is at hand), and a flight. It is flown
twice: as its benches know it, and with the hostile knobs of the same seed, which nobody modelled. With `--statics` it
hangs as a rigid body, and its file says so; with `--arm` its file says where the hostile one has its accelerometer;
`--low -1500` lets the upper mounts' benches begin there. `--own`: all four mounts of the aircraft were on the bench,
not two of their kind. Every aircraft keeps its files and its `result.json` in the folder, with the version that made
them: an ended run of this version goes on there, what another one left is refused.
"""

import argparse
import json
import os
import re
import statistics
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import PH_LAB
from benchmarks.made_with import Way, keep, kept_of, way_of
from thrustd.__main__ import main as thrustd
from thrustd.bench.plan_test import LOW_N, BenchPlan, programme
from thrustd.installation.shipped import shipped
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording
from thrustd.twin.airframe import MOUNTS, draw_airframe
from thrustd.twin.bench import RIG, programme_bench
from thrustd.twin.installation import hostile
from thrustd.twin.mount import LOWER, UPPER, MountPhysics

HOURS, BENCH_HZ, FUSED_HZ = 4.0, 20.0, 50.0
MINUTES = 12.0
BENCH_SEEDS = 1000, 2000, 6000, 7000
FIRST_SEED = 101
FIRST_FLIGHT = PH_LAB / "ftis_20190312_1014.npz"  # it has idle at Mach 0.36
STAGES = ("commissioned", "tethered", "drag")[: 3 if FIRST_FLIGHT.exists() else 2]


class Asked(NamedTuple):
    """What else of an aircraft; lists, as JSON keeps them."""

    kinds: list[str]
    low_n: float  # where the bench of an upper mount begins
    own: bool  # all four mounts were on the bench, not two of their kind
    arm: bool  # the aircraft's file says where the hostile aircraft's accelerometer is


USUAL = Asked(["plain", "hostile"], LOW_N, False, False)


def said(*words: str) -> str:
    """Standard output of a verb; RuntimeError with what it complained of."""
    out, complaint = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(complaint):
        status = thrustd(list(words))
    if status == 2:
        raise RuntimeError(complaint.getvalue())
    return out.getvalue()


def processor_s() -> float:
    """Of this process and of those that it began and that have ended."""
    return sum(os.times()[:4])


def records(folder: Path, seed: int, way: Way) -> list[str]:
    """Bench files of one aircraft, as options of `commission`."""

    def record(name: str, kind: str, hours: float, number: int, mount: MountPhysics, room_degc: float = 20.0) -> str:
        plan = BenchPlan(hours=hours, seed=number, low_n=way["low_n"] if "upper" in name else LOW_N)
        asked = make_recording(name, programme(kind, plan))
        made = programme_bench(asked, number, mount, RIG._replace(room_degc=room_degc))
        path = folder / f"{name}.parquet"
        write_recording(made.resample(BENCH_HZ), path)
        return f"{name}={path}"

    kinds = dict(zip(MOUNTS, draw_airframe(seed).mounts, strict=True)) if way["own"] else dict(upper=UPPER, lower=LOWER)
    benches = [
        record(name, "steps", way["hours"], number + seed, kind)
        for number, (name, kind) in zip(BENCH_SEEDS, kinds.items(), strict=False)
    ]
    others = (
        record("weight", "weight", 1.0, 3000 + seed, UPPER),
        record("cold", "steps", 1.0, 4000 + seed, UPPER, -10.0),
        record("hot", "steps", 1.0, 5000 + seed, UPPER, 50.0),
    )
    weight, *chamber = (each.partition("=")[2] for each in others)
    return ["--bench", *benches, "--weight", weight, "--chamber", *chamber]


def based(folder: Path, seed: int, way: Way) -> Path:
    """The shipped configuration, its aircraft's file told how the engines hang and where the accelerometer is."""
    config = shipped("deploy/hil.toml", "config")
    data, bus = config.with_name("citation-ii.toml"), config.with_name("canaerospace.dbc")
    told = data.read_text()
    if way["kinds"] == ["statics"]:
        told = told.replace("rigid_body = false", "rigid_body = true")
    if way["arm"]:
        forward_m, right_m, up_m = hostile(seed).arm_m
        arm = f"[{forward_m}, {right_m}, {-up_m}]"
        told = re.sub(r"(?m)^# accelerometer_m = .*$", f"accelerometer_m = {{ left = {arm}, right = {arm} }}", told)
    (folder / data.name).write_text(told)
    (folder / bus.name).write_bytes(bus.read_bytes())
    (folder / config.name).write_text(config.read_text().replace('"../models', f'"{config.parents[1]}/models'))
    return folder / config.name


def made(folder: Path, seed: int, way: Way) -> tuple[Path, float]:
    """The commissioned configuration, and seconds of processor time that `commission` took."""
    out = folder / "aircraft"
    kept = folder / "commissioned.json"
    before = kept_of(kept, way)
    if before is None:
        given = records(folder, seed, way)
        base = based(folder, seed, way)
        began = processor_s()
        said("commission", *given, "--aircraft", str(base), "-o", str(out))
        text = (out / "hil.toml").read_text().replace("estimate_hz = 10.0", f"estimate_hz = {FUSED_HZ}")
        (out / "hil.toml").write_text(text)
        before = keep(kept, way, {"seconds": processor_s() - began})
    return out / "hil.toml", before["seconds"]


def flown(config: Path, log: Path) -> list[list[float]]:
    """Per engine: RMSE of the fused thrust, N, and truth inside the band, %."""
    scores = json.loads(said("replay", str(log), "--config", str(config), "--json"))["scores"]
    return [[scores[side]["fused"]["rmse_n"], scores[side]["fused"]["inside_95_pct"]] for side in ("left", "right")]


def scored(config: Path, seed: int, kind: str, minutes: float) -> list[list[list[float]]]:
    """Engines as commissioned; with zeros and tethered run; with the drag that a first flight tells."""
    folder = config.parent.parent
    static, flight = folder / f"{kind}-static.mcap", folder / f"{kind}.mcap"
    twin = ["--seed", str(seed), "--installation", kind, "--config", str(config)]
    said("simulate", "--tethered", *twin, "-o", str(static))
    said("simulate", "--minutes", str(minutes), *twin, "-o", str(flight))
    file, calibrated = config.parent / f"{kind}.calibration.toml", config.parent / f"{kind}.toml"
    file.unlink(missing_ok=True)
    said("zero", str(static), "-o", str(file))
    said("calibrate", "tether", str(static), "--cell", str(folder / f"{kind}-static-cell.csv"), "-o", str(file))
    calibrated.write_text(f'calibration = "{file.name}"\n{config.read_text()}')
    found = [flown(config, flight), flown(calibrated, flight)]
    if FIRST_FLIGHT.exists():
        first = folder / f"{kind}-first.mcap"
        said("simulate", "--recording", str(FIRST_FLIGHT), "--engine-start", *twin, "-o", str(first))
        said("calibrate", "drag", str(first), "-o", str(file))
        found.append(flown(calibrated, flight))
        first.unlink()
    static.unlink()
    flight.unlink()
    return found


def aircraft(folder: Path, seed: int, hours: float, minutes: float, asked: Asked = USUAL) -> dict[str, Any]:
    """What came of one aircraft, flown now or before by this version; SystemExit where another one left something."""
    kept, way = folder / "result.json", way_of(hours=hours, **asked._asdict())
    whole = way | {"minutes": minutes, "stages": list(STAGES)}
    before = kept_of(kept, whole)
    if before is not None:
        return before
    folder.mkdir(parents=True, exist_ok=True)
    config, seconds = made(folder, seed, way)
    scores = [each for kind in asked.kinds for each in scored(config, seed, kind, minutes)]
    return keep(kept, whole, {"seconds": seconds, "scores": scores})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--aircraft", type=int, default=3, metavar="N")
    parser.add_argument("--first", type=int, default=FIRST_SEED, metavar="SEED", help="number of the first one")
    parser.add_argument("--hours", type=float, default=HOURS, help="of bench per mount")
    parser.add_argument("--minutes", type=float, default=MINUTES, help="of flight")
    parser.add_argument("--folder", type=Path, default=Path("out/commission"), help="where it goes on")
    parser.add_argument("--statics", action="store_true", help="engines that hang as rigid bodies")
    parser.add_argument("--low", type=float, default=LOW_N, metavar="N", help="where benches of upper mounts begin")
    parser.add_argument("--own", action="store_true", help="all four mounts of the aircraft were on the bench")
    parser.add_argument("--arm", action="store_true", help="hostile, its file says where the accelerometer is")
    given = parser.parse_args()
    kinds = ["statics"] if given.statics else ["hostile"] if given.arm else USUAL.kinds
    asked = Asked(kinds, given.low, given.own, given.arm)
    columns = [f"{kind}, {stage}" for kind in asked.kinds for stage in STAGES]
    shown = Table(
        "aircraft", "commission, s", *columns, title="RMSE of the fused thrust, N, left and right; truth inside, %"
    )
    errors: list[list[float]] = [[] for _ in columns]
    for seed in range(given.first, given.first + given.aircraft):
        found = aircraft(given.folder / str(seed), seed, given.hours, given.minutes, asked)
        words = ["; ".join(f"{rmse:.0f}, {inside:.1f} %" for rmse, inside in each) for each in found["scores"]]
        shown.add_row(str(seed), f"{found['seconds']:.0f}", *words)
        print(seed, f"{found['seconds']:.0f} s", *words, sep=" | ", flush=True)
        for kept, each in zip(errors, found["scores"], strict=True):
            kept += [rmse for rmse, _ in each]
    Console(width=140).print(shown)
    for name, each in zip(columns, errors, strict=True):
        print(f"{name}: median {statistics.median(each):.0f} N, largest {max(each):.0f} N, {len(each)} engines")


if __name__ == "__main__":
    main()
