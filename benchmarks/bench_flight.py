"""Replay against real time and by stage, memory against length, cold start: `python -m benchmarks bench_flight`."""

import gc
import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table

from thrustd.core.types import Output
from thrustd.installation.installation import Installation, read_installation
from thrustd.replay.replay import flight_score, open_installation, truth_of, truth_topics
from thrustd.replay.score import Truth
from thrustd.sinks.mcap_log import LogWriter
from thrustd.sources.mcap_log import LogFile
from thrustd.sources.mcap_walk import LogMessage
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS
from thrustd.wire.event_batch import EventBatch

CONFIG = Path(__file__).parents[1] / "deploy" / "hil.toml"
REFERENCE = Path(__file__).parents[1] / "replay_logs" / "throttle-steps.mcap"
TIMES = {10: 200, 40: 250}  # minutes of a flight: how many times real time its replay is to be
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
    installed = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}  # as by pip
    start, before = time.perf_counter(), os.times()
    done = subprocess.run([sys.executable, "-c", CHILD, *arguments], capture_output=True, text=True, env=installed)
    wall_s, after = time.perf_counter() - start, os.times()
    if done.returncode:
        raise SystemExit(f"thrustd {' '.join(arguments)}: exit status {done.returncode}\n{done.stderr}")
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return wall_s, cpu_s, int(done.stderr.split()[-2]) / 1e3, done.stdout


def stages(path: Path) -> Table:
    """Processor time of a replay by stage, ms per second of flight."""
    log = LogFile(path)
    installation = open_installation(log, None)
    batches = list(log.batches())
    n_events = sum(map(len, batches))
    outputs, fed_s, fused_s = _fed(installation, batches)
    topics = truth_topics(flight_score(installation).names)
    truths = list[list[LogMessage]]()
    reading_s = spent_s(lambda: sum(map(len, LogFile(path).batches(None, topics, truths.append))))
    known = [truth for messages in truths for truth in truth_of(messages)]
    costs_s = {
        "read the file": reading_s,
        "fused steps (deck, monitor, filter, mount states)": fused_s,
        "the rest of the pipeline (frames, messages, alignment)": fed_s - fused_s,
        "read the truth": spent_s(lambda: [list(truth_of(messages)) for messages in truths]),
        "score against the truth": spent_s(lambda: _score(installation, known, outputs)),
        "write the outputs and the truth": spent_s(lambda: _write(installation, truths, outputs)),
    }
    length_s = (batches[-1].t_ns.item(-1) - batches[0].t_ns.item(0)) * 1e-9
    shown = Table("stage", "ms per second of flight", title=f"replay, {n_events / length_s:.0f} events per second")
    for name, cost_s in costs_s.items():
        shown.add_row(name, f"{cost_s / length_s * 1e3:.2f}")
    shown.add_row("for comparison: ten thousand turns of a Python loop, ms", f"{spent_s(turns) * 10:.2f}")
    return shown


def turns() -> int:
    """A million turns: what this machine is worth at this moment."""
    total = 0
    for turn in range(1_000_000):
        total += turn
    return total


def spent_s(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def _fed(installation: Installation, batches: list[EventBatch]) -> tuple[list[Output], float, float]:
    """Outputs, processor time of all `feed`s, and of the fused steps in them."""
    pipeline, outputs, fused_s = installation.pipeline(), list[Output](), 0.0
    fuse = pipeline._fuse

    def timed(t_ns: int, out: list[Output]) -> None:
        nonlocal fused_s
        fused_s += spent_s(lambda: fuse(t_ns, out))

    setattr(pipeline, "_fuse", timed)  # noqa: B010 - a stopwatch around the inside
    gc.collect()
    gc.freeze()

    def feed() -> None:
        for batch in batches:
            outputs.extend(pipeline.take(batch))

    fed_s = spent_s(feed)
    return outputs, fed_s, fused_s


def _score(installation: Installation, known: list[Truth], outputs: list[Output]) -> None:
    score = flight_score(installation)
    for truth in known:
        score.hear(truth)
    for output in outputs:
        score.take(output)


def _write(installation: Installation, truths: list[list[LogMessage]], outputs: list[Output]) -> None:
    writer = LogWriter(io.BytesIO(), installation.log_header(), sync_s=None)
    for output in outputs:
        writer.write_output(output)
    for messages in truths:
        writer.copy(messages)
    writer.close()


def main() -> None:
    shown = Table("what", "measured", "target", title="flight")
    starts = sorted(timed(["check", str(CONFIG), "--json"])[:2] for _ in range(STARTS))
    wall_s, cpu_s = starts[STARTS // 2]
    shown.add_row("cold start to ready", f"{wall_s:.2f} s (CPU {cpu_s:.2f} s)", "< 3 s")
    memory = []
    with tempfile.TemporaryDirectory() as folder:
        for minutes, times in TIMES.items():
            path = Path(folder) / f"{minutes}.mcap"
            make_flight(path, minutes)
            _, cpu_s, peak_mb, out = timed(["replay", str(path), "-o", str(Path(folder) / "out.mcap"), "--json"])
            length_s = msgspec.json.decode(out)["length_s"]
            memory.append(peak_mb)
            shown.add_row(
                f"replay of {minutes} min, 4 x 100 Hz LVDT, start included",
                f"{length_s / cpu_s:.0f} x real time (CPU {cpu_s:.1f} s)", f">= {times} x",
            )  # fmt: skip
    shown.add_row(
        f"peak memory, {' and '.join(map(str, TIMES))} min", " / ".join(f"{mb:.0f} MB" for mb in memory), "flat"
    )
    console = Console()
    console.print(shown)
    console.print(stages(REFERENCE))


if __name__ == "__main__":
    main()
