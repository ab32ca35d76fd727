"""The most that anybody could know of a drift, on rows that hold it and on rows that do not."""

import numpy as np
import pytest

from benchmarks.drift_bound import Drift, nats
from benchmarks.drift_looks import LOOKS, Look, Rows, errors_of, heard, own_errors
from tests.sensors.test_evidence import INSTALLED, SHARE, flown
from thrustd.sensors.onsets import MOUNTS_OFF, UPPER_OFF
from thrustd.sensors.past import ALONG_G, COUNTS, N_SOURCES, SAID

ONSET_S = 300.0
BOTH = Drift(ONSET_S, np.array([1.0, 1.2, 0.0, 0.0, 0.0]), np.zeros(N_SOURCES), MOUNTS_OFF)
UPPER = Drift(ONSET_S, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0, 0.0, 0.0]), UPPER_OFF)


def told(rows, drift=BOTH, silent=()):
    """By nobody's drift in what rows say, and by it: ln ratio to all well, lead over the rival."""
    rows = rows.copy()
    rows[:, [COUNTS + i for i in silent]] = 0.0
    seen = Rows(rows, SHARE)
    done_n = drift.done_n(rows) * heard(seen)
    said_n = rows[:, SAID : SAID + N_SOURCES].ravel() * heard(seen)
    errors = own_errors(seen, INSTALLED)
    return nats(errors, said_n, done_n), nats(errors, said_n + done_n[0], done_n)


def expected(rows, look, drift=BOTH):
    """ln ratio that a look finds when nothing but the drift is in what it sees."""
    seen = Rows(rows, SHARE)
    errors = errors_of(look, seen, seen, INSTALLED)
    done_n = drift.done_n(rows)
    seen_n = np.zeros((len(done_n), len(errors)))
    seen_n[:, : done_n.shape[1]] = done_n
    return nats(errors, seen_n[0], seen_n)[0]


@pytest.fixture(scope="module")
def rows():
    *_, (rows, n) = flown(lambda _: np.zeros(N_SOURCES))
    return rows[:n]


def test_a_drift_that_is_there_is_likelier_by_as_much_as_one_that_is_not_is_unlikelier(rows):
    """Both are d' A d / 2, and d' A e on top, which the rows' errors e make of either: it is small here."""
    (well, _), (drifts, _) = told(rows)
    assert well < -10.0 < 10.0 < drifts
    assert drifts == pytest.approx(-well, rel=0.3)


def test_who_hears_no_brochure_tells_a_drift_of_both_mounts_from_no_thrust(rows):
    _, (alone, _) = told(rows, silent=(2, 3, 4))
    _, (heard_too, _) = told(rows)
    assert abs(alone) < 0.1 * heard_too


def test_that_one_of_two_mounts_drifts_their_difference_tells_and_which_of_them_the_brochure(rows):
    _, (drifts, leads) = told(rows, UPPER)
    _, (alone, nobody) = told(rows, UPPER, silent=(2, 3, 4))
    assert alone == pytest.approx(drifts, rel=0.3)
    assert nobody < 0.1 * leads < leads < drifts


def test_every_look_sees_more_than_the_sources_alone(rows):
    rolling = rows.copy()
    rolling[:, ALONG_G] = 0.2
    alone, *more = (expected(rolling, look) for look in LOOKS)
    assert all(each > alone for each in more)
    assert more[0] < more[1] < more[2]  # the more the decks are alike
    assert more[3] < more[4]  # the better mass and drag are known


def test_who_knows_neither_mass_nor_drag_sees_nothing_more_in_the_body_acceleration(rows):
    rolling = rows.copy()
    rolling[:, ALONG_G] = 0.2
    alone = expected(rolling, LOOKS[0])
    assert expected(rolling, Look("f_x", mass=10.0, drag_n=1e5, drag_s=1.0)) == pytest.approx(alone, rel=1e-3)
