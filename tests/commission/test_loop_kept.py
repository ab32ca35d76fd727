"""The loop's benchmark goes on from rows that the same code made, and from no others."""

import sys

import pytest

from benchmarks import loop_in_air, made_with


def test_a_row_of_another_version_is_refused(tmp_path, monkeypatch, capsys):
    made = []
    monkeypatch.setattr(loop_in_air, "row_of", lambda *asked: made.append(asked) or list("abcdefg"))
    asked = ["--case", "nothing", "--aircraft", "7", "--flights", "0", "--folder", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["loop_in_air", *asked])
    loop_in_air.main()
    loop_in_air.main()
    assert len(made) == 1 and "a | b | c" in capsys.readouterr().out
    monkeypatch.setattr(made_with, "_code", lambda root: "another")
    with pytest.raises(SystemExit, match=r"this is .*code another"):
        loop_in_air.main()
