"""In flight a test point is told by the rule of the ground, second by second, whatever arrives."""

import numpy as np

from thrustd.core.steady import SteadyLimits
from thrustd.core.types import Fault, Reading
from thrustd.sinks.live_point import LivePoint

CHANNELS = (("mach", 0, 0.3), ("pressure_altitude_m", 0, 3000.0), ("n1_pct", 0, 70.0), ("n1_pct", 1, 71.0),
            ("accel_x_g", 0, 0.05), ("accel_z_g", 0, 1.0))  # fmt: skip
HZ = 10


def fly(point, seconds, start_s=0.0, off=None, without=()):
    """Steady readings, `off` (channel, index) -> added; -> steady seconds after each."""
    said = []
    for second in np.arange(start_s, start_s + seconds):
        for tick in range(HZ):
            t_ns = round((second + tick / HZ) * 1e9)
            for name, index, value in CHANNELS:
                if (name, index) not in without:
                    point.write_output(Reading(t_ns, name, index, value + (off or {}).get((name, index), 0.0)))
        said.append(point.steady_s)
    return said


def test_seconds_are_counted_and_told():
    point = LivePoint(2)
    assert point.due_s == 30.0
    assert fly(point, 40)[-1] >= 38 and point.due_s == 0.0
    assert "a test point" in point.words()
    fly(point, 12, 40.0, {("n1_pct", 1): 2.0})  # one engine moves: a new window
    assert 8 <= point.steady_s <= 12 and "a point in" in point.words()


def test_silence_bad_values_and_engines_off_break_it():
    for without, off in (
        ((("mach", 0),), None),
        ((), {("accel_z_g", 0): float("nan")}),
        ((), {("n1_pct", 0): -70.0}),
    ):
        point = LivePoint(2)
        fly(point, 20)
        assert point.steady_s > 15
        assert fly(point, 5, 20.0, off, without)[-1] == 0 and point.words() == ""


def test_a_bus_that_falls_silent_ends_the_point_while_faults_are_told():
    point = LivePoint(2)
    fly(point, 20)
    for second in range(20, 24):
        point.write_output(Fault(second * 1_000_000_000, "can", "silent"))
    assert point.steady_s == 0 and point.words() == ""


def test_a_gap_breaks_it_and_strange_outputs_do_nothing():
    point = LivePoint(2, SteadyLimits(least_s=10.0))
    fly(point, 20)
    point.write_output(Fault(0, "x", "y"))
    point.write_output(Reading(0, "n1_pct", 9, 1.0))
    assert fly(point, 3, 60.0)[-1] <= 3
