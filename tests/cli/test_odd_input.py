"""Odd but plausible calls: one line before any work, exit status 2, nothing written, nothing left behind."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.records.files import read_recording

FLIGHT = str(ROOT / "replay_logs" / "throttle-steps.mcap")
OTHER = str(ROOT / "replay_logs" / "sensor-fails.mcap")
MODEL = str(ROOT / "models" / "left-upper.json")


@pytest.fixture
def here(tmp_path, monkeypatch):
    time_s = np.arange(3000) * 0.1
    table = np.column_stack((time_s, 0.5 - 0.5 * np.cos(time_s / 5), 2500 - 2500 * np.cos(time_s / 5)))
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="time_s,deformation_mm,force_N", comments="")
    for name in ("dir.mcap", "dir.csv", "dir.json", "dir.parquet"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (f"replay {FLIGHT} -o dir.mcap", "dir.mcap: cannot be written: it is a folder"),
        (f"replay {FLIGHT} -o out.csv", "expected a name that ends in .mcap"),
        (f"replay {FLIGHT} -o /proc/x.mcap", "/proc/x.mcap: cannot be written to /proc"),
        (f"replay {FLIGHT} --smooth dir.csv", "it is a folder"),
        (f"replay {FLIGHT} {OTHER}", "expected a file of the same run as"),
        ("identify b.csv -o model", "expected a name that ends in .json"),
        ("identify b.csv -o dir.json", "it is a folder"),
        ("identify b.csv --rate inf -o m.json", "--rate inf: expected"),
        (f"extend {MODEL} b.csv --effect creep -o dir.json", "it is a folder"),
        ("simulate --minutes 0.1 -o dir.mcap", "it is a folder"),
        ("simulate --minutes 0.1 --seed -1 -o x.mcap", "--seed: -1: expected a whole number, 0 or more"),
        ("simulate --bench steps --hours 0.02 --seed 1.5 -o x.csv", "--seed: 1.5: expected a whole number"),
        ("plan-test steps --hours 0.1 --seed -1 -o x.csv", "--seed: -1: expected a whole number"),
        ("plan-test steps --hours 0.1 -o x.txt", "expected a name that ends in .csv"),
        ("convert b.csv --rate 1e6 -o x.csv", "3e+08 rows; expected 1 row and more, at most 5e+08 values"),
        ("convert b.csv --rate 1e-9 -o x.csv", "expected 1 row and more"),
        ("convert b.csv -o dir.csv", "it is a folder"),
        (f"compare {MODEL} b.csv --load-cell-std -5", "--load-cell-std -5: expected above 0"),
        (f"compare {MODEL} b.csv --load-cell-std nan", "--load-cell-std nan: expected above 0"),
        ("effects --picture x.png", "expected its name as well"),
        ("fleet compare b.csv --model gone.json -o x.parquet", "gone.json: cannot be read"),
        ("fleet replay b.csv -o x.csv", "expected a name that ends in .parquet"),
        ("workbench gone", "gone: expected a folder"),
        (f"zero {FLIGHT} --date 2026-02-30 -o c.toml", "--date: 2026-02-30: expected a day of the calendar"),
        (f"zero {FLIGHT} --date 2126-05-01 -o c.toml", "--date: 2126-05-01: expected a day that has been"),
        ("simulate --tethered --minutes 8 -o c.mcap", "--minutes 8: expected without --tethered"),
    ],
)
def test_one_line_before_any_work(here, capsys, call, words):
    before = sorted(here.iterdir())
    assert main(call.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = err.splitlines()
    assert words in line
    assert sorted(here.iterdir()) == before


def test_what_a_logger_writes_for_overload_is_no_measurement(here):
    rows = (here / "b.csv").read_text().splitlines()
    rows[5] = "0.4,9.9e37,5"
    rows[6] = "0.5,0.1,-1e308"
    (here / "b.csv").write_text("\n".join(rows))
    record = read_recording(here / "b.csv")
    assert np.flatnonzero(np.isnan(record["deformation_mm"])).tolist() == [4]
    assert np.flatnonzero(np.isnan(record["force_N"])).tolist() == [5]
    assert "deformation_mm: 1 of 3000 values missing" in record.notes


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_ended_from_outside_nothing_half_written_stays(here, number):
    """The signal comes when the temporary file is there, so no time is involved."""
    child = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in what it starts behind its back
from thrustd.__main__ import main
from thrustd.sinks import mcap_log
class Ended(mcap_log.LogWriter):
    def write_outputs(self, outputs):
        assert [name for name in os.listdir() if name.endswith(".part")]
        os.kill(os.getpid(), int(sys.argv[1]))
mcap_log.LogWriter = Ended
sys.exit(main(["replay", sys.argv[2], "-o", "out.mcap"]))
"""
    before = sorted(here.iterdir())
    command = [sys.executable, "-c", child, str(int(number)), FLIGHT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, env=dict(os.environ))
    assert done.returncode == (130 if number == signal.SIGINT else 143)
    assert "Traceback" not in done.stderr
    assert sorted(here.iterdir()) == before


def test_interrupted_while_the_verbs_load_it_ends_in_one_line():
    """Whichever module is loaded when the signal comes."""
    child = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Pressed:
    def find_spec(self, name, *_):
        if name == "thrustd.cli":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Pressed())
from thrustd.__main__ import main
sys.exit(main(["--version"]))
"""
    done = subprocess.run([sys.executable, "-c", child], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (130, "thrustd: interrupted\n")
