"""The pyramid: whatever the window, no extreme is lost and no bucket invents one."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.workbench.pyramid import BASE, FACTOR, build, level_sizes, zoom


def column(n, seed=0):
    return np.random.default_rng(seed).standard_normal(n)


@settings(deadline=None)
@given(st.integers(1, 40_000), st.integers(50, 1500), st.integers(0, 10_000), st.data())
def test_extremes_of_any_window_are_kept(n, buckets, seed, data):
    values = column(n, seed)
    start = data.draw(st.integers(0, n - 1))
    stop = data.draw(st.integers(start + 1, n))
    found = zoom(values, build(values), start, stop, buckets)
    low, high = np.float32(found.low).min(), np.float32(found.high).max()
    part, whole = np.float32(values[start:stop]), np.float32(values)
    assert len(found.first) <= 2 * buckets
    assert whole.min() <= low <= part.min() and part.max() <= high <= whole.max()


def test_one_sample_outlier_is_seen_at_every_zoom():
    values = column(1_000_000)
    values[654_321] = 99.0
    levels = build(values)
    for half in (500_000, 200_000, 50_000, 5_000, 500):
        found = zoom(values, levels, max(0, 654_321 - half), min(len(values), 654_321 + half), 1000)
        assert found.high.max() == 99.0


def test_few_samples_come_as_they_are():
    values = column(5000)
    found = zoom(values, build(values), 1000, 1100, 1000)
    assert found.raw
    assert np.array_equal(found.low, values[1000:1100])


def test_buckets_are_of_equal_length_within_a_quarter():
    values = column(300_001)
    for start, stop in ((0, 300_001), (17, 200_000), (100_000, 140_000)):
        lengths = np.diff(zoom(values, build(values), start, stop, 700).first)
        assert lengths.max() <= 1.5 * lengths.min()


def test_missing_values_do_not_spread():
    values = column(10_000)
    values[4010:4060] = np.nan
    found = zoom(values, build(values), 0, 10_000, 100)
    assert np.isfinite(found.low).all()
    values[:] = np.nan
    assert np.isnan(zoom(values, build(values), 0, 10_000, 100).low).all()


def test_levels_hold_what_they_say():
    for n in (1, BASE - 1, BASE, BASE + 1, BASE * FACTOR**3 + 5):
        assert build(column(n)).shape == (2, sum(level_sizes(n)))
