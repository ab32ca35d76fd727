"""What mounts jump by within one fused step: counted where no thrust does it, and weighed as the onset of a fault."""

import numpy as np
import pytest

from tests.sensors.test_evidence import INSTALLED, SHARE, said_of
from thrustd.core.columns import MOUNT_STATE
from thrustd.sensors import evidence, onsets
from thrustd.sensors.jumps import (
    FASTEST_N_S,
    LEADS_UP_N_S,
    _inverse,
    _log_fuelled,
    _noise,
    follow,
    forget,
    no_jumps,
)
from thrustd.sensors.past import (
    COUNTS,
    DECK_N,
    FUEL_FLOW,
    FUELLED_N,
    JUMPED_N,
    LOG_FLOW,
    MACH,
    MOUNT_RATE_N_S,
    N_SOURCES,
    OWN_N,
    PER_FUEL_N,
    SAID,
    STEP_N,
    T_S,
    WIDTH,
    no_past,
    remember,
)

DT_S, SPRINGS = 0.02, np.array([5000.0, 6000.0])


def followed(forces_n, deformations_mm):
    """JUMPS of one engine after these steps, (n, 2) each."""
    jumps, states = no_jumps(1), np.zeros(2, MOUNT_STATE)
    for force_n, read_mm in zip(forces_n, deformations_mm, strict=True):
        states["force_n"], states["deformation_mm"] = force_n, read_mm
        follow(jumps, np.array([[0, 1]]), np.array([SHARE]), SPRINGS, states, DT_S, 0.0)
    return jumps[0]


def test_a_throttle_that_is_cut_is_no_jump():
    falls_n = -0.9 * FASTEST_N_S * DT_S * np.arange(20)
    forces_n = np.outer(5000.0 + falls_n, (SHARE, 1 - SHARE))
    jump = followed(forces_n, forces_n / SPRINGS)
    assert (jump["jumped_n"] == 0.0).all()
    assert jump["could_n"] == pytest.approx(falls_n[-1])


def test_a_throttle_that_is_opened_is_for_a_step_as_quick_and_no_jump():
    """Recorded N1 raise a thrust by 3.9 kN/s; of a rise that only the mounts show, less counts as the thrust's own."""
    rises_n = 3900.0 * DT_S * np.arange(20)
    forces_n = np.outer(2000.0 + rises_n, (SHARE, 1 - SHARE))
    jump = followed(forces_n, forces_n / SPRINGS)
    assert (jump["jumped_n"] == 0.0).all()
    assert jump["could_n"] == pytest.approx(19 * LEADS_UP_N_S * DT_S)


def test_a_transducer_that_jumps_is_counted_and_no_thrust_of_it_is():
    forces_n = np.full((10, 2), 2000.0)
    forces_n[5:, 0] += 500.0
    jump = followed(forces_n, forces_n / SPRINGS)
    assert jump["jumped_n"].tolist() == [500.0, 0.0]
    assert jump["could_n"] == pytest.approx(LEADS_UP_N_S * DT_S)
    forget(jump)
    assert jump["jumped_n"].tolist() == [0.0, 0.0] and jump["could_n"] == 0.0


def test_an_acceleration_that_jumps_moves_no_transducer():
    forces_n = np.full((10, 2), 2000.0)
    forces_n[5:] += 300.0
    jump = followed(forces_n, np.ones((10, 2)))
    assert (jump["jumped_n"] == 0.0).all() and jump["could_n"] == 0.0  # nor does any thrust


def test_what_comes_back_and_what_was_not_seen_is_no_jump():
    forces_n = np.full((10, 2), 2000.0)
    forces_n[5] += 500.0
    assert np.abs(followed(forces_n, forces_n / SPRINGS)["jumped_n"]).max() < 1e-9
    forces_n[4:6] = np.nan
    forces_n[6:] += 500.0
    assert (followed(forces_n, forces_n / SPRINGS)["jumped_n"] == 0.0).all()


def test_an_acceleration_that_is_read_later_than_the_mounts_undoes_their_jump():
    """The aircraft is shaken; the force is back when its acceleration arrives, the transducers are not."""
    forces_n, deformations_mm = np.full((10, 2), 2000.0), np.full((10, 2), 0.4)
    forces_n[5:7] += 500.0
    deformations_mm[5:] += 0.1
    assert np.abs(followed(forces_n, deformations_mm)["jumped_n"]).max() < 1e-9


def test_a_thrust_may_have_moved_in_every_step_that_jumped():
    forces_n = np.full((10, 2), 2000.0)
    forces_n[5:8] -= 100.0 * np.arange(1, 4)[:, None]
    forces_n[8:] -= 300.0
    one_n = FASTEST_N_S * DT_S
    assert followed(forces_n[:6], forces_n[:6] / SPRINGS)["step_n"] == pytest.approx(one_n)
    assert followed(forces_n, forces_n / SPRINGS)["step_n"] == pytest.approx(one_n * 3**0.5)


def weighed(rate_n_s, fault_n, jumped_n, fuelled_n=0.0, rows=12):
    """Probabilities two looks after mounts (2,) that jump, at a thrust that has been moving for five seconds."""
    rng, past, out = np.random.default_rng(0), no_past(1), np.zeros((onsets.N_HYPOTHESES, 3))
    heard = np.zeros(1, onsets.HEARD)[0]
    for k in range(150 + rows + 2):
        t_s, row = 0.4 * k, np.zeros(WIDTH)
        thrust_n, late = 2000.0 + rate_n_s * 0.4 * max(k - 150, 0), k >= 150 + rows
        fault = np.array([*fault_n, fuelled_n, 0.0, 0.0]) if late else np.zeros(N_SOURCES)
        row[T_S], row[MACH], row[DECK_N], row[OWN_N : OWN_N + 2] = t_s, 0.3, 60.0 + 0.034 * thrust_n, 30.0
        row[PER_FUEL_N], row[LOG_FLOW] = 1.5 * thrust_n, np.log(thrust_n / 30_000.0)  # near enough
        row[SAID : SAID + N_SOURCES] = said_of(thrust_n, fault, rng)
        row[COUNTS : COUNTS + N_SOURCES] = 1.0
        row[MOUNT_RATE_N_S], row[STEP_N] = 0.4 * rate_n_s, FASTEST_N_S * DT_S
        row[JUMPED_N : JUMPED_N + 2] = jumped_n if k == 150 + rows else 0.0
        assert remember(past, 0, row, SHARE)
        if late:
            evidence.weigh(past["rows"][0], int(past["n"][0]), SHARE, onsets.WELL, INSTALLED, heard, out)
    return out[:, 0]


@pytest.mark.parametrize("rate_n_s", [0.0, 600.0])
def test_both_mounts_that_jump_are_found_at_once_whatever_the_throttle_does(rate_n_s):
    jump_n = 500.0, 600.0
    assert weighed(rate_n_s, jump_n, jump_n)[onsets.MOUNTS_OFF] > 0.98


def test_the_mount_that_jumped_is_told_from_the_other():
    assert weighed(600.0, (500.0, 0.0), (500.0, 0.0))[onsets.UPPER_OFF] > 0.98
    assert weighed(600.0, (0.0, -500.0), (0.0, -500.0))[onsets.LOWER_OFF] > 0.98


def test_an_aircraft_that_is_shaken_excludes_nobody():
    """The mounts jumped, and what they say since is as before."""
    probabilities = weighed(0.0, (0.0, 0.0), (500.0, 600.0))
    assert probabilities[onsets.WELL] > 0.9


def test_mounts_that_jumped_and_stay_there_were_not_shaken():
    """In a take-off roll, where no spool says how large the thrust is."""
    jump_n = -500.0, -600.0
    assert weighed(1500.0, jump_n, jump_n, rows=2)[onsets.MOUNTS_OFF] > 0.98


def test_a_thrust_may_jump_with_its_fuel_flow():
    jump_n = -400.0, -450.0
    assert weighed(0.0, jump_n, jump_n, fuelled_n=-3000.0)[onsets.MOUNTS_OFF] < 0.9


def test_no_fuel_flow_moves_one_mount_alone_and_none_the_other_way():
    """As a throttle that opens."""
    assert weighed(600.0, (500.0, 0.0), (500.0, 0.0), fuelled_n=1500.0)[onsets.UPPER_OFF] > 0.98
    jump_n = -500.0, -600.0
    assert weighed(600.0, jump_n, jump_n, fuelled_n=500.0)[onsets.MOUNTS_OFF] > 0.9


def test_a_fuel_flow_that_rises_lets_no_thrust_fall():
    """In a throttle-up: by however much it rises, and where the mounts followed before the fuel flow did."""
    jump_n = -500.0, -600.0
    assert weighed(1500.0, jump_n, jump_n, fuelled_n=2000.0, rows=2)[onsets.MOUNTS_OFF] > 0.98
    assert weighed(2500.0, jump_n, jump_n, fuelled_n=-800.0, rows=2)[onsets.MOUNTS_OFF] > 0.98


def test_throttles_that_are_cut_again_and_again_are_no_fault_however_long_ago():
    """Each cut moves mounts and fuel flow alike; between two cuts the thrust comes back slowly."""
    rng, past, out = np.random.default_rng(0), no_past(1), np.zeros((onsets.N_HYPOTHESES, 3))
    heard, thrust_n, worst = np.zeros(1, onsets.HEARD)[0], 5000.0, 0.0
    for k in range(3000):
        cut, row = k % 450 == 400, np.zeros(WIDTH)
        moved_n = -3500.0 if cut else min(80.0, 5000.0 - thrust_n) if k % 450 < 200 else 0.0
        thrust_n += moved_n
        row[T_S], row[MACH], row[DECK_N], row[OWN_N : OWN_N + 2] = 0.4 * k, 0.3, 60.0 + 0.034 * thrust_n, 30.0
        row[PER_FUEL_N], row[LOG_FLOW] = 1.5 * thrust_n, np.log(thrust_n / 30_000.0)
        row[SAID : SAID + N_SOURCES] = said_of(thrust_n, np.zeros(N_SOURCES), rng)
        row[SAID + FUEL_FLOW] += 0.0 if cut else 20.0 * moved_n  # it leads while the throttle opens
        row[COUNTS : COUNTS + N_SOURCES], row[STEP_N] = 1.0, FASTEST_N_S * DT_S
        row[MOUNT_RATE_N_S] = abs(moved_n)
        row[JUMPED_N : JUMPED_N + 2] = moved_n * np.array((SHARE, 1 - SHARE)) if cut else 0.0
        assert remember(past, 0, row, SHARE)
        if k > 10 and k % 3 == 0:
            evidence.weigh(past["rows"][0], int(past["n"][0]), SHARE, onsets.WELL, INSTALLED, heard, out)
            worst = max(worst, out[onsets.MOUNTS_OFF, 0])
    assert worst < 0.9


def test_any_part_of_what_a_fuel_flow_moved_is_as_likely_and_nothing_beyond_it():
    rows, parts = np.zeros((3, WIDTH)), (SHARE, 1 - SHARE, 1.0, 1.0, 1.0)
    rows[:, T_S], rows[:, STEP_N], rows[:, COUNTS:OWN_N] = (2.0, 1.0, 0.0), 100.0, 1.0
    rows[:, SAID + FUEL_FLOW], rows[0, FUELLED_N] = (3000.0, 2000.0, 2000.0), 1000.0

    def log_of(thrust_n):
        rows[0, JUMPED_N : JUMPED_N + 2] = thrust_n * np.array(parts[:2])
        noise = _noise(rows, 1, parts)
        u, v, w, _ = _inverse(*noise[:2], noise[3], parts)
        x, y = rows[0, JUMPED_N : JUMPED_N + 2] - noise[2] * np.array(parts[:2])
        gauss = -0.5 * (u * x * x + 2 * v * x * y + w * y * y - np.log(u * w - v * v))
        return gauss + _log_fuelled(noise, tuple(rows[0, JUMPED_N : JUMPED_N + 2]), parts)

    assert log_of(300.0) == pytest.approx(log_of(500.0), abs=1e-3) == log_of(700.0)
    assert log_of(0.0) == pytest.approx(log_of(500.0) - np.log(2.0), abs=1e-3) == log_of(1000.0)
    assert log_of(-500.0) < log_of(500.0) - 10.0 and log_of(1500.0) < log_of(500.0) - 10.0
