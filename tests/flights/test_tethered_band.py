"""What a tethered static run is worth in flight: the band of an aircraft whose zeros and gains were measured."""

import numpy as np
import pytest

from benchmarks.fusion_flights import EVERY, installation, outputs_of
from benchmarks.integrity_flight import on_the_wire, whole
from thrustd.core.calibration import Calibration, MountCalibration, Zero, write_calibration
from thrustd.twin.airframe import MOUNTS
from thrustd.twin.flight import scripted_flight

SECONDS, SEED = 170.0, 34
DAY = "2026-11-22"


def measured():
    """As `thrustd calibrate tether` writes it: zeros within 1.2 um, gains within 0.45 %, growth within 0.16 um/K."""
    zeros = (Zero(on=DAY, mm=0.0, std_mm=0.0012),)
    mount = MountCalibration(zeros=zeros, gain=1.0, gain_std=0.0045, expansion_std_mm_k=1.6e-4)
    return write_calibration(Calibration(on=DAY, tethered=DAY, mount=dict.fromkeys(MOUNTS, mount)))


@pytest.fixture(scope="module")
def flights():
    """(error, sigma, Mach) of both engines, as shipped and as measured."""
    shipped, found = installation(), []
    flown = on_the_wire(shipped, *scripted_flight(SECONDS, SEED), SEED)
    for place in (shipped, shipped.calibrated_by(measured())):
        estimates, _ = outputs_of(place.pipeline(), whole(flown, 0, len(flown.wire.t_ns)), every=EVERY)
        rows = []
        for side, mine in zip(("left", "right"), estimates, strict=True):
            time_s = np.array([e.t_ns for e in mine]) * 1e-9
            truth_n, mach = (np.interp(time_s, flown.profile.time_s, flown.profile[name])
                             for name in (f"thrust_N_{side}", "mach"))  # fmt: skip
            rows.append((np.array([e.thrust_n for e in mine]) - truth_n, [e.thrust_std_n for e in mine], mach))
        found.append(np.concatenate([np.array(row) for row in rows], axis=1))
    return found


def test_on_the_ground_it_narrows_the_band_by_two_fifths_and_keeps_the_truth_inside(flights):
    """What is left is for the most part the brochure's: it alone would see both mounts of an engine fail."""
    shipped, tethered = (flight[:, (flight[2] < 0.2) & (flight[1] < 1000.0)] for flight in flights)
    assert tethered[1].mean() < 0.6 * shipped[1].mean()
    assert np.mean(np.abs(tethered[0]) < 1.96 * tethered[1]) > 0.95


def test_in_the_air_the_drag_that_nobody_measured_is_left(flights):
    shipped, tethered = (flight[:, flight[2] > 0.25] for flight in flights)
    assert shipped.shape[1] > 100
    assert tethered[1].mean() < shipped[1].mean()
    assert np.mean(np.abs(tethered[0]) < 1.96 * tethered[1]) > 0.95
