"""Replay against real time, memory against length, cold start: `python -m benchmarks bench_flight`."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table

from thrustd.installation import read_installation
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

CONFIG = Path(__file__).parents[1] / "deploy" / "hil.toml"
MINUTES = (10, 40)
STARTS = 5


def make_flight(path: Path, minutes: int) -> None:
    installation = read_installation(CONFIG)
    profile, airframe = scripted_flight(minutes * 60.0, 11)
    table = installation.can_table(ICD_INPUT_ROWS)
    write_flight(path, profile, airframe, table, installation.log_header(), 11, Rates(adc_hz=100.0))


def timed(arguments: list[str]) -> tuple[float, float, float, str]:
    """Run `thrustd ...`; -> wall s, CPU s, peak memory MB, standard output."""
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-m", "thrustd", *arguments], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    out = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"thrustd {' '.join(arguments)}: exit status {process.returncode}")
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3, out


def main() -> None:
    shown = Table("what", "measured", "target", title="flight")
    starts = sorted(timed(["check", str(CONFIG), "--json"])[:2] for _ in range(STARTS))
    wall_s, cpu_s = starts[STARTS // 2]
    shown.add_row("cold start to ready", f"{wall_s:.2f} s (CPU {cpu_s:.2f} s)", "< 3 s")
    memory = []
    with tempfile.TemporaryDirectory() as folder:
        for minutes in MINUTES:
            path = Path(folder) / f"{minutes}.mcap"
            make_flight(path, minutes)
            _, cpu_s, peak_mb, out = timed(["replay", str(path), "-o", str(Path(folder) / "out.mcap"), "--json"])
            length_s = msgspec.json.decode(out)["length_s"]
            memory.append(peak_mb)
            shown.add_row(
                f"replay of {minutes} min, 4 x 100 Hz LVDT, start included",
                f"{length_s / cpu_s:.0f} x real time (CPU {cpu_s:.1f} s)", ">= 200 x",
            )  # fmt: skip
    shown.add_row(
        f"peak memory, {MINUTES[0]} and {MINUTES[1]} min", " / ".join(f"{mb:.0f} MB" for mb in memory), "flat"
    )
    Console().print(shown)


if __name__ == "__main__":
    main()
