"""Kill the onboard process at random moments of a flight: `python -m benchmarks.kill9 --kills 200`.

The twin plays one flight in real time on a pty and a CAN bus; the daemon is killed with SIGKILL at random, started
again at once, and so on. Every log must be readable, and every life but the first that lasts long enough is compared
with an uninterrupted replay. Ctrl+C ends it early and reports what was done.
"""

import argparse
import random
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import NamedTuple

import psutil
from rich.progress import track

from tests.hil.test_hil import ServiceManager
from tests.reliability.rig import Daemon, bench, deviation, forces, reliable_aircraft, twin_flight
from thrustd.replay import replay
from thrustd.sources.mcap_log import LogFile

WARM_AFTER_NS = 5_000_000_000
LONGEST_GAP_NS = 10_000_000_000  # between a kill and READY: what the promise is for
SHORTEST_LIFE_S, LONGEST_LIFE_S = 1.0, 9.0
START_S = 6.0  # allowed per start when the length of the flight is chosen
MOUNT = "left_upper"


class Life(NamedTuple):
    """From one start to one kill."""

    ready_s: float  # from the start of the process to READY
    ready_cpu_s: float  # of it, processor time
    ready_ns: int
    killed_ns: int
    words: str


def live_once(config: Path, manager: ServiceManager, dice: random.Random) -> Life:
    started_s = time.monotonic()
    daemon = Daemon(config, manager)
    ready_s = time.monotonic() - started_s
    ready_cpu_s, ready_ns = sum(psutil.Process(daemon.process.pid).cpu_times()[:2]), time.monotonic_ns()
    try:
        until_s = dice.uniform(SHORTEST_LIFE_S, LONGEST_LIFE_S)
        daemon.beats(int(until_s))
        time.sleep(until_s % 1.0)
        killed_ns = time.monotonic_ns()
        return Life(ready_s, ready_cpu_s, ready_ns, killed_ns, daemon.kill())
    finally:
        daemon.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    dice = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = reliable_aircraft(folder)
        flight = twin_flight(config, arguments.kills * (LONGEST_LIFE_S + START_S), arguments.seed)
        with ServiceManager(folder / "notify") as manager, bench(config, flight):
            lives: list[Life] = []
            with suppress(KeyboardInterrupt):
                for _ in track(range(arguments.kills), "killing"):
                    lives.append(live_once(config, manager, dice))
        report(folder, flight, lives)


def report(folder: Path, flight: Path, lives: list[Life]) -> None:
    reference = folder / "reference.mcap"
    replay(flight, reference)
    known = forces(reference, MOUNT)
    logs = sorted((folder / "logs").glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    lost_s, missing, medians, highs, worsts = [], 0, [], [], []
    begins_ns = [0, *(life.killed_ns for life in lives)]
    for life, gone_ns, log in zip(lives, begins_ns, track(logs[: len(lives)], "reading"), strict=False):
        file = LogFile(log)
        events = list(file.events())
        missing += file.missing_events
        lost_s.append((life.killed_ns - (events[-1].t_ns if events else life.ready_ns)) * 1e-9)
        settled = [row for row in forces(log, MOUNT) if row[0] > life.ready_ns + WARM_AFTER_NS]
        found = sorted(map(abs, deviation(settled, known)))
        if found and "starting warm" in life.words and life.ready_ns - gone_ns <= LONGEST_GAP_NS:
            medians.append(found[len(found) // 2])
            highs.append(found[int(0.95 * len(found))])
            worsts.append(found[-1])
    ready_s = [life.ready_s for life in lives]
    warm = sum("starting warm" in life.words for life in lives)
    print(f"kills {len(lives)}, logs readable {len(logs)}, events missing inside logs {missing}")
    print(f"lost at the end of a log: median {median(lost_s):.2f} s, worst {max(lost_s):.2f} s")
    cpu_s = [life.ready_cpu_s for life in lives]
    print(f"start to READY: median {median(ready_s):.2f} s, worst {max(ready_s):.2f} s; processor time: "
          f"median {median(cpu_s):.2f} s, worst {max(cpu_s):.2f} s")  # fmt: skip
    print(f"warm starts {warm} of {len(lives) - 1}")
    if medians:
        print_deviation(medians, highs, worsts)
    print(f"tracebacks: {sum('Traceback' in life.words for life in lives)}")


def print_deviation(medians: list[float], highs: list[float], worsts: list[float]) -> None:
    print(f"mount force after 5 s against an uninterrupted run ({len(medians)} lives): "
          f"median {median(medians):.2e}, 95 % of the worst life {max(highs):.2e}, worst step {max(worsts):.2e}; "
          f"worst step within 1 % in {sum(worst < 0.01 for worst in worsts)} lives")  # fmt: skip


if __name__ == "__main__":
    main()
