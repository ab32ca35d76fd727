"""Kill the onboard process at random moments of a flight: `python -m benchmarks.kill9 --kills 200`.

The twin plays a flight in real time on a pty and a CAN bus; the daemon with the shipped models is killed with SIGKILL
at random, started again at once, and so on. Every log must be readable, and every life that took over from another and
lasts long enough is compared with an uninterrupted run on the same events (unless a life before it had started cold).
20 kills share one flight; their lives are then added to the `--results` file, so that what was interrupted goes on
where it was.
"""

import argparse
import os
import random
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import psutil
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.soak import shipped_aircraft
from tests.hil.test_hil import ServiceManager
from tests.onboard.rig import Daemon, bench, deviations, log_steps, twin_flight, uninterrupted
from thrustd.sources.mcap_log import LogFile

WARM_AFTER_NS = 5_000_000_000
LONGEST_GAP_S = 10.0  # between a kill and READY: what the promise is for
SHORTEST_LIFE_S, LONGEST_LIFE_S = 1.0, 11.0
START_S = 12.0  # allowed per start when the length of the flight is chosen: a loaded machine
KILLS_PER_FLIGHT = 20


class Life(NamedTuple):
    """From one start to one kill."""

    ready_s: float  # from the start of the process to READY
    ready_cpu_s: float  # of it, processor time
    load: float  # of the machine, mean of a minute
    ready_ns: int
    killed_ns: int
    words: str


class Row(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What became of a life."""

    ready_s: float
    ready_cpu_s: float
    load: float
    lost_s: float  # at the end of its log
    missing_events: int  # inside its log
    gap_s: float  # from the kill before to READY; 0 = the first of its flight: nothing to take over
    warm: bool
    traceback: bool
    deviations: tuple[float, float, float] | None  # median, 95 %, worst of |force / uninterrupted - 1| from 5 s on


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--results", type=Path, help="JSON lines: go on after the kills that are in it")
    arguments = parser.parse_args()
    rows: list[Row] = []
    if arguments.results is not None and arguments.results.exists():
        rows = msgspec.json.decode(b"[%s]" % b",".join(arguments.results.read_bytes().splitlines()), type=list[Row])
    while len(rows) < arguments.kills:
        fresh = one_flight(min(KILLS_PER_FLIGHT, arguments.kills - len(rows)), arguments.seed + len(rows))
        rows += fresh
        if arguments.results is not None:
            with arguments.results.open("ab") as file:
                file.write(msgspec.json.Encoder().encode_lines(fresh))
    report(rows)


def one_flight(kills: int, seed: int) -> list[Row]:
    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        config = shipped_aircraft(Path(name))
        flight = twin_flight(config, kills * (LONGEST_LIFE_S + START_S), seed)
        with ServiceManager(config.with_name("notify")) as manager, bench(config, flight):
            lives = [live_once(config, manager, dice) for _ in track(range(kills), "killing")]
        return judge(flight, lives)


def live_once(config: Path, manager: ServiceManager, dice: random.Random) -> Life:
    started_s = time.monotonic()
    daemon = Daemon(config, manager)
    ready_s, ready_ns = time.monotonic() - started_s, time.monotonic_ns()
    ready_cpu_s = sum(psutil.Process(daemon.process.pid).cpu_times()[:2])
    try:
        time.sleep(dice.uniform(SHORTEST_LIFE_S, LONGEST_LIFE_S))
        killed_ns = time.monotonic_ns()
        return Life(ready_s, ready_cpu_s, os.getloadavg()[0], ready_ns, killed_ns, daemon.kill())
    finally:
        daemon.close()


def judge(flight: Path, lives: list[Life]) -> list[Row]:
    """The logs of one flight beside what an uninterrupted run makes of the same events."""
    logs = sorted((flight.parent / "logs").glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    assert len(logs) == len(lives), f"{len(logs)} logs of {len(lives)} lives"
    rows, gone_ns, whole = [], lives[0].ready_ns, uninterrupted(flight, logs)
    for life, log, known in zip(lives, track(logs, "reading"), whole, strict=True):
        file = LogFile(log)
        kept_ns = max((event.t_ns for event in file.events()), default=life.ready_ns)
        rows.append(
            Row(
                ready_s=life.ready_s,
                ready_cpu_s=life.ready_cpu_s,
                load=life.load,
                lost_s=(life.killed_ns - kept_ns) * 1e-9,
                missing_events=file.missing_events,
                gap_s=(life.ready_ns - gone_ns) * 1e-9,
                warm="starting warm" in life.words,
                traceback="Traceback" in life.words,
                deviations=quantiles(deviations(log_steps(log), known, life.ready_ns + WARM_AFTER_NS)),
            )
        )
        gone_ns = life.killed_ns
    return rows


def quantiles(found: NDArray[np.float64]) -> tuple[float, float, float] | None:
    return None if found.size == 0 else (float(np.median(found)), float(np.quantile(found, 0.95)), float(found.max()))


def report(rows: list[Row]) -> None:
    print(f"kills {len(rows)}, all logs readable, events missing inside logs {sum(row.missing_events for row in rows)}")
    print(f"load average {min(row.load for row in rows):.1f} to {max(row.load for row in rows):.1f}")
    for name, what in (
        ("lost_s", "lost at the end of a log"),
        ("ready_s", "start to READY"),
        ("ready_cpu_s", "start to READY, processor time"),
    ):
        values = np.array([getattr(row, name) for row in rows])
        print(f"{what}: median {np.median(values):.2f} s, 95 % {np.quantile(values, 0.95):.2f} s, "
              f"worst {values.max():.2f} s")  # fmt: skip
    print(f"lost more than 1 s: {sum(row.lost_s > 1.0 for row in rows)}, READY after more than 3 s: "
          f"{sum(row.ready_s > 3.0 for row in rows)}")  # fmt: skip
    later = [row for row in rows if row.gap_s > 0.0]
    print(f"warm starts {sum(row.warm for row in later)} of {len(later)}")
    handed_on = unbroken(rows)
    print_forces(f"back within {LONGEST_GAP_S:g} s", [row for row in handed_on if row.gap_s <= LONGEST_GAP_S])
    print_forces("back later", [row for row in handed_on if row.gap_s > LONGEST_GAP_S])
    print(f"tracebacks: {sum(row.traceback for row in rows)}")


def unbroken(rows: list[Row]) -> list[Row]:
    """Lives whose state was handed on from life to life since their flight began: a cold start in between forgets."""
    handed_on, chain = [], False
    for row in rows:
        first = row.gap_s == 0.0
        chain = first or (chain and row.warm)
        if chain and not first:
            handed_on.append(row)
    return handed_on


def print_forces(when: str, rows: list[Row]) -> None:
    """How far the mount force was from an uninterrupted run, from 5 s after READY on."""
    found = np.array([row.deviations for row in rows if row.deviations is not None])
    if len(found):
        print(f"{when}, mount force from 5 s on against an uninterrupted run: {len(found)} lives, median "
              f"{np.median(found[:, 0]):.2e}, 95 % of the worst life {found[:, 1].max():.2e}, worst step "
              f"{found[:, 2].max():.2e}; worst step within 1 % in {np.sum(found[:, 2] < 0.01)} lives")  # fmt: skip


if __name__ == "__main__":
    main()
