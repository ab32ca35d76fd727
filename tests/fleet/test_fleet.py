"""Many flights on Dask: the table is that of one process, also when workers are killed on the way."""

import os
import signal

import pyarrow.parquet as pq
import pytest

from tests.conftest import small_aircraft
from thrustd.core.errors import UsageError
from thrustd.fleet.fleet import ReplayJob, at, local, run_fleet
from thrustd.records.files import file_sha256
from thrustd.records.rows import write_rows
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FLIGHTS = 4


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    installation = small_aircraft()
    table, header = installation.can_table(ICD_INPUT_ROWS), installation.log_header()
    for seed in range(FLIGHTS):
        profile, airframe = scripted_flight(4.0, seed)
        write_flight(folder / f"{seed}.mcap", profile, airframe, table, header, seed, Rates(accel_hz=10.0))
    (folder / "broken.mcap").write_bytes(b"not a log")
    return sorted(folder.glob("*.mcap"))


@pytest.fixture(scope="module")
def alone(files):
    """The rows without Dask."""
    rows = []
    for file in files:
        if file.stem != "broken":
            about = {"file": str(file), "error": "", "sha256": file_sha256(file)}
            rows += [about | row for row in ReplayJob()(str(file))]
    return rows


def test_killing_a_worker_midway_loses_nothing(files, alone, tmp_path):
    workers = local(2)
    killed = []

    def kill_one(fraction):
        if not killed:
            pids = CLIENTS[0].run(os.getpid)
            killed.append(next(iter(pids.values())))
            os.kill(killed[0], signal.SIGKILL)

    with workers as client:
        CLIENTS[:] = [client]
        rows = run_fleet(ReplayJob(), files, Given(client), kill_one)
    assert killed
    assert repr([row for row in rows if not row["error"]]) == repr(alone)  # NaN is not equal to itself
    broken = [row for row in rows if row["error"]]
    assert [row["file"] for row in broken] == [str(file) for file in files if file.stem == "broken"]
    write_rows(rows, tmp_path / "table.parquet")
    table = pq.read_table(tmp_path / "table.parquet").to_pylist()
    assert len(table) == len(rows)
    assert repr([row["rmse_n"] for row in table if not row["error"]]) == repr([row["rmse_n"] for row in alone])
    assert [path.name for path in tmp_path.iterdir()] == ["table.parquet"]


CLIENTS = []


class Given:
    """Workers that somebody else closes."""

    def __init__(self, client):
        self._client = client

    def __enter__(self):
        return self._client

    def __exit__(self, *_):
        return None


def test_a_scheduler_that_is_not_there_is_one_clear_line(monkeypatch):
    monkeypatch.setattr("thrustd.fleet.fleet.CONNECT_S", 1)
    with pytest.raises(UsageError, match="cannot be reached"), at("tcp://127.0.0.1:1"):
        pass
