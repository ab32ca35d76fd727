"""Every term of a budget that is printed as more than nothing is a bar."""

from dataclasses import replace
from itertools import pairwise

from matplotlib.figure import Figure

from thrustd.replay.budget import RANDOM, SYSTEMATIC, Budget, Row
from thrustd.replay.budget_picture import draw, picture, save

ROWS = [
    Row("mounts", "zero", SYSTEMATIC, 22.4),
    Row("mounts", "creep", SYSTEMATIC, 0.0),
    Row("mounts", "inertia", RANDOM, 5.2),
    Row("brochure", "shape", SYSTEMATIC, 189.0),
    Row("fused", "installation", SYSTEMATIC, 186.0),
]
BUDGET = Budget("left", 4373.0, ROWS, 23.0, 23.0, 189.0, 231.0)


def test_terms_largest_first_and_what_they_are_together():
    axis = Figure().subplots()
    draw(axis, BUDGET)
    assert [round(bar.get_width(), 1) for bar in axis.patches] == [22.4, 5.2, 23.0, 189.0, 189.0, 186.0, 231.0]
    assert [bool(bar.get_hatch()) for bar in axis.patches].index(True) == 1
    assert "4373 +- 453 N" in axis.get_title(loc="left")


def test_no_name_lies_over_the_next_one():
    term = "calibration (model on held-out data)"
    rows = [Row(source, term, SYSTEMATIC, 10.0) for source in ("mounts", "brochure", "fused") for _ in range(7)]
    figure = picture("flight.mcap", [replace(BUDGET, rows=rows)] * 2)
    figure.draw_without_rendering()
    for axis in figure.axes:
        boxes = [label.get_window_extent() for label in axis.get_yticklabels()]
        assert all(lower.y1 <= upper.y0 for upper, lower in pairwise(boxes))


def test_it_is_a_png(tmp_path):
    save(tmp_path / "budget.png", "flight.mcap", [BUDGET, BUDGET])
    assert (tmp_path / "budget.png").read_bytes().startswith(b"\x89PNG")
