"""A rate beside a clock: what the clock leaves out stays out, and what it contradicts is refused."""

from itertools import product

import numpy as np
import pytest

from thrustd.core.errors import RecordingError
from thrustd.records.clock import at_rate

RATE_HZ = 20.0
N = 4000
EVEN_S = np.arange(N) / RATE_HZ
LATE_S = np.random.default_rng(3).uniform(0.0, 0.02, N)
KEPT = np.sort(np.random.default_rng(4).permutation(N)[: N * 4 // 5])

# a clock of 4000 rows, true at 20 Hz, that hides nothing
HONEST = {
    "even": EVEN_S,
    "trembles": EVEN_S + LATE_S,
    "rounded to 0.1 s": np.floor(EVEN_S * 10 + 1e-9) / 10,
    "rounded to 10 s": np.floor(EVEN_S / 10) * 10,
    "in bursts of 64": EVEN_S[np.minimum(np.arange(N) // 64 * 64 + 63, N - 1)],
    "one stamp late": EVEN_S + np.where(np.arange(N) == 900, 0.04, 0.0),
    "half a per cent fast": EVEN_S * 0.995,
    "half a per cent slow": EVEN_S * 1.005,
    "since 1970": EVEN_S + 1.7e9,
    "some values missing": np.where(np.arange(N) % 7 == 3, np.nan, EVEN_S),
}


@pytest.mark.parametrize("clock", HONEST)
def test_a_clock_that_trembles_is_replaced_with_a_word(clock):
    time_s, (word,) = at_rate("rig.csv", HONEST[clock], N, RATE_HZ)
    assert np.array_equal(time_s, EVEN_S) and "hole" not in word and "replaced by 20 as asked for" in word


@pytest.mark.parametrize(
    ("clock", "rate_hz"),
    [*product(HONEST, [10.0, 15.0, 25.0, 40.0]), *product(["even", "trembles", "rounded to 0.1 s"], [19.5, 20.5])],
)
def test_a_rate_that_the_clock_contradicts_over_the_record_is_refused(clock, rate_hz):
    with pytest.raises(RecordingError, match=f"{rate_hz:g} rows a second were asked for, its time_s has .*; expected"):
        at_rate("rig.csv", HONEST[clock], N, rate_hz)


def test_what_a_coarse_clock_says_is_its_rows_over_its_span():
    with pytest.raises(RecordingError, match=r"has 4000 rows in 199\.9 s, 20\.01 a second; expected one of both"):
        at_rate("rig.csv", HONEST["rounded to 0.1 s"], N, 10.0)


@pytest.mark.parametrize("clock", ["even", "trembles", "rounded to 0.1 s", "since 1970"])
def test_a_hole_stays_a_hole(clock):
    kept = np.flatnonzero((EVEN_S < 50.0) | (EVEN_S >= 80.0))
    time_s, (word,) = at_rate("rig.csv", HONEST[clock][kept], len(kept), RATE_HZ)
    assert time_s == pytest.approx(EVEN_S[kept], abs=0.051) and "its hole of 30" in word
    assert np.count_nonzero(np.diff(time_s) > 1.0) == 1


@pytest.mark.parametrize("clock", ["even", "trembles"])
def test_rows_that_are_missing_here_and_there_are_missing_still(clock):
    time_s, (word,) = at_rate("rig.csv", HONEST[clock][KEPT], len(KEPT), RATE_HZ)
    assert time_s == pytest.approx(EVEN_S[KEPT] - EVEN_S[KEPT[0]]) and "holes" in word
    with pytest.raises(RecordingError, match="16 rows a second were asked for, its time_s has 20"):
        at_rate("rig.csv", EVEN_S[KEPT], len(KEPT), 16.0)


def test_a_clock_that_goes_back_is_refused():
    with pytest.raises(RecordingError, match=r"time_s = 0\.0 in data row 2001 follows 99\.95; expected a clock that"):
        at_rate("rig.csv", np.where(EVEN_S < 100.0, EVEN_S, EVEN_S - 100.0), N, RATE_HZ)


@pytest.mark.parametrize("clock", ["even", "trembles", "half a per cent fast"])
def test_a_row_that_was_written_twice_is_refused(clock):
    twice = np.sort(np.append(np.arange(N), 600))
    with pytest.raises(RecordingError, match=r"in data row 602 is a row more than its clock has room for; expected"):
        at_rate("rig.csv", HONEST[clock][twice], len(twice), RATE_HZ)


@pytest.mark.parametrize("clock", [None, np.full(N, 3.0), np.full(N, np.nan)])
def test_where_no_clock_goes_the_rate_alone_counts(clock):
    assert np.array_equal(at_rate("rig.csv", clock, N, RATE_HZ)[0], EVEN_S)
