"""Kill the recorder at random moments: `python benchmarks/kill_log.py --kills 200`. Every log must be readable.

A child records ticks at 1 kHz in real time and prints each one; it gets SIGKILL after a random number of them. What
it printed and the log does not have is the loss.
"""

import argparse
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.progress import track

from thrustd.sources.log_run import LogRun

CHILD = """
import sys
from itertools import chain
from pathlib import Path
from threading import Event
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.merge import EventQueue, merged
from thrustd.sources.ticker import Ticker
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

queue = EventQueue()
settings = RecorderSettings(Path(sys.argv[1]), rotate_min=0.02)
log = LogRecorder(settings, LogHeader(engines=(), mounts=()), queue.put)
for event in chain.from_iterable(merged(queue, [Ticker(1000, queue.put)], Event())):
    log.write_batch(EventBatch.of((event,)))
    print(event.t_ns, flush=True)
"""


def kill_once(folder: Path, ticks: int) -> float:
    """Seconds of the printed ticks that are not in the log."""
    with subprocess.Popen([sys.executable, "-c", CHILD, str(folder)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        told = [int(child.stdout.readline()) for _ in range(ticks)]
        os.kill(child.pid, signal.SIGKILL)
        told += [int(line) for line in child.stdout if line.endswith("\n")]
    kept = [event.t_ns for event in LogRun(list(folder.glob("*.mcap"))).events()]
    assert kept == told[: len(kept)], "the log is not what was recorded"
    return (told[-1] - (kept[-1] if kept else told[0])) / 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    dice, lost_s = random.Random(arguments.seed), []
    for _ in track(range(arguments.kills), "killing"):
        with tempfile.TemporaryDirectory() as folder:
            lost_s.append(kill_once(Path(folder), dice.randrange(1, 3000)))
    print(
        f"{len(lost_s)} kills, {len(lost_s)} logs readable; "
        f"lost: median {statistics.median(lost_s):.3f} s, worst {max(lost_s):.3f} s"
    )


if __name__ == "__main__":
    main()
