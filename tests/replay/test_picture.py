"""The picture of a flight says what is drawn, with and without a truth."""

from math import nan

import numpy as np
import pytest

from thrustd.core.types import Estimate, Status
from thrustd.replay.picture import BEYOND, MAX_POINTS, FlightPicture

STEP_NS = 100_000_000


def picture_of(thrust_n, truth_n=nan, status=0, brochure_n=5200.0, names=("left",)):
    picture = FlightPicture()
    rows = np.broadcast_arrays(thrust_n, truth_n, status, brochure_n)
    for i, (thrust, truth, bits, brochure) in enumerate(zip(*(row.tolist() for row in rows), strict=True)):
        e = Estimate(i * STEP_NS, 0, thrust, 50.0, 0, thrust + 10, 60.0, brochure, 90.0, 0, 0, 0, 0, 0, 0.5, bits)
        for name in names:
            picture.take(name, e, truth)
    return picture


def drawn(picture, largest_n=()):
    """-> axes, words of the legend."""
    figure = picture.figure("flight", dict(largest_n))
    return figure.axes, [text.get_text() for text in figure.legends[0].get_texts()]


def line_of(axis, label):
    (line,) = [line for line in axis.lines if line.get_label() == label]
    return line.get_ydata()


def test_with_a_truth_every_estimate_is_set_against_it():
    (above, below, near), legend = drawn(
        picture_of(np.full(100, 5000.0), truth_n=4990.0), {"left": {"fused": 10.4, "mount": 20.0}}
    )
    assert {"fused", "mount source", "brochure source", "truth"} <= set(legend)
    assert "95 % band of fused (of differences: around zero)" in legend
    assert below.get_title(loc="left") == "estimate minus truth; largest: fused 10 N, mount 20 N"
    assert set(line_of(below, "fused")) == set(line_of(near, "fused")) == {10.0}
    assert "brochure source" not in [line.get_label() for line in near.lines]
    assert near.get_ylim()[1] < below.get_ylim()[1]
    assert set(line_of(above, "truth")) == {4990.0}


def test_without_a_truth_the_sources_are_set_against_fused():
    (_, below, _), legend = drawn(picture_of(np.full(100, 5000.0)), {"left": {"brochure": 200.0}})
    assert "truth" not in legend
    assert below.get_title(loc="left") == "source minus fused (no truth is known); largest: brochure 200 N"
    assert set(line_of(below, "mount source")) == {10.0}
    assert set(line_of(below, "brochure source")) == {200.0}
    assert below.get_ylim()[1] > 200.0


def test_what_the_axis_cuts_off_has_a_mark():
    brochure = np.full(1000, 5200.0)
    assert BEYOND not in drawn(picture_of(np.full(1000, 5000.0), brochure_n=brochure))[1]
    brochure[500] = 9e4
    (above, *_), legend = drawn(picture_of(np.full(1000, 5000.0), brochure_n=brochure))
    assert BEYOND in legend
    assert above.get_ylim()[1] < 9e4


@pytest.mark.parametrize(
    ("bit", "words"),
    [
        (Status.MOUNT_FAILED, "mount source lost or excluded"),
        (Status.BROCHURE_LOST, "brochure source lost or excluded"),
        (Status.ONE_MOUNT, "thrust of one mount alone"),
    ],
)
def test_every_wash_is_in_the_legend(bit, words):
    status = np.where(np.arange(1000) > 400, int(bit), 0)
    assert words in drawn(picture_of(np.full(1000, 5000.0), status=status))[1]
    assert words not in drawn(picture_of(np.full(1000, 5000.0), status=int(Status.TRANSIENT)))[1]


def test_both_engines_have_the_same_axes_wide_enough_for_either():
    picture = picture_of(np.linspace(0, 9000, 100))
    for i in range(100):
        e = Estimate(i * STEP_NS, 1, 100.0, 50.0, 0, 90.0, 60.0, 100.0, 90.0, 0, 0, 0, 0, 0, 0.5, 0)
        picture.take("right", e)
    axes, _ = drawn(picture)
    assert axes[0].get_ylim() == axes[1].get_ylim()
    assert axes[0].get_ylim()[1] > 9000.0


def test_a_long_flight_is_thinned_and_begins_when_a_source_speaks(tmp_path):
    picture = picture_of(np.full(3 * MAX_POINTS, 5000.0))
    assert len(picture.tracks["left"].points) <= MAX_POINTS
    silent = Estimate(0, 0, 0.0, 4000.0, 0, nan, nan, nan, nan, 0, 0, 0, 0, 0, 0.5, 0)
    picture.take("right", silent)
    assert "right" not in picture.tracks
    picture.save(tmp_path / "p.png", "flight", {})
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_a_flight_without_estimates_is_an_empty_picture(tmp_path):
    FlightPicture().save(tmp_path / "p.png", "flight", {})
    assert (tmp_path / "p.png").exists()
