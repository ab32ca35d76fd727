"""A flight's reference: parts of whole engines, air data made into pressure, own outputs that explain nothing."""

import numpy as np
import pytest

from thrustd.core.aircraft import MountPlace
from thrustd.diagnose.compare.reference import as_mount, is_own_output, with_reference
from thrustd.records.recording import make_recording
from thrustd.wire.log_layout import FAULT_TOPIC, Topics

PLACE = MountPlace("left_upper", "left", 0, 0.46)
TIME_S = np.arange(200) / 5.0


def flight():
    columns = {"time_s": TIME_S, "deformation_mm_left_upper": 0.01 * TIME_S, "mach": 0.3 + 0 * TIME_S}
    columns |= {"pressure_altitude_m": 0 * TIME_S, "estimate_thrust_n_left": 1000.0 + TIME_S}
    return make_recording("flight", columns)


@pytest.mark.parametrize("of_engine", ["estimate_thrust_n_left", "estimate_brochure_n_left", "estimate_mount_n_left"])
def test_an_estimate_of_the_whole_engine_is_compared_by_the_mounts_share(of_engine):
    whole = flight().with_channels(**{of_engine: 1000.0 + TIME_S})
    record = with_reference(as_mount(whole, PLACE), of_engine, PLACE)
    np.testing.assert_allclose(record["force_N"], 0.46 * (1000.0 + TIME_S))


def test_air_data_give_the_dynamic_pressure_that_drag_needs():
    assert as_mount(flight(), PLACE)["dynamic_pressure_Pa"][0] == pytest.approx(0.5 * 1.4 * 101325.0 * 0.09, rel=1e-3)


def test_what_thrustd_says_itself_explains_nothing():
    own = ("estimate_thrust_n_left", "mount_force_n_left_upper", "check_asymmetry_n_left", "thrust_N_left")
    assert all(map(is_own_output, own)) and not any(map(is_own_output, ("mach", "force_N", "n1_pct", "time_s")))


def test_every_output_topic_of_a_log_is_an_own_output():
    """One that is added later is no explanation of a mount either."""
    topics = [place.topic for place in Topics(("left",), ("left_upper",)).fixed() if place.topic != FAULT_TOPIC]
    assert len(topics) >= 4
    for topic in topics:
        kind, owner = topic.strip("/").split("/")
        assert is_own_output(f"{kind}_anything_n_{owner}"), topic
