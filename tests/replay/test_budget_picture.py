"""Every term of a budget that is printed as more than nothing is a bar."""

from dataclasses import replace
from itertools import pairwise

import pytest
from matplotlib.figure import Figure

from thrustd.replay.budget import RANDOM, SYSTEMATIC, Budget, Row
from thrustd.replay.budget_picture import draw, picture, points_picture, save

ROWS = [
    Row("mounts", "zero", SYSTEMATIC, 22.4),
    Row("mounts", "share", SYSTEMATIC, 0.0),
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


def test_of_many_points_every_term_has_its_number_and_the_largest_of_a_source_is_bold():
    other = [Row("mounts", "zero", SYSTEMATIC, 3.0), Row("mounts", "inertia", RANDOM, 5.2), *ROWS[3:]]
    budgets = [replace(BUDGET, rows=other), BUDGET]
    figure = points_picture("flight.mcap", [(f"p{i}", [each] * 2) for i, each in enumerate(budgets)])
    assert len(figure.axes) == 2 and "Hatched: random" in figure.get_suptitle()
    axis = figure.axes[0]
    figure.draw_without_rendering()
    names = [label.get_text() for label in axis.get_xticklabels()]
    assert names == [
        "zero", "inertia, random", "mounts together", "shape", "brochure together", "installation",
        "fused, as the filter says",
    ]  # fmt: skip
    told = {(names[int(t.get_position()[0])], t.get_position()[1]): t for t in axis.texts if t.get_text()[0].isdigit()}
    assert [told["zero", row].get_text() for row in (0, 1)] == ["3.0", "22"]
    assert [told["zero", row].get_fontweight() for row in (0, 1)] == ["normal", "bold"]
    assert [told["inertia, random", row].get_fontweight() for row in (0, 1)] == ["bold", "normal"]
    first = next(bar for bar in axis.patches if bar.get_x() == 0.0 and round(bar.get_y() + 0.45) == 1)
    assert first.get_width() == pytest.approx(22.4**2 / (22.4**2 + 5.2**2), abs=0.001)  # of the variance
    boxes = [label.get_window_extent() for label in axis.get_yticklabels()]
    assert all(lower.y1 <= upper.y0 for upper, lower in pairwise(boxes))
    heading = next(t for t in axis.texts if "left engine" in t.get_text()).get_window_extent()
    assert heading.x0 >= 0.0 and heading.y0 > boxes[0].y1
