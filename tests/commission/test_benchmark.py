"""A kept result of the benchmark says what made it, and another version does not go on from it."""

import json

import pytest

from benchmarks import commission, made_with


@pytest.fixture
def flown(tmp_path, monkeypatch):
    """An aircraft of which nothing is really flown."""
    calls = []

    def said(*words):
        calls.append(words[0])
        if words[0] == "commission":
            (tmp_path / "101" / "aircraft").mkdir(exist_ok=True)
            (tmp_path / "101" / "aircraft" / "hil.toml").write_text("estimate_hz = 10.0")

    monkeypatch.setattr(commission, "said", said)
    monkeypatch.setattr(commission, "records", lambda *_: [])
    monkeypatch.setattr(commission, "scored", lambda config, seed, kind, minutes: [[[1.0, 99.0], [2.0, 98.0]]] * 3)
    return tmp_path / "101", calls


def test_it_is_written_with_commit_and_code_and_goes_on_as_long_as_these_are_the_same(flown):
    folder, calls = flown
    first = commission.aircraft(folder, 101, 4.0, 12.0)
    kept = json.loads((folder / "result.json").read_text())
    assert kept == first and kept["made_with"]["hours"] == 4.0 and kept["made_with"]["minutes"] == 12.0
    assert len(kept["made_with"]["code"]) == made_with.SHOWN and kept["made_with"]["commit"]
    assert commission.aircraft(folder, 101, 4.0, 12.0) == first and calls == ["commission"]


@pytest.mark.parametrize("left", ["result.json", "commissioned.json"])
def test_what_another_version_left_is_refused_in_one_line(flown, monkeypatch, left):
    folder, calls = flown
    commission.aircraft(folder, 101, 4.0, 12.0)
    if left == "commissioned.json":
        (folder / "result.json").unlink()  # ended before it was scored
    code = made_with.way_of()["code"]
    monkeypatch.setattr(made_with, "_code", lambda root: "another")
    with pytest.raises(SystemExit, match=f"{left}: made with commit .*, code {code}; this is .*, code another") as line:
        commission.aircraft(folder, 101, 4.0, 12.0)
    assert "\n" not in str(line.value) and calls == ["commission"]


def test_other_settings_and_results_of_before_are_refused_another_commit_with_the_same_code_is_not(flown, monkeypatch):
    folder, _ = flown
    first = commission.aircraft(folder, 101, 4.0, 12.0)
    with pytest.raises(SystemExit, match=r"minutes 12.0; this is .*, minutes 3.0"):
        commission.aircraft(folder, 101, 4.0, 3.0)
    monkeypatch.setattr(made_with, "_commit", lambda root: "a page changed")
    assert commission.aircraft(folder, 101, 4.0, 12.0) == first
    (folder / "result.json").write_text(json.dumps({"seconds": 1.0, "scores": []}))
    with pytest.raises(SystemExit, match="code not said"):
        commission.aircraft(folder, 101, 4.0, 12.0)
