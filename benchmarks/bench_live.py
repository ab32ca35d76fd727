"""The unchanged daemon at 1 kHz on real wires: `python -m benchmarks bench_live [--minutes 10] [--bus fifo]`.

1 kHz ADC with four channels through a pty; 3 x 1 kHz accelerations and 20 Hz engine and air data through a CAN bus:

    socketcan       python-can's own SocketCAN receiver, fed by frames in datagrams (see `benchmarks.socketcan`)
    fifo            named pipes (`thrustd.twin.fifo_bus`)
    udp_multicast   python-can's network bus

Processor time of the daemon by thread, frames lost, and the time from the arrival of the frame that completed a step to
its estimate, beside what a turn of a plain Python loop costs at that moment.
"""

import argparse
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import psutil
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.bench_flight import spent_s, turns
from benchmarks.soak import shipped_aircraft
from tests.hil.test_hil import PATIENCE_S, ServiceManager
from tests.onboard.rig import Daemon, bench, free_port, twin_flight
from thrustd.cli.status import read_status
from thrustd.installation.installation import read_installation
from thrustd.sources.log_run import LogRun
from thrustd.twin.flight import Rates

PROGRAM = ("benchmarks.socketcan",)  # thrustd, with the datagram bus known to python-can
MINUTES = 1.5
BUSES = ("socketcan", "fifo", "udp_multicast")
RATES = Rates(adc_hz=1000.0, accel_hz=1000.0, engine_hz=20.0, air_hz=20.0)
LOOK_S = 0.5
WARM_S = 3.0  # of the run, before its processor time counts


class Run(NamedTuple):
    sent: dict[str, Any]  # the player's report
    cpu_s: float
    over_s: float
    threads: list[tuple[int, float]]  # thread, seconds of processor time
    status: dict[str, Any]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=MINUTES)
    parser.add_argument("--bus", choices=BUSES)
    wish = parser.parse_known_args()[0]
    for bus in (wish.bus,) if wish.bus else BUSES[:2]:
        with tempfile.TemporaryDirectory() as name:
            _show(bus, Path(name), fly(bus, Path(name), wish.minutes))


def fly(bus: str, folder: Path, minutes: float) -> Run:
    channel = {"fifo": f"{folder}/can", "socketcan": str(free_port()), "udp_multicast": "239.74.163.51"}[bus]
    wires = {"/dev/thrustd-adc": f"{folder}/adc", '"socketcan"': f'"{bus}"', '"can0"': f'"{channel}"'}
    config = shipped_aircraft(folder, "ph-lab.toml", wires | {"/var/lib/thrustd": f"{folder}/logs"})
    flight, health = twin_flight(config, minutes * 60.0, 5, RATES), read_installation(config).config.health
    assert health is not None
    with ServiceManager(folder / "notify") as manager:
        daemon = Daemon(config, manager, PROGRAM)
        try:
            with bench(config, flight, PROGRAM) as player:
                cpu_s, over_s, threads = watch(daemon.process.pid, player, minutes, bus)
                report, _ = player.communicate(timeout=PATIENCE_S)
            status = read_status(f"http://127.0.0.1:{health.port}/metrics")
            daemon.stop()
        finally:
            daemon.close()
    return Run(msgspec.json.decode(report), cpu_s, over_s, threads, status)


def watch(
    pid: int, player: subprocess.Popen[bytes], minutes: float, bus: str
) -> tuple[float, float, list[tuple[int, float]]]:
    """Processor time of `pid` while the player plays: seconds, over seconds, by thread in order of their birth."""
    process = psutil.Process(pid)
    time.sleep(WARM_S)
    began_s, before = time.monotonic(), {t.id: t.user_time + t.system_time for t in process.threads()}
    after, ended_s = before, began_s
    steps = range(int((minutes * 60.0 - WARM_S) / LOOK_S))
    for _ in track(steps, f"live, {bus}", console=Console(stderr=True), transient=True):
        if player.poll() is not None:
            break
        time.sleep(LOOK_S)
        after, ended_s = {t.id: t.user_time + t.system_time for t in process.threads()}, time.monotonic()
    threads = [(thread, spent_s - before.get(thread, 0.0)) for thread, spent_s in sorted(after.items())]
    return sum(spent_s for _, spent_s in threads), ended_s - began_s, threads


def _show(bus: str, folder: Path, run: Run) -> None:
    sent = run.sent
    shown = Table("what", "measured", "target", title=f"live over {bus}, {sent['sent_s'] / 60:.1f} min at 1 kHz")
    shown.add_row("daemon's share of one core", f"{100 * run.cpu_s / run.over_s:.1f} %", "<= 20 %")
    busy = [f"{100 * spent_s / run.over_s:.1f}" for _, spent_s in run.threads if spent_s > 1e-3 * run.over_s]
    shown.add_row("  by thread, in order of birth, %", ", ".join(busy), "")
    shown.add_row("  a turn of a plain Python loop afterwards", f"{spent_s(turns) * 1e3:.0f} ns", "")
    shown.add_row("serial chunks sent / lost at the pty", f"{sent['serial_chunks']} / {sent['serial_lost']}", "0 lost")
    shown.add_row("CAN messages sent / lost at the bus", f"{sent['can_messages']} / {sent['can_lost']}", "0 lost")
    log = LogRun(list((folder / "logs").rglob("*.mcap")))
    heard = sum(getattr(event, "channel", "") == "can" for event in log.events())
    shown.add_row("CAN messages in the log, events missing", f"{heard}, {log.missing_events}", "all, 0")
    for key, value in run.status.items():
        if "latency" in key or "overrun" in key or "faults" in key:
            shown.add_row(key, str(value), "median <= 0.5 ms, 99 % <= 2 ms" if "latency" in key else "")
    Console(width=120).print(shown)


if __name__ == "__main__":
    main()
