"""Transducers whose lines bend, each its own way, on mounts that shake as their engine pulls: no effect of rubber."""

from importlib import import_module

import numpy as np
import pytest

from thrustd.core.calibration import MountCalibration
from thrustd.core.errors import ModelError
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.held_back import HeldBack
from thrustd.installation.shipped import read_deck
from thrustd.records.recording import Recording

from .test_in_flight import DRAG_M2, a_flight, both, read_models, shipped

DECK = read_deck()
(SPEC,) = read_models([shipped("models/left-upper.json", "model")]).values()
BOW_MM, SCALE, RANGE_MM = 0.012, 0.005, 1.6


def bent(flight: Recording, bow_mm: float, scale: float) -> Recording:
    """The upper mount's transducer so, the lower one's the other way; vibration goes with the fuel flow."""
    shaken = 1.0 + 60.0 * flight["fuel_flow_kg_s_left"]
    columns = {f"vibration_mm_s_{mount}": shaken for mount in ("left_upper", "left_lower")}
    for mount, sign in (("left_upper", 1.0), ("left_lower", -1.0)):
        mm = flight[f"deformation_mm_{mount}"]
        part = mm / RANGE_MM
        columns[f"deformation_mm_{mount}"] = (mm + sign * 4.0 * bow_mm * part * (1.0 - part)) * (1.0 + sign * scale)
    return flight.with_channels(**columns)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_lines_that_bend_as_they_may_are_no_payne(sign: float) -> None:
    flight = bent(a_flight(DECK), sign * BOW_MM, sign * SCALE)
    report = diagnose(SPEC, [flight], given=both(DECK))
    assert report.verdict == ("none",) and not any("alone: payne" in line for line in report.advice)
    with pytest.raises(ModelError, match="no model written"):
        extend(SPEC, [flight], ["payne"], given=both(DECK))


def test_a_set_that_leaves_more_of_what_is_held_back_is_neither_named_nor_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However much likelier it is."""
    flight, known = a_flight(DECK, 1, drag_m2=DRAG_M2), both(DECK)
    assert diagnose(SPEC, [flight], given=known).verdict == ("nacelle_drag",)
    monkeypatch.setattr(
        import_module("thrustd.diagnose.search.in_flight"),
        "held_back",
        lambda *_: HeldBack(50.0, 10.0, 10.1, fell=False),
    )
    report = diagnose(SPEC, [flight], given=known)
    assert report.verdict == ("none",)
    assert any("nacelle_drag fits these flights, but a part held back" in line for line in report.advice)
    with pytest.raises(ModelError, match=r"a part held back does not bear it out.*no model written"):
        extend(SPEC, [flight], ["nacelle_drag"], given=known)


def test_gauge_blocks_leave_little_of_a_line() -> None:
    np.testing.assert_allclose(MountCalibration(curve_std_mm=0.0004).line_stds(1.6), (0.00025, 0.0004))
    assert MountCalibration().line_stds(1.6) == (0.005, 0.01)
