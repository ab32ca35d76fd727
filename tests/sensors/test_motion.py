"""The aircraft's own acceleration: a thrust that is lost moves it, a sensor that fails does not."""

import numpy as np
import pytest
from msgspec.structs import replace

from tests.sensors.test_evidence import INSTALLED, SHARE, flown
from tests.sensors.test_monitor import CITATION
from thrustd.sensors import evidence, onsets
from thrustd.sensors.motion import LIES, SILENT, Motion, agree, all_moves, motion_of, moves
from thrustd.sensors.past import (
    ALONG_G,
    BY_MOTION_N,
    COUNTS,
    FUEL_FLOW,
    LEVEL_N,
    MACH,
    MOVES,
    N_SOURCES,
    OTHERS_STD_N,
    SAID,
    SHAKES_N,
    T_S,
    WIDTH,
    no_past,
)

WEIGHT_N = 54_500.0
MOTION = Motion(WEIGHT_N, 0.15, 30.0)
MOUNTS = np.array((SHARE, 1 - SHARE, 0.0, 0.0, 0.0))
BEGINS_S = 300.0


def weighed(lost_n, moved_n):
    """Probabilities without it and with it, 3 s after both mounts of an engine showed less, and the aircraft too."""
    out, heard = np.zeros((onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD)
    for rows, n in flown(lambda t_s: -lost_n * (t_s > BEGINS_S) * MOUNTS, BEGINS_S + 3.0):
        rows[:n, MACH], rows[:n, MOVES], rows[:n, SHAKES_N] = 0.4, 1.0, 120.0
        rows[:n, BY_MOTION_N] = -1500.0 - moved_n * (rows[:n, T_S] > BEGINS_S)  # less drag
        rows[:n, ALONG_G] = (rows[:n, BY_MOTION_N] + 3000.0) / WEIGHT_N
    evidence.weigh(rows, n, SHARE, onsets.WELL, INSTALLED, heard[0], out)
    out[onsets.N_ALONE :, 0] = 0.0
    alone = out[:, 0].copy()
    again = np.empty((onsets.N_ALONE, 3))
    evidence.evidence(rows, n, SHARE, onsets.WELL, INSTALLED, MOTION, again)
    agree(again[:, 0], all_moves(rows, n, SHARE, INSTALLED, 2, MOTION), heard[0], 0.0, out)
    assert out[:, 0].sum() == pytest.approx(1.0)
    return alone, out[:, 0]


@pytest.mark.parametrize("lost_n", [1500.0, -1500.0, 2800.0])
def test_a_thrust_that_is_lost_is_not_excluded_where_the_aircraft_shows_it(lost_n):
    alone, told = weighed(lost_n, lost_n)
    assert alone[onsets.MOUNTS_OFF] > 0.98  # as if nobody looked
    assert told[onsets.BROCHURE_OFF] > 0.1 and told[onsets.MOUNTS_OFF] < 0.9


@pytest.mark.parametrize("lost_n", [1500.0, -1500.0, 2800.0])
def test_mounts_that_fail_move_no_aircraft(lost_n):
    alone, told = weighed(lost_n, 0.0)
    assert told[onsets.MOUNTS_OFF] > alone[onsets.MOUNTS_OFF] > 0.98
    assert told[onsets.BROCHURE_OFF] < 1e-3


def test_it_may_lie_and_makes_no_hypothesis_likelier_than_another_by_more_than_that():
    for moved_n in (1500.0, 1e4, -1e4, 1e6):
        alone, told = weighed(1500.0, moved_n)
        alive = alone[: onsets.N_ALONE] > 0.0
        odds = np.log(told[: onsets.N_ALONE][alive] / alone[: onsets.N_ALONE][alive])
        assert np.ptp(odds) < -np.log(LIES) + 1e-6


def test_what_it_said_most_clearly_holds_while_the_doubt_lasts():
    heard, out, n = np.zeros(1, onsets.HEARD)[0], np.ones((onsets.N_HYPOTHESES, 3)), onsets.N_ALONE
    agree(np.where(np.arange(n) == onsets.MOUNTS_OFF, -5.0, 0.0), -3.0, heard, 0.0, out)
    clear = out[:, 0].copy()
    out[:, 0] = 1.0
    agree(np.zeros(n), 0.0, heard, 0.0, out)  # its rows have thinned
    assert out[:, 0] == pytest.approx(clear)
    assert clear[onsets.MOUNTS_OFF] / clear[onsets.BROCHURE_OFF] == pytest.approx(np.exp(-5.0))


def test_an_accelerometer_at_fault_may_show_anything_and_all_transducers_move_no_aircraft():
    n, shares = onsets.N_ALONE, {}
    for odds in (20.0, -20.0):
        heard, out = np.zeros(1, onsets.HEARD)[0], np.ones((onsets.N_HYPOTHESES, 3))
        agree(np.where(np.arange(n) == onsets.BROCHURE_OFF, 0.0, -5.0), -5.0, heard, odds, out)
        shares[odds] = out[onsets.ACCELERATION_OFF, 0] / out[onsets.AIR_OFF, 0]
    assert shares[20.0] == pytest.approx(1.0) and shares[-20.0] == pytest.approx(np.exp(-5.0))


def slammed(mounts_move, brochures_move):
    """(rows, n) of an engine 4 s after its throttle was closed and the other's, by who shows it; the aircraft does."""
    closed = lambda t_s: -2400.0 * np.clip((t_s - BEGINS_S) / 3.0, 0.0, 1.0)  # noqa: E731
    shown = mounts_move * MOUNTS + brochures_move * (1.0 - (MOUNTS > 0.0))
    for rows, n in flown(lambda t_s: closed(t_s) * shown, BEGINS_S + 4.0):
        rows[:n, MACH], rows[:n, MOVES], rows[:n, SHAKES_N] = 0.4, 1.0, 120.0
        lost_n = closed(rows[:n, T_S])
        rows[:n, ALONG_G] = (3000.0 + 2.0 * lost_n) / WEIGHT_N
        rows[:n, OTHERS_STD_N] = 0.5 * (mounts_move - brochures_move) * lost_n
        others_n = 3000.0 + 0.5 * (mounts_move + brochures_move) * lost_n
        rows[:n, BY_MOTION_N] = rows[:n, ALONG_G] * WEIGHT_N - others_n
    return rows, n


def test_the_motion_tells_what_failed_on_all_engines():
    """By what the engines show together, half of which was lost where each had the other's doubt."""
    assert all_moves(*slammed(1.0, 0.0), SHARE, INSTALLED, 2, MOTION) < np.log(1e-2)  # all brochures stood still
    assert all_moves(*slammed(0.0, 1.0), SHARE, INSTALLED, 2, MOTION) > np.log(1e2)  # all transducers did
    rows, n = slammed(1.0, 0.0)
    rows[:, MOVES] = 0.0
    assert all_moves(rows, n, SHARE, INSTALLED, 2, MOTION) == pytest.approx(0.0, abs=0.1)


def pasts(mounts_n, fuel_n):
    """Two engines of one row each; the other one's mounts and fuel flow say this."""
    past = no_past(2)
    past["n"] = 1
    for e, (both_n, flow_n) in enumerate(((3000.0, 3000.0), (mounts_n, fuel_n))):
        row = past["rows"][e, 0]
        row[SAID : SAID + 2], row[SAID + FUEL_FLOW :][:3] = both_n / 2.0, flow_n
        row[COUNTS : COUNTS + N_SOURCES], row[LEVEL_N] = 1.0, flow_n
    return past


def row_at(mach, along_g, past, motion=MOTION, trusted=True):
    row = np.zeros(WIDTH)
    row[MACH], row[ALONG_G] = mach, along_g
    row[SAID : SAID + N_SOURCES] = past["rows"][0, 0, SAID : SAID + N_SOURCES]
    moves(past, 0, row, motion, trusted)
    return row


def test_it_counts_in_flight_and_while_no_brake_explains_it():
    past = pasts(3000.0, 3000.0)
    assert row_at(0.4, -0.05, past)[MOVES] == 1.0 and row_at(0.0, 0.3, past)[MOVES] == 1.0
    for row in (
        row_at(0.0, 0.0, past),  # brakes hold it
        row_at(0.1, -0.3, past),  # they stop it
        row_at(0.4, 0.0, past, trusted=False),
        row_at(0.4, 0.0, past, motion=SILENT),
    ):
        assert row[MOVES] == 0.0


def test_the_other_engine_is_between_what_its_mounts_and_its_brochure_say():
    row = row_at(0.4, 0.1, pasts(5000.0, 3000.0))
    assert row[BY_MOTION_N] == pytest.approx(0.1 * WEIGHT_N - 4000.0) and row[OTHERS_STD_N] == pytest.approx(1000.0)
    past = pasts(5000.0, 3000.0)
    past["rows"][1, 0, COUNTS] = 0.0
    row = row_at(0.4, 0.1, past)
    assert row[BY_MOTION_N] == pytest.approx(0.1 * WEIGHT_N - 3000.0) and row[OTHERS_STD_N] == 0.0


def test_an_aircraft_that_is_shaken_tells_less():
    """From row to row; a throttle that some source shows shakes nothing."""
    rng, shaken = np.random.default_rng(5), {}
    for name, noise_g in (("calm", 0.0), ("gusts", 0.02)):
        past = pasts(3000.0, 3000.0)
        past["rows"][0, 0] = row_at(0.4, 0.0, past)
        for k in range(60):
            past["rows"][0, 0, SAID : SAID + 2] = 1500.0 + 100.0 * k  # its mounts show a throttle, nothing else does
            row = past["rows"][0, 0].copy()
            row[SAID : SAID + 2] += 100.0
            row[ALONG_G] = (200.0 * (k + 1)) / WEIGHT_N + noise_g * rng.normal()
            moves(past, 0, row, MOTION, True)
            past["rows"][0, 0] = row
        shaken[name] = row[SHAKES_N]
    assert shaken["calm"] < 0.004 * WEIGHT_N < 0.012 * WEIGHT_N < shaken["gusts"] < 0.03 * WEIGHT_N


def test_an_aircraft_of_any_mass_says_nothing():
    known = motion_of(CITATION)
    assert known.weight_n == pytest.approx(9.80665 * (4157.0 + 6960.0) / 2.0) and 0.14 < known.mass < 0.15
    assert motion_of(replace(CITATION, wing=None)) == SILENT
