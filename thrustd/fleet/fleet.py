"""Hundreds of flights by the functions that do one, on Dask: replay, compare or identify file by file, one table.

    rows = run_fleet(job, files, workers)          workers: `local(n)`, or `at(address)`

A file that cannot be used is a row with its `error`; a worker that dies costs only its running file, which another
worker starts again. Rows come in the order of the files, whoever did them and whenever.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dask
import msgspec
from distributed import Client, LocalCluster, as_completed

from thrustd.core.errors import ModelError, RecordingError, ThrustdError, UsageError
from thrustd.records.files import file_sha256
from thrustd.records.once import check_once
from thrustd.records.rows import Row
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import read_text

Job = Callable[[str], list[Row]]
RETRIES = 2  # of a file whose worker failed in another way than dying
DEATHS = 20  # of workers, that one file may survive: it is seldom the file's fault
CONNECT_S = 20


@dataclass(frozen=True, slots=True)
class ReplayJob:
    """Replay a log; a row per engine or mount and source with its error against the truth, where there is one."""

    out: str = ""  # folder for the estimate logs; empty = none

    def __call__(self, file: str) -> list[Row]:
        from thrustd.replay.replay import replay

        path = Path(file)
        summary = replay(path, Path(self.out) / path.name if self.out else None)
        flight = {
            "length_s": summary.length_s,
            "events": summary.events,
            "missing_events": summary.missing_events,
            "cut": summary.cut,
            "estimates": summary.estimates,
            "faults": sum(summary.faults.values()),
        }
        for name, engine in summary.engines.items():  # side by side for all flights: how they change
            flight |= {f"{name}_residual_pct": engine.residual_pct, f"{name}_load_share": engine.load_share}
        scores = [
            {"of": name, "source": source, **msgspec.to_builtins(score)}
            for name, sources in summary.scores.items()
            for source, score in sources.items()
        ]
        return [flight | score for score in scores or [{}]]


@dataclass(frozen=True, slots=True)
class CompareJob:
    """Run models over a recording; a row per model."""

    models: tuple[str, ...]

    def __call__(self, file: str) -> list[Row]:
        from thrustd.diagnose.compare.compare import compare
        from thrustd.model.compile import read_proven_model
        from thrustd.records.files import read_recording

        specs = {model: read_proven_model(read_text(Path(model), ModelError), model) for model in self.models}
        report = compare(specs, [read_recording(Path(file))]).to_json()
        return [_flat(comparison) for comparison in report["comparisons"]]


@dataclass(frozen=True, slots=True)
class IdentifyJob:
    """Identify a model from a bench recording: written to `out`, a row per structure."""

    out: str
    structures: tuple[str, ...] = ("hw-pwl",)

    def __call__(self, file: str) -> list[Row]:
        from thrustd.identify.identify import identify
        from thrustd.model.artifact import write_model
        from thrustd.records.files import read_recording

        path = Path(file)
        found = identify([read_recording(path)], structures=self.structures, name=path.stem)
        model = Path(self.out) / f"{path.stem}.json"
        write_whole(model, write_model(found.spec), RecordingError)
        scores: Any = found.to_json()["structures"]
        return [_flat(score) | {"model": str(model), "best": found.spec.structure} for score in scores]


def run_fleet(
    job: Job,
    files: Sequence[Path],
    workers: AbstractContextManager[Client],
    advance: Callable[[float], None] = lambda fraction: None,
) -> list[Row]:
    """`job` of every file; rows begin with `file`, `error` (empty when it went well) and `sha256` of the content."""
    with dask.config.set({"distributed.scheduler.allowed-failures": DEATHS}), workers as client:
        futures = {client.submit(_guarded, job, str(file), retries=RETRIES, pure=False): file for file in files}
        done: dict[Path, list[Row]] = {}
        for future in as_completed(list(futures)):
            done[futures[future]] = future.result()
            advance(len(done) / len(futures))
    seen: dict[str, str] = {}
    return [row for file in files for row in _once(file, done[file], seen)]


def _once(file: Path, rows: list[Row], seen: dict[str, str]) -> list[Row]:
    """The rows of a file, of a copy its complaint."""
    try:
        if "sha256" in rows[0]:
            check_once(seen, str(file), rows[0]["sha256"])
    except UsageError as problem:
        return [{"file": str(file), "error": str(problem)}]
    return rows


def _guarded(job: Job, file: str) -> list[Row]:
    try:
        rows = job(file)
        return [{"file": file, "error": "", "sha256": file_sha256(Path(file))} | row for row in rows]
    except ThrustdError as problem:
        return [{"file": file, "error": str(problem)}]


@contextmanager
def local(processes: int) -> Iterator[Client]:
    """Processes on this machine, one file each at a time."""
    options = {"n_workers": processes, "threads_per_worker": 1, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**options, silence_logs=50) as cluster, Client(cluster) as client:
        yield client


@contextmanager
def at(address: str) -> Iterator[Client]:
    """Workers of a running scheduler (they must see the files under the same names)."""
    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, ValueError) as problem:
        raise UsageError(f"--scheduler {address}: cannot be reached: {problem}") from None
    with client:
        yield client


def _flat(row: dict[str, Any], prefix: str = "") -> Row:
    """Nested objects as `outer_inner` columns; lists stay out."""
    flat: Row = {}
    for name, value in row.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}_")
        elif not isinstance(value, list | tuple):
            flat[prefix + name] = value
    return flat
