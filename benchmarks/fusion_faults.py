"""Every sensor fails in each of five ways on a real flight: `python -m benchmarks.fusion_faults [--only fuel]`.

A recording, from GROUND_S before it is airborne and behind a start of its engines, is flown by the twin up to FORK_S
before the fault; every row is a child process that goes on from there with one sensor damaged, so that nothing is flown
twice. Per row:

    flagged   the sensor is reported within 5 s (stuck: 30 s)
    named     the first report is of this sensor and this kind, and no other sensor is ever accused
    in band   share of fused steps from the fault on, worse engine, whose 95 % band holds the truth

Rows that were flown already are kept in out/fusion_faults.jsonl and not flown again; `--again` throws them away.
"""

import argparse
import json
import multiprocessing
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.fusion_flights import ENGINES, FLIGHTS, PH_LAB, Array, installation
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Estimate, Event, Fault
from thrustd.installation.installation import Installation
from thrustd.pipeline.pipeline import Pipeline
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.twin.airframe import MOUNTS, Airframe
from thrustd.twin.faults import KINDS, SensorFault
from thrustd.twin.flight import Truth, fly, recorded_flight, scripted_flight

RESULTS = Path("out/fusion_faults.jsonl")
FLIGHT_S, FAULT_S, WATCHED_S = 1200.0, 848.0, 90.0  # of the recording; from the engine start; from the fault on
GROUND_S = 300.0  # a log that begins in the climb finds mounts that still creep: 0.1 kN for hours
SHOWN_S = 120.0  # of a picture, before the fault
FORK_S = 25.0  # before the fault: the twin flies ahead in blocks of 10 s
AIRBORNE_MACH = 0.18
WITHIN_S = {"stuck": 30.0}
WITHIN_DEFAULT_S = 5.0
HEALTHY = "healthy"


class Size(NamedTuple):
    """How badly a sensor fails, in its own unit."""

    noise: float  # one sigma
    offset: float
    drift_s: float  # per second


SIZES = {  # an offset is worth 15 to 30 % of the cruise thrust where the sensor has a say in it
    "deformation_mm": Size(0.1, 0.2, 0.04),
    "accel_x_g": Size(0.2, 0.3, 0.3),
    "accel_z_g": Size(0.6, 0.8, 1.0),
    "n1_pct": Size(3.0, 8.0, 3.0),
    "n2_pct": Size(3.0, 8.0, 3.0),
    "fuel_flow_kg_s": Size(0.01, 0.015, 0.006),
    "mach": Size(0.02, 0.06, 0.05),
    "pressure_altitude_m": Size(30.0, 150.0, 200.0),
    "sat_degC": Size(4.0, 6.0, 2.5),
    "tat_degC": Size(4.0, 6.0, 2.5),
    "temperature_degC": Size(10.0, 20.0, 2.0),
}
COUNT = {"deformation_mm": 4, "n1_pct": 2, "n2_pct": 2, "fuel_flow_kg_s": 2, "temperature_degC": 4}  # others: one


class Row(NamedTuple):
    """One sensor, one kind. Times in seconds after the fault; NaN-free, so that it goes through JSON."""

    sensor: str
    kind: str
    flagged_s: float | None  # first report of this sensor, whatever the kind
    first: str  # the first report of any sensor
    accused: list[str]  # other sensors
    inside_pct: float  # worse engine
    worst_n: float
    band_n: float  # mean half width of the 95 % band, worse engine

    @property
    def flagged(self) -> bool:
        return self.flagged_s is not None and self.flagged_s <= WITHIN_S.get(self.kind, WITHIN_DEFAULT_S)

    @property
    def named(self) -> bool:
        return self.first == f"{self.sensor} {self.kind}" and not self.accused


def cases(scale: float = 1.0) -> list[tuple[str, SensorFault | None]]:
    """(sensor as it is reported, its fault); first of all none."""
    rows: list[tuple[str, SensorFault | None]] = [(HEALTHY, None)]
    for signal, size in SIZES.items():
        for number in range(COUNT.get(signal, 1)):
            where = MOUNTS[number] if signal == "deformation_mm" else f"{signal}[{number}]"
            for kind in KINDS:
                by_kind = {"noisy": size.noise, "offset": size.offset, "drift": 60.0 * size.drift_s}
                rows.append((where, SensorFault(signal, number, kind, FAULT_S, size=scale * by_kind.get(kind, 0.0))))
    return rows


def profile_of(name: str, seed: int) -> tuple[str, Recording, Airframe]:
    """The ground and a quarter of an hour in the air; scripted when the recording is not at hand."""
    path = PH_LAB / name
    if not path.exists():
        return "scripted", *scripted_flight(FLIGHT_S, seed)
    record = read_recording(path)
    start_s = float(record.time_s[int(np.argmax(record["mach"] > AIRBORNE_MACH))]) - GROUND_S
    return name, *recorded_flight(record.window(start_s, start_s + FLIGHT_S), seed, engine_start=True)


class Bench:
    """One flight on its way to the fault."""

    def __init__(self, place: Installation, profile: Recording, airframe: Airframe, seed: int) -> None:
        self.profile = profile
        self.pipeline: Pipeline = place.pipeline()
        self._faults: list[SensorFault] = []
        self.begin_ns = round((float(profile.time_s[0]) + FAULT_S) * 1e9)
        self._events = fly(profile, airframe, place.parts().can_table, seed, faults=self._faults)
        self.reported: list[Fault] = []  # before the fault
        self.estimates: list[Estimate] = []  # the same, the last minutes

    def approach(self) -> None:
        """Up to FORK_S before the fault."""
        for output in self.pipeline.follow(self._until(self.begin_ns - round(FORK_S * 1e9))):
            if isinstance(output, Fault):
                self.reported.append(output)
            elif isinstance(output, Estimate) and output.t_ns >= self.begin_ns - round(SHOWN_S * 1e9):
                self.estimates.append(output)

    def fail(self, fault: SensorFault | None) -> tuple[list[Estimate], list[Fault]]:
        """Go on with this fault: what the pipeline says from its beginning. Only once, in a child process."""
        if fault is not None:
            self._faults.append(fault)
        watched = self.pipeline.follow(self._until(self.begin_ns + round(WATCHED_S * 1e9)))
        outputs = [o for o in watched if isinstance(o, Estimate | Fault)]
        self.estimates += [o for o in outputs if isinstance(o, Estimate)]
        late = [o for o in outputs if o.t_ns >= self.begin_ns]
        return [o for o in late if isinstance(o, Estimate)], [o for o in late if isinstance(o, Fault)]

    def judge(self, sensor: str, fault: SensorFault | None) -> Row:
        estimates, faults = self.fail(fault)
        reports = [f for f in faults if f.kind in KINDS and f.active]
        mine = [f for f in reports if f.where == sensor]
        first = reports[0] if reports else None
        figures = [self._engine(estimates, engine) for engine in range(len(ENGINES))]
        return Row(
            sensor=sensor,
            kind=fault.kind if fault is not None else "",
            flagged_s=(mine[0].t_ns - self.begin_ns) * 1e-9 if mine else None,
            first=f"{first.where} {first.kind}" if first is not None else "",
            accused=sorted({f"{f.where} {f.kind}" for f in reports if f.where != sensor}),
            inside_pct=min(inside for inside, _, _ in figures),
            worst_n=max(worst for _, worst, _ in figures),
            band_n=max(band for _, _, band in figures),
        )

    def _engine(self, estimates: list[Estimate], engine: int) -> tuple[float, float, float]:
        """(% inside, worst error N, mean half band N)."""
        mine = [e for e in estimates if e.engine == engine]
        time_s, thrust, std = np.array([(e.t_ns * 1e-9, e.thrust_n, e.thrust_std_n) for e in mine]).T
        error: Array = np.abs(
            thrust - np.interp(time_s, self.profile.time_s, self.profile[f"thrust_N_{ENGINES[engine]}"])
        )
        return 100.0 * float(np.mean(error <= SIGMAS_95 * std)), float(error.max()), SIGMAS_95 * float(std.mean())

    def _until(self, t_ns: int) -> Iterator[Event]:
        for item in self._events:
            if not isinstance(item, Truth):
                yield item
            if item[0] >= t_ns:
                return


def in_child(work: Callable[[], Any]) -> Any:
    """What `work` returns, done in a copy of this process: the flight as it stands is not touched."""
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)
    child = context.Process(target=lambda: send.send(work()))
    child.start()
    send.close()
    try:
        return receive.recv()
    finally:
        child.join()


def kept(key: str) -> dict[tuple[str, str], Row]:
    """Rows of the same flight that were flown before."""
    if not RESULTS.exists():
        return {}
    lines = [json.loads(line) for line in RESULTS.read_text().splitlines()]
    rows = [Row(**line["row"]) for line in lines if line["key"] == key]
    return {(row.sensor, row.kind): row for row in rows}


def keep(key: str, row: Row) -> None:
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("a") as file:
        file.write(json.dumps({"key": key, "row": row._asdict()}) + "\n")


def fault_rows(name: str, seed: int, only: str, scale: float, console: Console) -> list[Row]:
    """Every case whose name has `only` in it, from the kept rows or flown now."""
    flight, profile, airframe = profile_of(name, seed)
    key = f"{flight} seed {seed} scale {scale:g}"
    wanted = [(sensor, fault) for sensor, fault in cases(scale) if only in f"{sensor} {fault.kind if fault else ''}"]
    done = kept(key)
    missing = [(s, f) for s, f in wanted if (s, f.kind if f else "") not in done]
    if missing:
        bench = Bench(installation(), profile, airframe, seed)
        bench.approach()
        early = sorted({f"{f.where} {f.kind}" for f in bench.reported})
        console.print(f"{key}: reports before the fault: {', '.join(early) or 'none'}")
    for sensor, fault in track(missing, "failing sensors", console=console, transient=True):
        row: Row = in_child(partial(bench.judge, sensor, fault))
        keep(key, row)
        done[row.sensor, row.kind] = row
    return [done[s, f.kind if f else ""] for s, f in wanted]


def picture(path: Path, name: str, seed: int, only: str, scale: float) -> None:
    """Both routes, band and truth around the first fault that is wanted."""
    from benchmarks.fusion_picture import draw  # matplotlib takes a second to import

    flight, profile, airframe = profile_of(name, seed)
    sensor, fault = next((s, f) for s, f in cases(scale) if f is not None and only in f"{s} {f.kind}")
    bench = Bench(installation(), profile, airframe, seed)
    bench.approach()
    _, faults = bench.fail(fault)
    engine = fault.number // 2 if fault.signal == "deformation_mm" else min(fault.number, 1)
    draw(path, f"{flight}, {ENGINES[engine]} engine: {sensor} {fault.kind}", bench, faults, engine)


def table(rows: list[Row]) -> Table:
    grid = Table("sensor", "kind", "flagged s", "first report", "also accused", "in band %", "worst N", "band N")
    for row in rows:
        flagged = "-" if row.flagged_s is None else f"{row.flagged_s:.1f}"
        wrong = "" if row.flagged or not row.kind else " late" if row.flagged_s is not None else " never"
        first = row.first if row.named or not row.kind else f"{row.first or 'none'} !"
        inside = f"{row.inside_pct:.1f}{'' if row.inside_pct >= 93.0 else ' !'}"
        grid.add_row(
            row.sensor, row.kind, flagged + wrong, first, ", ".join(row.accused), inside,
            f"{row.worst_n:.0f}", f"{row.band_n:.0f}",
        )  # fmt: skip
    return grid


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flight", default=FLIGHTS[0], help="a PH-LAB recording; scripted when it is not there")
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--only", default="", help="rows with this in 'sensor kind', e.g. mach")
    parser.add_argument("--scale", type=float, default=1.0, help="of noise, offset and drift")
    parser.add_argument("--again", action="store_true", help="throw the kept rows away")
    parser.add_argument("--picture", type=Path, help="PNG of the first of these faults instead of the table")
    arguments, _ = parser.parse_known_args()
    console = Console()
    if arguments.picture is not None:
        picture(arguments.picture, arguments.flight, arguments.seed, arguments.only, arguments.scale)
        return
    if arguments.again:
        RESULTS.unlink(missing_ok=True)
    rows = fault_rows(arguments.flight, arguments.seed, arguments.only, arguments.scale, console)
    console.print(table(rows))
    failed = [row for row in rows if row.kind]
    flagged, named = sum(row.flagged for row in failed), sum(row.named for row in failed)
    inside = sum(row.inside_pct >= 93.0 for row in failed)
    console.print(f"{len(failed)} faults: {flagged} flagged in time, {named} named, {inside} inside their band >= 93 %")


if __name__ == "__main__":
    main()
