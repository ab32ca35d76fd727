"""Is it ever confidently wrong? `python -m benchmarks.integrity [--short] [--only "both step"]`, `make integrity`.

Twin aircraft fly recordings behind an engine start. At every moment of a flight each fault that begins there is
written into what the sensors sent, and a copy of the flying pipeline goes on with it. A row for each fault; of each
case and engine, from the fault on, at 10 Hz:

    true, said mean thrust and mean estimate, N, where it was worst: longest silent, then furthest off
    silent     longest stretch of estimates more than three of their sigmas off while no fault bit says so, s
    in band    least share of estimates whose 95 % band holds the truth, or that are told
    named      when a report names who is at fault, the last of the aircraft, s
    told       when the status of the engine first says so
    pause      longest time between two estimates of one engine, s
    after      largest error in the last AFTER_S, in sigmas; `!` where a wire is whole again and its bit still shows

A case fails when it is silent for longer than SILENT_S. Cases are kept in out/integrity.jsonl by the version of the
program, or as `--key NAME`, and those that are there are not flown again.
"""

import argparse
import multiprocessing as mp
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks import healthy_hours
from benchmarks.fusion_flights import ENGINES, EVERY, FLIGHTS, installation, outputs_of
from benchmarks.integrity_cases import AIRCRAFT, CASES, HEALTHY, Case
from benchmarks.integrity_flight import Flight, S, damaged, flight, whole
from benchmarks.integrity_wires import WIRES
from benchmarks.kept import Kept
from benchmarks.made_with import way_of
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.types import Estimate, Fault, Status
from thrustd.installation.installation import Installation
from thrustd.pipeline.pipeline import Pipeline

RESULTS = Path("out/integrity.jsonl")
FLOWN = ((0, 11), (1, 612), (2, 713))  # recording and twin aircraft
SECONDS = 1500.0  # of a recording
SILENT_S, SIGMAS = 5.0, 3.0
AFTER_S = 3.0
WIDTH = 150  # characters of the page
TOLD = int(
    Status.MOUNT_LOST | Status.MOUNT_FAILED | Status.BROCHURE_LOST | Status.BROCHURE_FAILED | Status.MOUNTS_DISAGREE
    | Status.SENSOR_EXCLUDED | Status.DISAGREE | Status.STUCK | Status.CHANNEL_OPEN | Status.WIRE_FAULT
    | Status.CONVERGING
)  # fmt: skip


class Row(NamedTuple):
    """One case with one aircraft; both engines, the worse of them."""

    aircraft: str
    fault: str
    moment: str
    true_n: float  # mean
    bias_n: float
    rms_n: float
    silent_pct: float
    longest_s: float
    in_band_pct: float  # or flagged
    std_n: float
    named_s: float | None
    told_s: float | None
    first: str  # first report
    wrongly_excluded: list[str]
    pause_s: float
    after_sigmas: float
    over: bool  # the status bits that are asked for are off at the end


def longest_s(bad: Any, time_s: Any) -> float:
    longest = since = 0.0
    for i in range(1, len(bad)):
        since = since + time_s[i] - time_s[i - 1] if bad[i] else 0.0
        longest = max(longest, since)
    return longest


def judge(flown: Flight, case: Case, begin_ns: int, estimates: Sequence[list[Estimate]], faults: list[Fault]) -> Row:
    figures, told_s, asked, over = [], inf, case.bits or TOLD, True
    for side, mine in zip(ENGINES, estimates, strict=True):
        rows = [(e.t_ns * 1e-9, e.thrust_n, e.thrust_std_n, e.status & TOLD, e.status & asked) for e in mine]
        time_s, thrust_n, std_n, told, shown = np.array(rows).T
        error_n = thrust_n - np.interp(time_s, flown.profile.time_s, flown.profile[f"thrust_N_{side}"])
        told = told != 0
        silent = (np.abs(error_n) > SIGMAS * std_n) & ~told
        figures.append((
            float(error_n.mean()), float((thrust_n - error_n).mean()), rms(error_n), 100.0 * float(silent.mean()),
            longest_s(silent, time_s), 100.0 * float(np.mean((np.abs(error_n) <= SIGMAS_95 * std_n) | told)),
            float(std_n.mean()), float(np.diff(time_s, prepend=begin_ns * 1e-9).max()),
            float(np.max((np.abs(error_n) / std_n)[time_s > time_s[-1] - AFTER_S])),
        ))  # fmt: skip
        if shown.any():
            told_s = min(told_s, time_s[int(np.argmax(shown > 0))] - begin_ns * 1e-9)
        over = over and not (case.bits and shown[-1])
    reports = [fault for fault in faults if fault.active and fault.kind != "zero"]
    theirs = [fault for fault in reports if fault.where in case.who or fault.kind in case.kinds]
    bias_n, true_n = max(((figure[0], figure[1]) for figure in figures), key=lambda each: abs(each[0]))
    _, _, size, silent_pct, longest, in_band, std, pause_s, after = zip(*figures, strict=True)
    return Row(
        flown.name, case.fault, case.moment, true_n, bias_n, max(size), max(silent_pct), max(longest), min(in_band),
        max(std), (theirs[0].t_ns - begin_ns) * 1e-9 if theirs else None, None if told_s == inf else told_s,
        f"{reports[0].where} {reports[0].kind}" if reports else "",
        sorted({f"{f.where} {f.kind}" for f in reports if f not in theirs}), max(pause_s), max(after), over,
    )  # fmt: skip


def run_case(flown: Flight, case: Case, pipeline: Pipeline, first: int) -> Row:
    begin_ns = int(flown.wire.t_ns[first])
    last = int(np.searchsorted(flown.wire.t_ns, begin_ns + min(case.seconds, 1e6) * S))
    every = EVERY if case.edit.stream is None else 1  # pauses are looked at
    estimates, faults = outputs_of(pipeline, damaged(flown, case.edit, first, last), every=every)
    return judge(flown, case, begin_ns, estimates, faults)


class Children:
    """At most so many forked copies of this process at once."""

    def __init__(self, most: int, said: Any) -> None:
        self._most, self._said, self._busy = most, said, list[tuple[Any, Any]]()

    def start(self, flown: Flight, case: Case, pipeline: Pipeline, first: int) -> None:
        while len(self._busy) >= self._most:
            self._reap()
        receive, send = mp.get_context("fork").Pipe(duplex=False)
        child = mp.get_context("fork").Process(target=lambda: send.send(run_case(flown, case, pipeline, first)))
        child.start()
        send.close()
        self._busy.append((child, receive))

    def _reap(self) -> None:
        ready = mp.connection.wait([receive for _, receive in self._busy])
        for child, receive in [pair for pair in self._busy if pair[1] in ready]:
            self._busy.remove((child, receive))
            self._said(receive.recv())
            child.join()

    def drain(self) -> None:
        while self._busy:
            self._reap()


def campaign(place: Installation, flown: Flight, cases: Iterable[Case], jobs: int, said: Callable[[Row], None]) -> None:
    """All cases with one aircraft, each with a copy of the pipeline that has flown up to its moment."""
    children, pipeline, at = Children(jobs, said), place.pipeline(), 0
    for moment, moment_s in sorted(flown.moments_s.items(), key=lambda item: item[1]):
        mine = [case for case in cases if case.moment == moment]
        if not mine:
            continue
        first = int(np.searchsorted(flown.wire.t_ns, round(moment_s * S)))
        outputs_of(pipeline, whole(flown, at, first), every=EVERY)
        at = first
        for case in mine:
            children.start(flown, case, pipeline, first)
        children.drain()


def table(rows: list[Row]) -> Table:
    """A row for each fault; figures of the worst of its flights, and which one that was."""
    figures = "true N", "said N", "sigma N", "silent s", "in band %", "named s", "told s", "pause s", "after"
    grid = Table("fault", "flown", "worst", *figures, box=None, padding=(0, 1, 0, 0))
    by_fault: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_fault[row.fault].append(row)
    for fault, mine in by_fault.items():
        worst = max(mine, key=lambda row: (row.longest_s, abs(row.bias_n)))
        bad = worst.longest_s > SILENT_S
        grid.add_row(
            f"[red]{fault} ![/red]" if bad else fault, f"{len(mine)}", worst.moment, f"{worst.true_n:.0f}",
            f"{worst.true_n + worst.bias_n:.0f}", f"{worst.std_n:.0f}", f"{worst.longest_s:.1f}",
            f"{min(r.in_band_pct for r in mine):.1f}", _last([row.named_s for row in mine]),
            _last([row.told_s for row in mine]), f"{max(r.pause_s for r in mine):.2f}",
            f"{max(r.after_sigmas for r in mine):.1f}{'' if all(r.over for r in mine) else ' !'}",
        )  # fmt: skip
    return grid


def kept(key: str, cases: tuple[Case, ...]) -> list[Row]:
    """What was flown of these cases under this name; one of before is not what a row is now."""
    wanted = {(case.fault, case.moment) for case in cases}
    found = [row for row in Kept(RESULTS, key).rows() if {*Row._fields} <= {*row}]
    rows = [Row(**{name: row[name] for name in Row._fields}) for row in found]
    return [row for row in rows if (row.fault, row.moment) in wanted]


def _last(times_s: list[float | None]) -> str:
    known = [t for t in times_s if t is not None]
    part = "" if len(known) == len(times_s) else f" ({len(known)}/{len(times_s)})"
    return f"{max(known):.1f}{part}" if known else "never"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--short", action="store_true", help="one aircraft, a few cases")
    parser.add_argument("--only", default="", help="cases with this in 'fault, moment'")
    parser.add_argument("--wires", action="store_true", help="the faults of wires, bus and machine alone")
    parser.add_argument("--aircraft", default="0,1,2", help="which of the three")
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--key", default=way_of()["code"], help="cases are kept under it (default: the version)")
    arguments = parser.parse_args()
    console = Console(width=WIDTH)
    every = WIRES if arguments.wires else (HEALTHY, *CASES, *WIRES, *AIRCRAFT)
    named = [case for case in every if arguments.only in f"{case.fault}, {case.moment}"]
    wanted = tuple(case for case in named if case.short or not arguments.short)
    rows = kept(arguments.key, wanted)

    def said(row: Row) -> None:
        rows.append(row)
        print(f"{len(rows)}: {row.aircraft} {row.fault}, {row.moment}: {row.longest_s:.0f} s", file=sys.stderr)
        Kept(RESULTS, arguments.key).add(row._asdict())

    began = time.monotonic()
    place, known = installation(), {(Path(row.aircraft).stem, row.fault, row.moment) for row in rows}
    for number, seed in [FLOWN[int(n)] for n in ("0" if arguments.short else arguments.aircraft).split(",")]:
        name = Path(FLIGHTS[number]).stem
        left = [case for case in wanted if (name, case.fault, case.moment) not in known]
        if left:
            campaign(place, flight(place, number, seed, arguments.seconds), left, arguments.jobs, said)
    places = {(case.fault, case.moment): i for i, case in enumerate(wanted)}
    rows.sort(key=lambda row: places[row.fault, row.moment])
    console.print(table(rows))
    silent = {(row.fault, row.moment) for row in rows if row.longest_s > SILENT_S}
    console.print(
        f"{len({(r.fault, r.moment) for r in rows})} cases, {len(rows)} flown in {time.monotonic() - began:.0f} s:"
        f" {len(silent)} confidently wrong for longer than {SILENT_S:g} s"
    )
    healthy = healthy_hours.kept(arguments.key)
    console.print(healthy_hours.summary(healthy), highlight=False)
    return int(bool(silent) or healthy_hours.any_excluded(healthy))


if __name__ == "__main__":
    sys.exit(main())
