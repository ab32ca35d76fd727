"""Fly for hours on the real wire, faster than life: `python -m benchmarks.soak --hours 24 --speed 10`.

The twin's flight goes through a pty and a CAN bus into an unchanged daemon. Its memory is looked at all the while; at
the end its counters must add up to what was sent, and replaying its log must give its estimates bit for bit.
"""

import argparse
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import psutil

from tests.hil.test_hil import PATIENCE_S, ServiceManager, start
from tests.reliability.rig import Daemon, reliable_aircraft, twin_flight
from thrustd.cli.status import read_status
from thrustd.installation import read_installation
from thrustd.replay import replay
from thrustd.sources.log_run import LogRun
from thrustd.sources.mcap_log import LogFile
from thrustd.types import Frame

LOOK_S = 5.0
WARM_UP = 0.25  # of the time: caches fill, then memory must stay
TOPICS = ("/estimate/left", "/estimate/right", "/mount/left_upper")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="of flight")
    parser.add_argument("--speed", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = reliable_aircraft(folder)
        flight = twin_flight(config, arguments.hours * 3600, arguments.seed)
        with ServiceManager(folder / "notify") as manager:
            daemon = Daemon(config, manager)
            try:
                sent, memory, status = play(config, flight, arguments.speed, daemon.process.pid)
                words = daemon.stop()
            finally:
                daemon.close()
        report(folder, flight, sent, memory, status)
        print(f"daemon's exit status {daemon.process.returncode}, tracebacks {words.count('Traceback')}")


def play(config: Path, flight: Path, speed: float, pid: int) -> tuple[dict[str, Any], np.ndarray, dict[str, Any]]:
    """-> (what the bench sent, memory (n, 2) of hours flown and MB, last status)."""
    health = read_installation(config).config.health
    assert health is not None
    process, rows, begin_s = psutil.Process(pid), [], time.monotonic()
    verb = ["simulate", "--hil", str(config), "--log", str(flight), "--speed", str(speed), "--json"]
    bench = start(verb, dict(os.environ))
    while bench.poll() is None:
        rows.append(((time.monotonic() - begin_s) * speed / 3600, process.memory_info().rss * 1e-6))
        try:
            bench.wait(LOOK_S)
        except subprocess.TimeoutExpired:
            continue
    out, _ = bench.communicate(timeout=PATIENCE_S)
    time.sleep(LOOK_S)  # what is in flight arrives
    return msgspec.json.decode(out), np.array(rows), read_status(f"http://127.0.0.1:{health.port}/metrics")


def report(folder: Path, flight: Path, sent: dict[str, Any], memory: np.ndarray, status: dict[str, Any]) -> None:
    logs = sorted((folder / "logs").glob("*.mcap"))
    run = LogRun(logs)
    frames_sent, messages_sent = counted(LogFile(flight))
    frames_logged, messages_logged = counted(run)
    settled = memory[int(len(memory) * WARM_UP) :]
    slope_mb_h = float(np.polyfit(settled[:, 0], settled[:, 1], 1)[0])
    print(f"flown {sent['sent_s'] / 3600:.2f} h in {len(memory) * LOOK_S / 60:.1f} min")
    print(f"ADC frames sent {frames_sent}, lost by the pty {sent['serial_lost']}, in the log {frames_logged}")
    print(f"CAN messages sent {messages_sent}, refused by the bus {sent['can_lost']}, in the log {messages_logged}, "
          f"counted by the daemon {status['events_total']['can']:.0f}")  # fmt: skip
    print(f"shed {status['shed_events_total']:.0f}, missing in the log {status['log_missing_items_total']}, "
          f"events missing by number {run.missing_events}")  # fmt: skip
    print(f"memory {settled[0, 1]:.1f} MB -> {settled[-1, 1]:.1f} MB, slope {slope_mb_h:+.2f} MB per hour of flight")
    again = folder / "again.mcap"
    replay(logs[0], again)
    live, replayed = ([message.data for message in LogFile(path).messages(TOPICS)] for path in (logs[0], again))
    same = sum(a == b for a, b in zip(live, replayed, strict=True))
    print(f"live and replay: {same} of {len(live)} outputs equal to the last bit (first file of {len(logs)})")
    print(f"faults: { {name: int(count) for name, count in status.get('faults_total', {}).items()} }")


def counted(log: LogFile | LogRun) -> tuple[int, int]:
    """(ADC frames, CAN messages) among the raw events."""
    frames = messages = 0
    for event in log.events():
        if isinstance(event, Frame):
            if event.channel == "adc":
                frames += event.data.count(0)
            else:
                messages += 1
    return frames, messages


if __name__ == "__main__":
    main()
