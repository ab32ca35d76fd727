"""The most that anybody could know of a drift, on rows that hold it and on rows that do not."""

import numpy as np
import pytest

from benchmarks.drift_bound import nats
from tests.sensors.test_evidence import INSTALLED, SHARE, flown
from thrustd.sensors.past import COUNTS, N_SOURCES, SAID, T_S

PARTS = (SHARE, 1.0 - SHARE, 1.0, 1.0, 1.0)
RATE_N_S = np.array([1.0, 1.2, 0.0, 0.0, 0.0])  # of both mounts


def told(rows, silent=()):
    """ln ratio without the drift in what rows say, and with it."""
    rows, done_n = rows.copy(), np.outer(np.maximum(rows[:, T_S] - 300.0, 0.0), RATE_N_S)
    rows[:, [COUNTS + i for i in silent]] = 0.0
    well = nats(rows, PARTS, INSTALLED, done_n)
    rows[:, SAID : SAID + N_SOURCES] += done_n
    return well, nats(rows, PARTS, INSTALLED, done_n)


@pytest.fixture(scope="module")
def rows():
    *_, (rows, n) = flown(lambda _: np.zeros(N_SOURCES))
    return rows[:n]


def test_a_drift_that_is_there_is_likelier_by_as_much_as_one_that_is_not_is_unlikelier(rows):
    """Both are d' A d / 2, and d' A e on top, which the rows' errors e make of either: it is small here."""
    well, drifts = told(rows)
    assert well < -10.0 < 10.0 < drifts
    assert drifts == pytest.approx(-well, rel=0.3)


def test_who_hears_no_brochure_tells_a_drift_of_both_mounts_from_no_thrust(rows):
    _, alone = told(rows, silent=(2, 3, 4))
    _, heard = told(rows)
    assert abs(alone) < 0.1 * heard
