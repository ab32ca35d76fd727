"""The accelerometer against pitch and airspeed: a bias and a sign are found, a flight that turns is no fault."""

import numpy as np
import pytest

from thrustd.sensors.kinematics import (
    ACCELERATION,
    LEAVES,
    MACH,
    TAKEN,
    Accelerometer,
    air_leaves,
    balance_of,
    no_balance,
)

DT_S, SOUND_M_S = 0.1, 331.3


def found_s(spoil, seconds=240.0, turning=False, begin_s=60.0):
    """Seconds after the fault until it is found; None: never."""
    rng, balance, v = np.random.default_rng(1), no_balance(), 110.0
    for k in range(round(seconds / DT_S)):
        t_s = k * DT_S
        pitch_deg = 4.0 + 3.0 * np.sin(t_s / 20.0)
        along_g = 0.01 * np.sin(t_s / 7.0)
        v += DT_S * 9.80665 * along_g
        load_g = 1.0 + (0.5 * max(np.sin(t_s / 15.0), 0.0) if turning else 0.0)
        f_x_g = along_g + np.sin(np.radians(pitch_deg)) + 0.04 * (load_g - 1.0) + rng.normal(0, 0.002)
        if t_s >= begin_s:
            f_x_g = spoil(f_x_g)
        mach = v / SOUND_M_S + rng.normal(0, 0.0004)
        if balance_of(balance, f_x_g, load_g, pitch_deg + rng.normal(0, 0.05), mach, 0.0, DT_S):
            return t_s - begin_s
    return None


@pytest.mark.parametrize("spoil", [lambda f: f + 0.07, lambda f: f - 0.07, lambda f: -f], ids=["+", "-", "sign"])
def test_an_accelerometer_at_fault_is_found(spoil):
    assert 0.0 < found_s(spoil) < 30.0


@pytest.mark.parametrize("turning", [False, True])
def test_a_healthy_one_is_not(turning):
    assert found_s(lambda f: f, 600.0, turning) is None


def test_what_is_not_measured_says_nothing():
    balance = no_balance()
    for _ in range(100):
        assert not balance_of(balance, 0.5, 1.0, np.nan, 0.3, 0.0, DT_S)
        assert not balance_of(balance, 0.5, 1.0, 3.0, 0.1, 0.0, DT_S)


def blamed(f_x_g, mach_of, apart_n, seconds=(40.0, 25.0, 60.0), watch=None):
    """Who is at fault at the end: at rest, in a roll that shows `f_x_g`, and behind it."""
    watch = Accelerometer(TAKEN.index, 373.0) if watch is None else watch
    v_m_s = 0.0
    for shown_g, lasts_s in zip((0.0, f_x_g, 0.0), seconds, strict=True):
        for _ in range(round(lasts_s / DT_S)):
            v_m_s += DT_S * 9.80665 * shown_g
            readings = {"accel_x_g": shown_g, "accel_z_g": 1.0, "pitch_deg": 0.0, "sat_degC": 0.0}
            readings["mach"] = mach_of(v_m_s / SOUND_M_S)
            row = np.array([readings[name] for name, _ in TAKEN])
            watch.look(row, None, DT_S, lambda: np.array(apart_n))
    return watch


def test_a_roll_on_which_mach_stands_is_machs_fault_where_the_brochure_says_too_much():
    watch = blamed(0.3, lambda _: 0.03, ((-900.0, 300.0), (-700.0, 300.0)))
    assert watch.blamed == MACH  # also a minute later: at rest it agrees, and could not have failed
    again = Accelerometer(TAKEN.index, 373.0)
    again.restore(watch.snapshot())
    assert again.blamed == MACH
    assert blamed(0.0, lambda _: 0.3, (), (30.0, 0.0, 0.0), watch).blamed is None


def test_an_accelerometer_that_invents_a_roll_is_at_fault_where_the_mounts_say_too_much():
    watch = blamed(0.3, lambda _: 0.0, ((900.0, 300.0), (700.0, 300.0)), (40.0, 25.0, 0.0))
    assert watch.blamed == ACCELERATION
    assert blamed(0.3, lambda _: 0.0, ((0.0, 300.0), (np.nan, 300.0)), (40.0, 25.0, 0.0)).blamed == ACCELERATION


def test_a_roll_that_mach_shows_excludes_nobody():
    assert blamed(0.3, lambda mach: mach, ((-900.0, 300.0), (-700.0, 300.0))).blamed is None


def test_air_data_leave_by_what_they_move_or_do_not_show_of_an_acceleration():
    """Mach number after 10 s of 0.2 s each; one that rests on an aircraft that rests cannot have become wrong."""
    places = np.arange(len(LEAVES))

    def left(mach_s, f_x_g, pitch_deg=2.0, seconds=10.0):
        air = np.array((0.0, np.nan, np.nan, 0.0))
        for t_s in np.arange(0.0, seconds + 0.1, 0.2):
            air_leaves(air, np.array((0.4 + mach_s * t_s, 3000.0, f_x_g, pitch_deg)), places, t_s)
        return air[0]

    level_g = np.sin(np.radians(2.0))
    assert left(0.0, level_g) < 1e-6
    assert left(-0.01, level_g) == pytest.approx(0.1)
    assert left(0.0, level_g + 0.3) == pytest.approx(left(0.0, level_g - 0.3)) == pytest.approx(29.4 / 320.0, rel=0.01)
    assert left(np.nan, 0.3) > 0.05 and left(0.0, np.nan) == pytest.approx(98.1 / 320.0, rel=0.01)
