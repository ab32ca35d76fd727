"""The campaign's short form, on a scripted flight: never confidently wrong. The long one is `make integrity`."""

import pytest

from benchmarks.fusion_flights import fly_through, installation
from benchmarks.integrity import SILENT_S, campaign
from benchmarks.integrity_cases import AIRCRAFT, CASES, HEALTHY
from benchmarks.integrity_flight import on_the_wire
from benchmarks.integrity_wires import MOMENTS, WIRES
from thrustd.twin.flight import scripted_flight

SECONDS, SEED, JOBS = 700.0, 34, 2
FLOWN = {
    ("one LVDT -10 %", "take-off roll"),
    ("both -10 %", "take-off roll"),
    ("accel_x halves", "take-off roll"),
    ("both step +0.1 mm", "cruise"),
    ("both halve", "cruise"),
    ("both LVDTs of an engine drift -0.02 mm/min", "cruise"),
    ("one LVDT +0.1 mm", "throttle up"),
    ("accel_x turns its sign", "cruise"),
    ("fuel flow drifts 5 %/min", "cruise"),
    ("ADC clock 1 % slow", "cruise"),
    ("ADC clock 3 % fast", "cruise"),
    ("Mach freezes", "take-off roll"),
    ("crosstalk of 15 % between the engines", "begin"),
    ("hostile: nacelle drag 0.04 m2", "begin"),
    ("hostile: zero -0.03 mm", "begin"),
}
BROKEN = sorted({case.fault for case in WIRES})  # each once, at one of three moments
FLOWN |= {(fault, MOMENTS[i % len(MOMENTS)]) for i, fault in enumerate(BROKEN)}
JUMPS = {"both step +0.1 mm", "both halve", "one LVDT +0.1 mm", "accel_x turns its sign"}


@pytest.fixture(scope="module")
def rows():
    place, found = installation(), []
    flown = on_the_wire(place, *scripted_flight(SECONDS, SEED), SEED)
    cases = [
        case for case in (HEALTHY, *CASES, *WIRES, *AIRCRAFT) if (case.fault, case.moment) in FLOWN or case is HEALTHY
    ]
    campaign(place, flown, cases, JOBS, found.append)
    return found


def test_no_fault_is_confidently_wrong_for_longer_than_five_seconds(rows):
    assert {(row.fault, row.moment) for row in rows} >= FLOWN
    assert {row.fault: row.longest_s for row in rows if row.longest_s > SILENT_S} == {}


def test_a_broken_wire_is_told_and_the_flight_goes_on_and_recovers(rows):
    broken = [row for row in rows if row.fault in BROKEN]
    assert len(broken) == len(BROKEN)
    assert [row for row in broken if row.named_s is None or row.told_s is None or not row.over] == []
    assert [row for row in broken if row.pause_s > 0.2] == [row for row in broken if row.fault == "queue overrun"]
    assert [row for row in broken if row.pause_s > 2.2 or row.in_band_pct < 80.0 or row.after_sigmas > 3.0] == []


def test_what_jumps_is_named_at_once_and_nobody_else(rows):
    jumps = [row for row in rows if row.fault in JUMPS]
    assert len(jumps) == len(JUMPS)
    assert all(row.named_s is not None and row.named_s <= 3.0 and not row.wrongly_excluded for row in jumps)


def test_a_crystal_that_is_off_is_named_and_neither_a_sensor_nor_a_silent_wire(rows):
    clocks = [row for row in rows if row.fault.startswith("ADC clock")]
    assert [(row.first, row.wrongly_excluded) for row in clocks] == [("adc_clock rate", [])] * 2
    assert all(row.named_s is not None and row.named_s < 5.0 and row.in_band_pct > 99.0 for row in clocks)


def test_a_mach_number_that_freezes_in_the_roll_is_named_and_costs_no_thrust(rows):
    frozen = next(row for row in rows if row.fault == "Mach freezes")
    assert frozen.named_s is not None and frozen.named_s < 30.0 and not frozen.wrongly_excluded
    assert abs(frozen.bias_n) < 100.0 and frozen.in_band_pct > 95.0  # 2 kN when the brochure was trusted


def test_a_healthy_aircraft_keeps_its_sensors_and_its_thrust(rows):
    healthy = next(row for row in rows if row.fault == "healthy")
    assert not healthy.wrongly_excluded
    assert healthy.rms_n < 60.0 and healthy.in_band_pct > 95.0


def test_an_installation_that_errs_is_inside_the_band_or_flagged(rows):
    assert all(row.in_band_pct > 90.0 for row in rows if row.fault.startswith("hostile"))


@pytest.mark.parametrize(("seed", "seconds"), [(3, 520.0), (7, 345.0)])
def test_a_plain_flight_off_the_fitted_deck_excludes_nobody(seed, seconds):
    """Engines whose spool lines lie 8 to 13 % beside the deck's, where it was not fitted."""
    flown = fly_through(installation(), "scripted", None, seed, seconds)
    assert [(f.where, f.kind) for f in flown.faults if f.kind != "zero"] == []
