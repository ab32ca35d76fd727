"""Where two sources disagree and nothing tells which is right, the status says so and the band holds both."""

import json

import numpy as np

from tests.sensors.test_monitor import CITATION, LAYOUT, SHARES, cruise, monitor_inputs
from thrustd.core.types import Status
from thrustd.fusion.mixture import STD_N, Weighed, mix
from thrustd.sensors.bank import BY_MOUNTS
from thrustd.sensors.monitor import Monitor
from thrustd.sensors.onsets import MOUNTS_OFF, WELL

DRIFT_N_S, FROM_S, DECK_N = 4.0, 60.0, 150.0


def test_mounts_that_leave_the_brochure_are_disagreed_with_before_they_are_named_and_the_band_holds_both():
    rng, monitor, told, held = np.random.default_rng(3), Monitor(LAYOUT, CITATION, SHARES), [], []
    for k in range(4000):
        read, drift_n = cruise(k, rng), DRIFT_N_S * max(k / 10 - FROM_S, 0.0)
        for mount in (0, 1):
            read["deformation_mm", mount] += drift_n / 2.0 / 3600.0
        verdict = monitor.step(monitor_inputs(k, read))
        told.append([bool(status & Status.DISAGREE) for status in verdict.status])
        rows, lead = monitor.bank.rows[0], monitor.bank.found.item(0)
        if lead == WELL and told[-1][0]:
            weighed = Weighed(rows, lead, monitor.uncorrected_n(0), BY_MOUNTS)
            thrust_n, std_n = mix(0.0, rows[lead, STD_N], weighed)  # beside what mounts and brochure say together
            held.append(abs(rows[MOUNTS_OFF, 1] - thrust_n) < 1.96 * std_n)
        if lead == MOUNTS_OFF:
            break
    assert lead == MOUNTS_OFF and drift_n > 2.0 * DECK_N
    assert not np.any(told, axis=0)[1]  # the other engine is well
    assert not any(engine for engine, _ in told[: round(10 * FROM_S)])  # nor was this one told before
    assert len(held) > 20 and all(held)


def test_a_bank_that_goes_on_knows_all_of_its_past_and_since_when_its_engines_turn():
    rng, monitor = np.random.default_rng(4), Monitor(LAYOUT, CITATION, SHARES)
    for k in range(300):
        read = cruise(k, rng)
        if k < 100:
            read["n1_pct", 1] = read["n2_pct", 1] = 0.0
        monitor.step(monitor_inputs(k, read))
    memory = json.loads(json.dumps(monitor.snapshot()))
    again, later = Monitor(LAYOUT, CITATION, SHARES), Monitor(LAYOUT, CITATION, SHARES)
    assert again.restore(memory) and again.snapshot()["bank"] == memory["bank"]
    assert later.restore(memory, 7_000_000_000)
    started_s = [engine["since_s"][0] for engine in memory["bank"]]
    assert started_s[0] < 0.0 < started_s[1] and all(memory["bank"][0]["lagged_n"])
    assert [engine["since_s"][0] for engine in later.snapshot()["bank"]] == [s + 7.0 for s in started_s]


def test_while_an_engine_starts_three_sigmas_hold_what_each_of_its_mounts_says_for_both():
    """A stranger's transducer whose sign was turned: 320 N wrong at a sigma of 40 N, for 9 s after the start."""

    def three_sigmas_n(sign):
        rng, monitor = np.random.default_rng(5), Monitor(LAYOUT, CITATION, SHARES)
        for k in range(150):
            read = cruise(k, rng)
            read["deformation_mm", 0] *= sign
            if k < 50:
                read["n1_pct", 0] = read["n2_pct", 0] = 0.0
            monitor.step(monitor_inputs(k, read))
        return 3.0 * monitor.uncorrected_n(0)

    assert three_sigmas_n(-1.0) > 5000.0 > 1200.0 > three_sigmas_n(1.0)


def test_what_was_found_and_nobody_can_tell_apart_is_known_to_a_bank_that_goes_on():
    """Mounts of both engines that drift alike: the status says that nothing tells, and says so after a restart."""
    rng, monitor = np.random.default_rng(5), Monitor(LAYOUT, CITATION, SHARES)

    def told(who, first, last):
        for k in range(first, last):
            read, drift_n = cruise(k, rng), 8.0 * np.clip(k / 10 - FROM_S, 0.0, 60.0)
            for mount in range(4):
                read["deformation_mm", mount] += drift_n / 2.0 / 3600.0
            yield [bool(status & Status.DISAGREE) for status in who.step(monitor_inputs(k, read)).status]

    assert np.all(list(told(monitor, 0, 2400))[-600:])
    memory = json.loads(json.dumps(monitor.snapshot()))
    again, later = Monitor(LAYOUT, CITATION, SHARES), Monitor(LAYOUT, CITATION, SHARES)
    assert again.restore(memory) and later.restore(memory, 7_000_000_000)
    assert [one["somebody_s"] for one in later.snapshot()["bank"]] == [
        one["somebody_s"] + 7.0 for one in memory["bank"]
    ]
    assert np.all(list(told(again, 2400, 3000))[20:])  # as soon as both engines were weighed
