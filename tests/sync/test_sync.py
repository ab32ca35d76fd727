"""Readings on the step grid, and the ADC's clock on ours."""

from math import isnan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Reading
from thrustd.sync.align import to_ns
from thrustd.sync.hold import Hold
from thrustd.sync.memory import CLOCK

MS = 1_000_000


def test_a_reading_holds_until_it_is_stale():
    hold = Hold([("n1_pct", 0), ("n1_pct", 1)])
    assert hold.take(Reading(0, "n1_pct", 1, 80.0)) is None
    stale_ns = round(CATALOGUE["n1_pct"].stale_after_s * 1e9)
    assert hold.value(stale_ns, "n1_pct", 1) == 80.0
    assert isnan(hold.value(stale_ns + 1, "n1_pct", 1))
    assert isnan(hold.value(0, "n1_pct", 0))


def test_going_stale_and_coming_back_is_told_once():
    hold = Hold([("n1_pct", 0)])
    hold.take(Reading(0, "n1_pct", 0, 80.0))
    assert [(f.kind, f.active) for _, f in hold.changes(1000 * MS)] == [("stale", True)]
    assert hold.changes(1100 * MS) == []
    hold.take(Reading(1200 * MS, "n1_pct", 0, 80.0))
    assert [(f.kind, f.active) for _, f in hold.changes(1200 * MS)] == [("stale", False)]


@pytest.mark.parametrize(("signal", "value"), [("n1_pct", 300.0), ("mach", 1.3), ("accel_z_g", -40.0)])
def test_a_value_outside_the_catalogue_is_a_fault_and_does_not_count(signal, value):
    hold = Hold([(signal, 0)])
    fault = hold.take(Reading(5, signal, 0, value))
    assert fault is not None
    assert (fault.kind, fault.where) == ("out_of_range", f"{signal}[0]")
    assert isnan(hold.value(5, signal))


@given(st.lists(st.integers(0, 20_000_000), min_size=2, max_size=200), st.floats(-90e-6, 90e-6))
def test_sample_times_are_steady_however_late_the_bytes_are(delays_ns, drift):
    clock, before_ns = np.zeros(1, CLOCK), None
    for k, delay_ns in enumerate(delays_ns):
        true_ns = 7_000_000_000 + k * 10 * MS
        device_us = round(k * 10_000 * (1 + drift))
        t_ns = to_ns(clock, true_ns + delay_ns, device_us)
        assert t_ns <= true_ns + delay_ns
        assert t_ns >= true_ns - 20_000  # never earlier than the sample, but for the crystal and rounding
        if before_ns is not None:
            assert abs(t_ns - before_ns) <= 30 * MS
        before_ns = t_ns


@pytest.mark.parametrize("off", [-0.05, -0.01, 0.003, 0.01, 0.05])
def test_a_crystal_that_is_off_is_estimated_and_its_samples_stay_on_time(off):
    """`off`: the ADC's clock runs slow by so much, and so do its samples; a reader stalls now and then."""
    clock, rng, late_ms = np.zeros(1, CLOCK), np.random.default_rng(2), []
    for k in range(6000):
        true_ns = 7_000_000_000 + round(k * 10 * MS * (1 + off))
        delay_ns = round(rng.exponential(80_000)) + (6 * MS if rng.random() < 0.01 else 0)
        t_ns = to_ns(clock, true_ns + delay_ns, k * 10_000)
        if k > 3000:
            late_ms.append((t_ns - true_ns) / MS)
    assert clock["rate"].item() == pytest.approx(off, rel=0.01)
    assert min(late_ms) > -0.2 and max(late_ms) < 1.0
