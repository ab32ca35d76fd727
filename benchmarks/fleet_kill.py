"""Replay flights on Dask while workers are killed: `python -m benchmarks.fleet_kill --flights 50 --kill-every 10`.

The table must be the one that a single process makes without Dask, row for row.
"""

import argparse
import os
import signal
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

from tests.conftest import small_aircraft
from thrustd.fleet.fleet import ReplayJob, local, run_fleet
from thrustd.records.rows import Row
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS


class Killer:
    """Kills a worker whenever so many more files are done."""

    def __init__(self, files: int, every: int, processes: int) -> None:
        self.kills = 0
        self._files, self._every, self._processes = files, every, processes
        self._client: Client | None = None

    @contextmanager
    def workers(self) -> Iterator[Client]:
        with local(self._processes) as client:
            self._client = client
            yield client

    def advance(self, fraction: float) -> None:
        done = round(fraction * self._files)
        if done // self._every > self.kills and done < self._files and self._client is not None:
            pids = list(self._client.run(os.getpid).values())
            os.kill(pids[self.kills % len(pids)], signal.SIGKILL)
            self.kills += 1


def make_flights(folder: Path, count: int, seconds: float) -> list[Path]:
    installation = small_aircraft()
    table, header = installation.can_table(ICD_INPUT_ROWS), installation.log_header()
    for seed in range(count):
        profile, airframe = scripted_flight(seconds, seed)
        write_flight(folder / f"{seed:03d}.mcap", profile, airframe, table, header, seed, Rates(accel_hz=20.0))
    return sorted(folder.glob("*.mcap"))


def alone(files: list[Path]) -> list[Row]:
    return [{"file": str(file), "error": ""} | row for file in files for row in ReplayJob()(str(file))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--kill-every", type=int, default=10)
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        files = make_flights(Path(name), arguments.flights, arguments.seconds)
        killer = Killer(len(files), arguments.kill_every, arguments.processes)
        began_s = time.monotonic()
        rows = run_fleet(ReplayJob(), files, killer.workers(), killer.advance)
        took_s = time.monotonic() - began_s
        same = repr(rows) == repr(alone(files))  # NaN is not equal to itself
    print(f"{len(files)} flights, {killer.kills} workers killed, {len(rows)} rows in {took_s:.0f} s: "
          f"{'the same table as' if same else 'NOT the table of'} one process without Dask")  # fmt: skip


if __name__ == "__main__":
    main()
