"""Knobs of `simulate`: what is no number or does nothing is refused, statics and hostile go together."""

import pytest

from thrustd.__main__ import main
from thrustd.cli import simulate
from thrustd.twin.installation import hostile

FLIGHT = "simulate", "--minutes", "0.1", "--seed", "5"


@pytest.mark.parametrize(
    ("knobs", "words"),
    [
        (["drag_m2=nan"], "drag_m2=nan: expected finite numbers"),
        (["zero_mm=0.01,inf,0,0"], "expected finite numbers"),
        (["statics=2"], "statics=2: expected 0 or 1"),
        (["thrust_line_mm=20"], "thrust_line_mm: does nothing without --knob statics=1"),
        (["statics=1", "share=0.01"], "share: does nothing with --knob statics=1"),
    ],
)
def test_a_knob_that_is_no_number_or_does_nothing_is_refused(knobs, words, tmp_path, capsys):
    given = [word for knob in knobs for word in ("--knob", knob)]
    assert main([*FLIGHT, *given, "-o", str(tmp_path / "flight.mcap")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line and not list(tmp_path.iterdir())


@pytest.mark.parametrize("given", [["--installation", "statics"], ["--knob", "statics=1"]])
def test_a_hostile_installation_may_hang_as_a_rigid_body(given, tmp_path, monkeypatch):
    drawn, real = [], simulate._profile
    monkeypatch.setattr(simulate, "_profile", lambda each: drawn.append(simulate._knobs(each)) or real(each))
    more = ["--installation", "hostile"] if "--knob" in given else []
    line = ["--knob", "thrust_line_mm=20"]
    assert main([*FLIGHT, *more, *given, *line, "-o", str(tmp_path / "flight.mcap")]) == 0
    (knobs,) = drawn
    assert knobs.statics is True and knobs.thrust_line_mm == 20.0
    assert (knobs.drag_m2 == hostile(5).drag_m2) == bool(more)
