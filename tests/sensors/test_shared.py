"""What is wrong on all engines at once, on rows whose fault is known: the accelerometer, air data, or one engine."""

import numpy as np

from tests.sensors.test_evidence import INSTALLED, SHARE, flown
from thrustd.sensors import evidence, onsets
from thrustd.sensors.kinematics import REFUTED, Bias, balance_of, no_balance
from thrustd.sensors.lead import keep_failure
from thrustd.sensors.motion import LIES, at_odds
from thrustd.sensors.past import AIR_MACH, ALONG_G, T_S
from thrustd.sensors.shared import weigh_shared

MOUNTS, BROCHURE = np.array((SHARE, 1 - SHARE, 0, 0, 0)), np.array((0, 0, 1.0, 1.0, 1.0))
IDLE_N, BEGINS_S = 600.0, 300.0
WEIGHT_N, SILENT = 3660.0, Bias(no_balance(), 3660.0)


def weighed(left, right, seconds, along_g=0.0, bias=SILENT, thrust_of=lambda t_s: IDLE_N):
    """(2, N_HYPOTHESES), (2,): probabilities and odds so many seconds after faults began, of each engine time -> (5,).

    `along_g`: what the accelerometer has shown since then, of which the Mach number shows nothing.
    """
    heard, out, odds = np.zeros(2, onsets.HEARD), np.zeros((2, onsets.N_HYPOTHESES, 3)), np.zeros(2)
    for fault_of, said, row in zip((left, right), heard, out, strict=True):
        seen = flown(lambda t_s, of=fault_of: of(t_s - BEGINS_S), BEGINS_S + seconds, thrust_of)
        *_, (rows, n) = seen
        rows[:, ALONG_G] = along_g * (rows[:, T_S] > BEGINS_S)
        rows[:, AIR_MACH] = along_g * 9.81 / 340.0 * np.maximum(rows[:, T_S] - BEGINS_S, 0.0)
        evidence.weigh(rows, n, SHARE, onsets.WELL, INSTALLED, said, row)
    for e in range(2):
        odds[e] = weigh_shared(heard, e, onsets.WELL, bias, out[e])
    assert np.allclose(out[:, :, 0].sum(axis=1), 1.0)
    return out[:, :, 0], odds


def healthy(since_s):
    return 0.0 * MOUNTS


def test_an_accelerometer_that_jumps_is_wrong_on_both_engines_at_once():
    """Not the mounts of both engines; nor air data, which say the same as before and miss no such acceleration."""
    for g in (-0.05, 0.05):
        p, _ = weighed(*2 * [lambda since_s, n=3660.0 * g: n * (since_s > 0) * MOUNTS], 1.2, g)
        assert (p[:, onsets.ACCELERATION_OFF] > 0.99).all()


def test_the_mounts_of_one_engine_are_no_accelerometer():
    p, _ = weighed(lambda since_s: 400.0 * (since_s > 0) * MOUNTS, healthy, 6.0)
    assert p[0].argmax() == onsets.MOUNTS_OFF and p[0, onsets.MOUNTS_OFF] > 0.9
    assert p[1, onsets.WELL] > 0.9


def test_a_mach_number_that_freezes_in_a_roll_is_no_accelerometer():
    """What no accelerometer does: 100 N a second, on both engines."""
    p, _ = weighed(*2 * [lambda since_s: 100.0 * max(since_s, 0.0) * BROCHURE], 6.0, 0.35)
    assert (p[:, onsets.AIR_OFF] > 0.9).all()


def test_what_stands_still_on_all_engines_goes_with_the_thrust_that_the_others_show():
    """Two slams: what stands still is off by more and less and more again; the motion has to say who it was."""
    slams = lambda since_s: 3000.0 * np.interp(since_s, (0.0, 4.0, 30.0, 34.0, 60.0, 64.0), (0, 1, 1, 0, 0, 1))  # noqa: E731
    for still, which in ((BROCHURE, onsets.AIR_OFF), (MOUNTS, onsets.ACCELERATION_OFF)):
        for seconds in (20.0, 50.0, 70.0):
            fault_of = lambda since_s, still=still: -slams(since_s) * still  # noqa: E731
            p, _ = weighed(fault_of, fault_of, seconds, thrust_of=lambda t_s: IDLE_N + slams(t_s - BEGINS_S))
            assert (p[:, which] > 0.1 * LIES).all() and (p[:, onsets.ACCELERATION_OFF :].sum(axis=1) > 0.9).all(), (
                seconds
            )


def test_engines_that_are_well_share_nothing():
    p, _ = weighed(healthy, healthy, 10.0)
    assert (p[:, onsets.ACCELERATION_OFF :] < 1e-3).all() and (p[:, onsets.WELL] > 0.9).all()


def drifts(t_s):
    """Mounts that drift by 400 N in a minute."""
    return 400.0 * np.clip((t_s - BEGINS_S) / 60.0, 0.0, 1.0) * MOUNTS


def kept_p(remembers, faults=(drifts, drifts), seconds=900.0):
    """That somebody of the first engine has failed, every second; `remembers`: by engine, that this was found."""
    thrust_of = lambda t_s: 2000.0 + 500.0 * np.sin(t_s / 120.0)  # noqa: E731
    heard, out, found = np.zeros(2, onsets.HEARD), np.zeros((2, onsets.N_HYPOTHESES, 3)), []
    for k, both in enumerate(zip(*(flown(of, seconds, thrust_of) for of in faults), strict=True)):
        if k % 5 or both[0][1] < 3:
            continue
        asked = [onsets.SOMEBODY if said["somebody_s"] else onsets.WELL for said in heard]
        for (rows, n), said, before, row in zip(both, heard, asked, out, strict=True):
            evidence.weigh(rows, n, SHARE, before, INSTALLED, said, row)
        for e in range(2):
            weigh_shared(heard, e, asked[e], SILENT, out[e])
            keep_failure(heard[e], onsets.WELL, out[e])
        heard["somebody_s"] *= remembers
        found.append(at_odds(out[0]))
    return np.array(found)


def test_what_was_found_and_nobody_can_tell_apart_stays_when_rows_forget_how_it_began():
    """From 400 s on 0.998 instead of 0.1 to 0.3: the band holds who may be wrong, and the status says so."""
    kept, forgets = kept_p((True, True)), kept_p((False, False))
    assert (kept[:145] < 0.1).all() and (kept[180:] > 0.99).all()
    assert (forgets[-100:] < 0.5).all()  # a test that would hold without it says nothing


def test_what_was_found_on_another_engine_may_be_what_this_one_shares_with_it():
    """The other engine's own mounts alone would grow likelier, and this one would be well again: 4 sigmas off."""
    assert (kept_p((False, True))[180:] > 0.9).all()


def test_a_failure_of_one_engine_stays_though_nothing_tells_mounts_from_brochure():
    """600 N in a minute: five minutes later 0.97 instead of 0.1."""
    faults = lambda t_s: 1.5 * drifts(t_s), healthy
    kept, forgets = (kept_p((told, False), faults) for told in (True, False))
    assert (kept[:145] < 0.1).all() and (kept[200:] > 0.95).all()
    assert (forgets[-100:] < 0.3).all()


def steady(mean_g, seconds):
    """What kinematics says of an accelerometer that shows so much more than the aircraft does, for so long."""
    rng, balance = np.random.default_rng(2), no_balance()
    for t_s in np.arange(0.0, 60.0 + seconds, 0.1):
        shown_g = np.sin(np.radians(3.0)) + rng.normal(0, 0.002) + mean_g * (t_s > 60.0)
        balance_of(balance, shown_g, 1.0, 3.0, (120.0 + rng.normal(0, 0.1)) / 331.3, 0.0, 0.1)
    return Bias(balance, WEIGHT_N)


def test_what_all_mounts_share_is_the_accelerometer_unless_the_speed_confirms_its_readings():
    """All mounts jump alike: within some seconds the speed shows that acceleration, or refutes the accelerometer."""
    jumps = 2 * [lambda since_s: 0.1 * WEIGHT_N * (since_s > 0) * MOUNTS]
    for seconds, refuted in ((1.2, False), (20.0, True)):
        for mean_g in (0.0, 0.1):
            p, odds = weighed(*jumps, seconds, 0.1, steady(mean_g, seconds))
            assert (p[:, onsets.ACCELERATION_OFF] > 0.9).all()
            assert ((odds < REFUTED) == (refuted and mean_g == 0.0)).all()
