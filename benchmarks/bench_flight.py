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


# what the kernel tells a parent (ru_maxrss) includes the parent's own memory at the fork: the child says it itself
CHILD = """
import sys
from thrustd.__main__ import main
status = main(sys.argv[1:])
peak = next(line for line in open("/proc/self/status") if line.startswith("VmHWM"))
sys.stderr.write(f"\\n{peak}")
sys.exit(status)
"""


def timed(arguments: list[str]) -> tuple[float, float, float, str]:
    """Run `thrustd ...`; -> wall s, CPU s, peak memory MB, standard output."""
    start, before = time.perf_counter(), os.times()
    done = subprocess.run([sys.executable, "-c", CHILD, *arguments], capture_output=True, text=True)
    wall_s, after = time.perf_counter() - start, os.times()
    if done.returncode:
        raise SystemExit(f"thrustd {' '.join(arguments)}: exit status {done.returncode}\n{done.stderr}")
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return wall_s, cpu_s, int(done.stderr.split()[-2]) / 1e3, done.stdout


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
