"""Fly for hours on the real wire, faster than life: `python -m benchmarks.soak --hours 24 --speed 10`.

The twin's flight goes through a pty and a CAN bus into the daemon with the shipped models, whose clocks run as much
faster (`benchmarks/fast_clock.py`), so that to it everything happens in real time. Its memory is looked at all the
while; at the end its counters must add up to what was sent, and replaying its logs must give its outputs bit for bit.
`--minutes 60` ends it after an hour of our time, however far it has come. A log takes 100 to 200 MB per hour of flight.
`--own-clock` leaves the daemon its clocks: to it everything then comes at so many times the nominal rate (overload).
With `--folder NAME` the logs stay, and NAME/memory.csv tells meanwhile how far it is.
"""

import argparse
import math
import os
import re
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
from numpy.typing import NDArray
from rich.progress import Progress, TaskID

from benchmarks.soak_check import Checked, check
from tests.hil.test_hil import ServiceManager
from tests.onboard.rig import Daemon, free_port
from thrustd.cli.status import read_status
from thrustd.core.errors import UsageError
from thrustd.core.types import Event, Frame
from thrustd.installation.installation import Installation, read_installation
from thrustd.sources.paced import paced
from thrustd.twin.flight import Rates, Truth, fly, scripted_flight
from thrustd.twin.hil import Bench
from thrustd.wire.can_frames import ICD_INPUT_ROWS

LOOK_S = 5.0
READER_LATE_S = 5.0  # a daemon that gets no processor is waited for, so that nothing is lost on its way
SETTLE_S = 1.0  # after the last frame: when nothing more is counted for so long, everything has been worked on
WARM_UP = 0.25  # of the time: caches fill, then memory must stay
FEWEST_HOURS = 4  # for a slope
ROOT = Path(__file__).parents[1]


class Sent(NamedTuple):
    """What went onto the wires, and how the daemon looked meanwhile."""

    hours: float  # of flight
    minutes: float  # of our time
    adc_bytes: int
    can_messages: int
    lost: tuple[int, int]  # serial chunks and CAN messages that the wires did not take
    memory: NDArray[np.float64]  # (n, 3) hours of flight, MB, seconds of processor time
    daemon_cpu: float  # of one core
    status: dict[str, Any]  # the health page at the end


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0, help="of flight")
    parser.add_argument("--speed", type=float, default=10.0)
    parser.add_argument("--minutes", type=float, default=math.inf, help="of our time, at most")
    parser.add_argument("--check-hours", type=float, default=math.inf, help="of flight that are replayed afterwards")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="new or empty, kept; default: a temporary one")
    parser.add_argument("--own-clock", action="store_true", help="the daemon's clocks do not run faster")
    arguments = parser.parse_args()
    program = ("thrustd",) if arguments.own_clock else ("benchmarks.fast_clock", str(arguments.speed))
    with tempfile.TemporaryDirectory() if arguments.folder is None else nullcontext(arguments.folder) as name:
        folder = Path(name).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        config = shipped_aircraft(folder)
        unit = (ROOT / "deploy" / "thrustd.service").read_text()
        os.environ.update(re.findall(r"(MALLOC_\w+)=(\w+)", unit))  # memory as in flight
        with ServiceManager(folder / "notify") as manager:
            daemon = Daemon(config, manager, program)
            try:
                sent = play(config, arguments, daemon.process.pid)
                words = daemon.stop()
            finally:
                daemon.close()
        report(sent, check(sorted((folder / "logs").glob("*.mcap")), arguments.check_hours * 3600))
        print(f"daemon's exit status {daemon.process.returncode}, tracebacks {words.count('Traceback')}")


def shipped_aircraft(folder: Path, name: str = "hil.toml", places: Mapping[str, str] | None = None) -> Path:
    """A shipped configuration with ports of its own; `places`: its wires and folders, none: those of hil.toml."""
    text = (ROOT / "deploy" / name).read_text()
    own = {'"../out/hil"': f'"{folder}/logs"', "../out/hil": str(folder), "/tmp/thrustd-hil": f"{folder}/"}
    places = {
        **(own if places is None else places), "9105": str(free_port()), "8765": str(free_port()),
        '"../': f'"{ROOT}/', '"canaerospace': f'"{ROOT}/deploy/canaerospace',
        '"citation-ii': f'"{ROOT}/deploy/citation-ii',
    }  # fmt: skip
    for before, after in places.items():
        assert before in text, before
        text = text.replace(before, after)
    config = folder / "aircraft.toml"
    config.write_text(text)
    return config


def play(config: Path, arguments: argparse.Namespace, pid: int) -> Sent:
    installation = read_installation(config)
    wires, process = installation.config, psutil.Process(pid)
    assert wires.health is not None
    bench = Bench(Path(wires.adc.port), wires.can.interface, wires.can.channel, READER_LATE_S)
    events = flight(installation, arguments.hours * 3600, arguments.seed)
    first = next(events)  # the twin compiles itself now, not while the daemon waits: it would catch up in one burst
    bench.wait_for_reader()
    with Progress() as progress:
        task = progress.add_task("flying", total=arguments.hours)
        url = f"http://127.0.0.1:{wires.health.port}/metrics"
        watch = Watch(process, url, config.with_name("memory.csv"), progress, task)
        begin_s = time.monotonic()
        seen = watch.over(chain((first,), events), arguments.minutes * 60)
        out = bench.play(paced(seen, arguments.speed))
        seconds = time.monotonic() - begin_s
    cpu_share = (sum(process.cpu_times()[:2]) - watch.rows[0][2]) / seconds
    status = settled_status(watch.url)
    bench.close()
    lost = (out.serial_lost, out.can_lost)
    memory = np.array(watch.rows)
    return Sent(out.sent_s / 3600, seconds / 60, watch.adc_bytes, out.can_messages, lost, memory, cpu_share, status)


def settled_status(url: str) -> dict[str, Any]:
    """The health page when no message is left on its way."""
    counted, status = -1.0, read_status(url)
    while status["events_total"]["can"] != counted:
        counted = status["events_total"]["can"]
        time.sleep(SETTLE_S)
        status = read_status(url)
    return status


def flight(installation: Installation, seconds: float, seed: int) -> Iterator[Event]:
    profile, airframe = scripted_flight(seconds, seed)
    rates = Rates(adc_hz=installation.config.adc.sample_hz)
    for item in fly(profile, airframe, installation.can_table(ICD_INPUT_ROWS), seed, rates):
        if not isinstance(item, Truth):
            yield item


class Watch:
    """Looks at the daemon every few seconds while its events are handed out."""

    def __init__(self, process: psutil.Process, url: str, table: Path, progress: Progress, task: TaskID) -> None:
        self.url, self.adc_bytes = url, 0
        self.rows: list[tuple[float, float, float]] = []  # hours of flight, MB, seconds of processor time
        self._process, self._table, self._progress, self._task = process, table, progress, task
        table.write_text("flight_h,memory_mb,cpu_s\n")
        self._look(0.0)

    def over(self, events: Iterator[Event], limit_s: float) -> Iterator[Event]:
        begin_s = look_s = time.monotonic()
        first_ns = None
        for number, event in enumerate(events):
            first_ns = event.t_ns if first_ns is None else first_ns
            if number % 1000 == 0 and time.monotonic() > look_s + LOOK_S:
                look_s = time.monotonic()
                self._look((event.t_ns - first_ns) / 3.6e12)
                if look_s - begin_s > limit_s:
                    return
            if isinstance(event, Frame) and event.channel == "adc":
                self.adc_bytes += len(event.data)
            yield event

    def _look(self, hours: float) -> None:
        row = (hours, self._process.memory_info().rss * 1e-6, sum(self._process.cpu_times()[:2]))
        self.rows.append(row)
        with self._table.open("a") as table:
            table.write(f"{row[0]:.4f},{row[1]:.3f},{row[2]:.1f}\n")
        self._progress.update(self._task, completed=hours, description=f"flying, {hours:.2f} h, {row[1]:.1f} MB")


def hourly(memory: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) hour and mean MB of every whole hour: a log lasts an hour, and its index grows until it is closed."""
    whole = memory[memory[:, 0] < int(memory[-1, 0])]
    return np.array([[hour + 0.5, whole[whole[:, 0] // 1 == hour, 1].mean()] for hour in range(int(memory[-1, 0]))])


def slope(rows: NDArray[np.float64]) -> tuple[float, float]:
    """(slope, its one sigma) of the straight line through rows (n, 2) of x and y."""
    coefficients, covariance = np.polyfit(rows[:, 0], rows[:, 1], 1, cov=True)
    return float(coefficients[0]), float(np.sqrt(covariance[0, 0]))


def report(sent: Sent, checked: Checked) -> None:
    status = sent.status
    print(f"flown {sent.hours:.2f} h in {sent.minutes:.1f} min ({sent.hours * 60 / sent.minutes:.1f} x), "
          f"daemon at {sent.daemon_cpu:.0%} of a core")  # fmt: skip
    print(f"ADC bytes sent {sent.adc_bytes}, chunks lost by the pty {sent.lost[0]}, bytes logged {checked.adc_bytes}")
    print(f"CAN messages sent {sent.can_messages}, refused by the bus {sent.lost[1]}, logged {checked.can_messages}, "
          f"counted by the daemon {status['events_total']['can']:.0f}")  # fmt: skip
    estimates = {name: int(count) for name, count in status["estimates_total"].items()}
    print(f"estimates {estimates}")
    print(f"shed {status['shed_events_total']:.0f}, missing in the log {status['log_missing_items_total']}, "
          f"events missing by number {checked.missing_events}")  # fmt: skip
    print_memory(sent.memory)
    print(f"live and replay, {checked.replayed_h:.2f} h: {checked.same} of {checked.outputs} outputs equal to the last "
          f"bit; {checked.files} files")  # fmt: skip
    print(f"faults: { {name: int(count) for name, count in status.get('faults_total', {}).items()} }")


def print_memory(memory: NDArray[np.float64]) -> None:
    print(f"memory, MB: first {memory[0, 1]:.1f}, last {memory[-1, 1]:.1f}, highest {memory[:, 1].max():.1f}")
    rows = hourly(memory)
    settled = rows[int(len(rows) * WARM_UP) :]
    if len(settled) >= FEWEST_HOURS:
        kilobytes_h, sigma = (1000 * value for value in slope(settled))
        print(f"memory, means of whole hours of flight, MB: {' '.join(f'{mean:.2f}' for mean in rows[:, 1])}")
        print(f"after the first {WARM_UP:.0%}: {kilobytes_h:+.1f} +- {sigma:.1f} kB per hour of flight (one sigma)")


if __name__ == "__main__":
    try:
        main()
    except UsageError as problem:  # no answer from the health page
        raise SystemExit(str(problem)) from None
