"""The longest steady window that ends now, against looking at every window."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.core.steady import SteadyLimits, SteadyWatch, quantities

LEVEL = st.one_of(st.integers(-3, 3).map(float), st.just(float("nan")))


def longest(rows, limits):
    """Every window that ends with the last row, the longest first."""
    for first in range(len(rows)):
        part = rows[first:]
        if np.isfinite(part).all() and (np.ptp(part, axis=0) <= limits).all():
            return len(part)
    return 0


@given(st.lists(st.tuples(LEVEL, LEVEL), min_size=1, max_size=30), st.tuples(st.integers(0, 4), st.integers(0, 4)))
def test_as_if_every_window_were_looked_at(rows, limits):
    watch = SteadyWatch([float(limit) for limit in limits])
    said = [watch.take(row) for row in rows]
    table = np.array(rows)
    assert said == [longest(table[: n + 1], limits) for n in range(len(rows))]


def test_every_engine_is_watched():
    watched = quantities(SteadyLimits(n1_pct=0.7), 3)
    assert [(q.engine, q.limit) for q in watched if q.channel == "n1_pct"] == [(0, 0.7), (1, 0.7), (2, 0.7)]


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_what_is_not_known_is_not_steady(bad):
    watch = SteadyWatch([1.0])
    assert [watch.take([value]) for value in (0.0, 0.5, bad, 0.5, 0.6)] == [1, 2, 0, 1, 2]
