"""Pre-flight: sensors that contradict each other on the ground, each in a line; a whole aircraft is ready."""

import numpy as np
import pytest

from tests.conftest import ROOT, small_aircraft
from thrustd.brochure.deck import Deck
from thrustd.core.types import Estimate, Fault, Reading, Status
from thrustd.onboard.preflight import findings, needed, on_ground

ENGINES = "left", "right"
DECK = Deck.from_json((ROOT / "models" / "brochure" / "jt15d-4.json").read_text(), "jt15d-4.json")
IDLE = {  # medians of ftis_20190312_1014.npz at ground idle
    **{("n1_pct", 0): 29.5, ("n2_pct", 0): 48.5, ("fuel_flow_kg_s", 0): 0.0242},
    **{("n1_pct", 1): 30.3, ("n2_pct", 1): 49.6, ("fuel_flow_kg_s", 1): 0.0236},
}
PITCH_DEG = 1.5
STANDING = {
    ("mach", 0): 0.0,
    ("pitch_deg", 0): PITCH_DEG,
    ("accel_x_g", 0): float(np.sin(np.radians(PITCH_DEG))),
    ("accel_z_g", 0): 1.0,
    ("sat_degC", 0): 15.0,
    ("tat_degC", 0): 15.5,
    **{("n1_pct", e): 0.0 for e in (0, 1)},
    **{("fuel_flow_kg_s", e): 0.0 for e in (0, 1)},
}


def estimate(engine, status=Status.ENGINE_OFF):
    return Estimate(0, engine, 0.0, 4.0, 0.0, *[0.0] * 9, 0.46, int(status))


def heard(readings, *more):
    return [*(Reading(0, *sensor, value) for sensor, value in readings.items()), estimate(0), estimate(1), *more]


def test_a_whole_aircraft_on_the_ground_is_ready():
    assert findings(heard(STANDING), ENGINES) == []


@pytest.mark.parametrize("n1_pct", [0.0, 48.0])
@pytest.mark.parametrize(
    ("sensor", "off"),
    [(("accel_x_g", 0), 0.1), (("accel_z_g", 0), -0.1), (("pitch_deg", 0), 6.0), (("tat_degC", 0), 10.0),
     (("sat_degC", 0), 20.0)],
)  # fmt: skip
def test_sensors_that_contradict_each_other_on_the_ground_are_said(sensor, off, n1_pct):
    running = {("n1_pct", e): n1_pct for e in (0, 1)}
    [line] = findings(heard({**STANDING, **running, sensor: STANDING[sensor] + off}), ENGINES)
    assert "expected within" in line


@pytest.mark.parametrize(("signal", "reads"), [("fuel_flow_kg_s", 0.05), ("n2_pct", 30.0)])
def test_an_engine_that_is_off_burns_nothing_and_turns_no_spool(signal, reads):
    other = {("n1_pct", 0): 48.0, ("n2_pct", 0): 55.0, ("fuel_flow_kg_s", 0): 0.05}
    assert on_ground({**STANDING, **other}, 2) == []
    [line] = on_ground({**STANDING, **other, (signal, 1): reads}, 2)
    assert line.startswith(f"{signal}[1]: off by {reads:g}")


def at_idle(change=(), steps=20):
    """What is found where each of `change` turns a sensor's readings into others."""
    idle = {**STANDING, **IDLE, ("pressure_altitude_m", 0): 0.0}
    readings = [
        Reading(k, *sensor, dict(change).get(sensor, lambda value, _: value)(value, k / steps))
        for k in range(steps)
        for sensor, value in idle.items()
    ]
    return findings([*readings, estimate(0), estimate(1)], ENGINES, deck=DECK)


@pytest.mark.parametrize(
    ("sensor", "factor", "who"),
    [
        (("fuel_flow_kg_s", 0), 0.7, "left: fuel flow"),
        (("fuel_flow_kg_s", 1), 0.7, "right: fuel flow"),
        (("fuel_flow_kg_s", 0), 1.4, "left against right: fuel flow"),
        (("n2_pct", 1), 0.85, "right: N1 against N2"),
        (("n1_pct", 0), 1.3, "left: N1 against N2"),
    ],
)
def test_engine_data_at_idle_that_no_engine_shows_together_are_said(sensor, factor, who):
    assert at_idle() == []
    lines = at_idle({sensor: lambda value, _: factor * value})
    assert any(line.startswith(who) for line in lines)


def test_a_throttle_that_moves_while_it_is_heard_is_no_contradiction():
    """The fuel flow leads the spools by some seconds."""
    assert at_idle({("fuel_flow_kg_s", 0): lambda value, part: value * (1.0 + 0.4 * part)}) == []


def test_what_two_like_engines_have_swapped_at_idle_nobody_can_tell():
    swapped = {(name, e): (lambda _, __, name=name, e=e: IDLE[name, 1 - e]) for name, e in IDLE}
    for name in ("n1_pct", "n2_pct", "fuel_flow_kg_s"):
        assert at_idle({key: change for key, change in swapped.items() if key[0] == name}) == []


def test_what_is_swapped_shows_where_one_engine_runs_alone():
    off = {(name, 1): lambda *_: 0.0 for name in ("n1_pct", "n2_pct", "fuel_flow_kg_s")}
    assert at_idle(off) == []
    for name in ("n1_pct", "n2_pct", "fuel_flow_kg_s"):
        swapped = {(name, 0): lambda *_: 0.0, (name, 1): lambda *_, name=name: IDLE[name, 0]}
        assert any(name in line for line in at_idle({**off, **swapped}))


def test_an_aircraft_that_moves_is_not_judged_as_if_it_stood():
    wrong = {**STANDING, ("accel_x_g", 0): 0.3, ("tat_degC", 0): 40.0}
    assert on_ground({**wrong, ("mach", 0): 0.3}, 2) == []


def test_brakes_that_were_pushed_for_a_moment_are_no_contradiction():
    braked = [Reading(k, "accel_x_g", 0, -0.2 if k < 3 else STANDING["accel_x_g", 0]) for k in range(10)]
    assert findings(heard(STANDING, *braked), ENGINES) == []


def test_what_was_reported_and_goes_on_is_said_and_what_is_over_is_not():
    faults = [
        Fault(0, "adc", "silent"),
        Fault(1, "left_upper", "zero_refused"),
        Fault(1, "left", "zero"),
        Fault(2, "right_lower", "stuck"),
        Fault(3, "right_lower", "stuck", active=False),
    ]
    lines = findings(heard(STANDING, *faults), ENGINES)
    assert [line.split(": ")[:2] for line in lines] == [["adc", "silent"], ["left_upper", "zero_refused"]]


def test_an_engine_whose_sources_disagree_or_that_nobody_hears_is_not_ready():
    disagree = estimate(0, Status.DISAGREE | Status.TRANSIENT)
    assert findings(heard(STANDING, disagree), ENGINES) == ["left: disagree"]
    assert findings([estimate(0)], ENGINES) == ["right: no estimate"]


def test_a_wire_that_errs_again_and_again_is_said_and_its_first_bytes_are_not():
    cut = Fault(0, "adc", "damaged")
    contested = [Fault(t_s * 1_000_000_000, "can[Mach]", "contested") for t_s in range(5)]
    lines = findings(heard(STANDING, cut, *contested), ENGINES)
    assert [line.split(": ")[:2] for line in lines] == [["can[Mach]", "contested"]]


@pytest.mark.parametrize("sensor", [("n1_pct", 0), ("mach", 0), ("pitch_deg", 0), ("fuel_flow_kg_s", 1)])
def test_a_sensor_that_never_spoke_is_said(sensor):
    spoken = {**dict.fromkeys(needed(small_aircraft()), 0.0), **STANDING}
    assert sensor in spoken
    assert findings(heard(spoken), ENGINES, needed(small_aircraft())) == []
    silent = {other: value for other, value in spoken.items() if other != sensor}
    assert findings(heard(silent), ENGINES, needed(small_aircraft())) == [f"{sensor[0]}[{sensor[1]}]: no reading"]


def test_sensors_that_never_spoke_are_one_line():
    [line] = findings(heard(STANDING), ENGINES, [("n1_pct", 0), ("roll_rate_deg_s", 0), ("n2_pct", 1)])
    assert line == "roll_rate_deg_s[0], n2_pct[1]: no reading"


def test_what_an_engine_lacks_that_runs_is_said():
    assert findings(heard(STANDING, estimate(0, Status.BROCHURE_LOST)), ENGINES) == ["left: brochure lost"]
    assert findings(heard(STANDING, estimate(0, Status.BROCHURE_LOST | Status.ENGINE_OFF)), ENGINES) == []


def test_wires_that_are_silent_are_heard(tmp_path):
    from thrustd.onboard.preflight import hear

    lines = findings(hear(small_aircraft(), 0.5), ENGINES)
    assert lines and all(": " in line for line in lines)
