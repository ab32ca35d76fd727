"""Killed at every moment: does a warm start exclude a healthy sensor? `python -m benchmarks.restarts [FLIGHT ...]`.

A recorded flight is replayed; every `--every` seconds new pipelines go on from a snapshot of the one that flies, after
pauses of which they hear nothing, for `--then` seconds. Whoever is reported then and not in the whole flight without a
restart is excluded wrongly; zeros and troubles of the wires exclude nobody.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from thrustd.core.types import Fault
from thrustd.installation.installation import WarmStart
from thrustd.pipeline.pipeline import Pipeline
from thrustd.replay.replay import open_installation
from thrustd.sources.mcap_log import LogFile
from thrustd.wire.event_batch import EventBatch

FLIGHTS = Path("replay_logs/throttle-steps.mcap"), Path("replay_logs/sensor-fails.mcap")
PAUSES_S = 2.0, 6.0, 9.0  # a checkpoint older than 10 s is refused
FIRST_S, EVERY_S, THEN_S = 5.0, 0.5, 10.0
SLICE_S = 0.1
EXCLUDES = {"stuck", "noisy", "offset", "drift", "dead", "failed"}


class Restart(NamedTuple):
    at_s: float
    pause_s: float
    excluded: list[str]  # wrongly: "where kind"


def restarts(path: Path, at_s: Sequence[float], pauses_s: Sequence[float], then_s: float) -> list[Restart]:
    """Of one flight, at each of these times since its first event with each of these pauses."""
    place, batches = open_installation(LogFile(path), None), _sliced(path)
    pipeline, begun, found, lasts = place.pipeline(), 0, list[tuple[float, float, set[Fault]]](), _slices(then_s)
    wrong = set[Fault]()
    for stop in map(_slices, at_s):
        wrong |= _reports(pipeline, batches[begun:stop])
        begun, memory = stop, json.dumps(pipeline.snapshot())
        for pause_s in pauses_s:
            again, warm = place.warm_pipeline(WarmStart(json.loads(memory), 0))
            assert warm, "its own snapshot was refused"
            first = stop + _slices(pause_s)
            found.append((stop * SLICE_S, pause_s, _reports(again, batches[first : first + lasts])))
    named = {fault.where for fault in wrong | _reports(pipeline, batches[begun:])}
    return [
        Restart(at, pause_s, sorted(f"{f.where} {f.kind}" for f in said if f.where not in named))
        for at, pause_s, said in found
    ]


def length_s(path: Path) -> float:
    return len(_sliced(path)) * SLICE_S


def _slices(seconds: float) -> int:
    return round(seconds / SLICE_S)


def _sliced(path: Path) -> list[EventBatch]:
    """A batch for each tenth of a second."""
    events = list(LogFile(path).events())
    times_s = np.array([event.t_ns for event in events]) * 1e-9
    ends = np.searchsorted(times_s, np.arange(times_s[0], times_s[-1] + SLICE_S, SLICE_S)).tolist()
    return [EventBatch.of(events[one:other]) for one, other in pairwise(ends)]


def _reports(pipeline: Pipeline, batches: Sequence[EventBatch]) -> set[Fault]:
    faults = [output for batch in batches for output in pipeline.take(batch) if isinstance(output, Fault)]
    return {fault for fault in faults if fault.active and fault.kind in EXCLUDES}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("flights", nargs="*", type=Path, default=FLIGHTS)
    parser.add_argument("--pauses", type=float, nargs="*", default=PAUSES_S, help="s")
    parser.add_argument("--every", type=float, default=EVERY_S, help="s")
    parser.add_argument("--then", type=float, default=THEN_S, help="s that each one is watched")
    arguments = parser.parse_args()
    wrongly = 0
    for path in arguments.flights:
        last_s = length_s(path) - max(arguments.pauses) - arguments.then
        flown = restarts(path, np.arange(FIRST_S, last_s, arguments.every).tolist(), arguments.pauses, arguments.then)
        wrong = [restart for restart in flown if restart.excluded]
        for at_s, pause_s, excluded in wrong:
            print(f"  {at_s:.1f} s, pause {pause_s:g} s: {', '.join(excluded)}")
        print(f"{path.name}: {len(wrong)} of {len(flown)} restarts exclude a healthy sensor", flush=True)
        wrongly += len(wrong)
    return int(wrongly > 0)


if __name__ == "__main__":
    sys.exit(main())
