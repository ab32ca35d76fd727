"""What the campaign prints: a row for each fault with the truth beside the estimate, of this version of the program."""

import sys
from io import StringIO

import pytest
from rich.console import Console

from benchmarks import integrity, made_with
from benchmarks.integrity import Row, table
from benchmarks.integrity_cases import HEALTHY
from benchmarks.kept import Kept

GOOD = Row(
    "one", HEALTHY.fault, HEALTHY.moment, true_n=3000.0, bias_n=12.0, rms_n=20.0, silent_pct=0.0, longest_s=0.0,
    in_band_pct=100.0, std_n=150.0, named_s=None, told_s=None, first="", wrongly_excluded=[], pause_s=0.1,
    after_sigmas=0.2, over=True,
)  # fmt: skip


def test_a_fault_is_one_row_with_the_truth_beside_the_estimate():
    rows = [GOOD._replace(fault="both", moment=at, bias_n=bias_n) for at, bias_n in (("begin", 5.0), ("cruise", -90.0))]
    grid, console = table([GOOD, *rows]), Console(width=integrity.WIDTH, file=StringIO())
    console.print(grid)
    head, healthy, both = [line.split() for line in console.file.getvalue().splitlines()]
    assert head[:7] == ["fault", "flown", "worst", "true", "N", "said", "N"]
    assert healthy[:5] == ["healthy", "1", "begin", "3000", "3012"]
    assert both[:6] == ["both", "2", "cruise", "3000", "2910", "150"]


def test_what_another_version_flew_does_not_count(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for key, each in (("", GOOD), ("another", GOOD._replace(longest_s=60.0)), (made_with.way_of()["code"], GOOD)):
        Kept(integrity.RESULTS, key).add(each._asdict())
    monkeypatch.setattr(sys, "argv", ["integrity", "--only", f"{HEALTHY.fault}, {HEALTHY.moment}", "--aircraft", "0"])
    monkeypatch.setattr(integrity, "campaign", lambda *_: pytest.fail("flown again"))
    monkeypatch.setattr(integrity, "FLIGHTS", ["one"])
    monkeypatch.setattr(integrity, "FLOWN", ((0, 11),))
    assert integrity.main() == 0
    assert "1 cases, 1 flown" in capsys.readouterr().out
