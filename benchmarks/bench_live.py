"""The unchanged daemon at 1 kHz on real wires: `python -m benchmarks bench_live` (two minutes; --minutes for more).

1 kHz ADC with four channels through a pty, 3 x 1 kHz accelerations and engine and air data through python-can's
multicast bus: processor time of the daemon, frames lost, and the time from an event's arrival stamp to the estimate.
"""

import argparse
import os
import tempfile
from pathlib import Path

import msgspec
import psutil
from rich.console import Console
from rich.table import Table

from tests.hil.test_hil import PATIENCE_S, ServiceManager, start
from tests.reliability.rig import Daemon
from thrustd.cli.status import read_status
from thrustd.installation import read_installation
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

DEPLOY = Path(__file__).parents[1] / "deploy"
HEALTH_PORT = 9187


def aircraft(folder: Path) -> Path:
    """deploy/ph-lab.toml with its wires and folders in `folder`."""
    text = (DEPLOY / "ph-lab.toml").read_text()
    for old, new in (
        ('"../models/', f'"{DEPLOY.parent}/models/'),
        ('"canaerospace.dbc"', f'"{DEPLOY}/canaerospace.dbc"'),
        ('"/dev/thrustd-adc"', f'"{folder}/adc"'),
        ('"socketcan"', '"udp_multicast"'),
        ('"can0"', '"239.74.163.51"'),
        ("/var/lib/thrustd", str(folder)),
        ("9105", str(HEALTH_PORT)),
        ("8765", "8799"),
    ):
        text = text.replace(old, new)
    path = folder / "aircraft.toml"
    path.write_text(text)
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=2.0)
    minutes = parser.parse_known_args()[0].minutes
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = aircraft(folder)
        installation = read_installation(config)
        profile, airframe = scripted_flight(minutes * 60.0, 5)
        flight = folder / "flight.mcap"
        table = installation.can_table(ICD_INPUT_ROWS)
        rates = Rates(adc_hz=1000.0, accel_hz=1000.0, engine_hz=20.0, air_hz=20.0)
        write_flight(flight, profile, airframe, table, installation.log_header(), 5, rates)
        with ServiceManager(folder / "notify") as manager:
            daemon = Daemon(config, manager)
            try:
                process = psutil.Process(daemon.process.pid)
                before = sum(process.cpu_times()[:2])
                bench = start(["simulate", "--hil", str(config), "--log", str(flight), "--json"], dict(os.environ))
                report, _ = bench.communicate(timeout=minutes * 60 + PATIENCE_S)
                cpu_s = sum(process.cpu_times()[:2]) - before
                status = read_status(f"http://127.0.0.1:{HEALTH_PORT}/metrics")
                daemon.stop()
            finally:
                daemon.close()
        _show(folder, msgspec.json.decode(report), cpu_s, status)


def _show(folder: Path, sent: dict[str, float], cpu_s: float, status: dict[str, object]) -> None:
    shown = Table("what", "measured", "target", title=f"live, {sent['sent_s'] / 60:.1f} min at 1 kHz")
    shown.add_row("daemon's share of one core", f"{100 * cpu_s / sent['sent_s']:.0f} %", "< 25 %")
    shown.add_row("serial chunks sent / lost at the pty", f"{sent['serial_chunks']} / {sent['serial_lost']}", "0 lost")
    shown.add_row("CAN messages sent / lost at the bus", f"{sent['can_messages']} / {sent['can_lost']}", "0 lost")
    logs = sorted(folder.rglob("*.mcap"))
    missing = sum(LogFile(path).missing_events for path in logs if path.name != "flight.mcap")
    shown.add_row("events missing in the log", str(missing), "0")
    for key, value in status.items():
        if "latency" in key or "overrun" in key or "faults" in key:
            shown.add_row(key, str(value), "median < 0.5 ms, 99 % < 5 ms" if "latency" in key else "")
    Console(width=120).print(shown)


if __name__ == "__main__":
    main()
