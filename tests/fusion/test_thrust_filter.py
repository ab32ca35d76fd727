"""The thrust filter on signals whose truth is known: bands, gates, zeros, poison, memory."""

from math import hypot, inf, nan, sqrt

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.core.errors import ConfigError
from thrustd.core.types import Status
from thrustd.fusion import smoother
from thrustd.fusion.dynamics import ENGINE, N_STATE
from thrustd.fusion.fusion_inputs import FusionInputs
from thrustd.fusion.mixture import Weighed
from thrustd.fusion.settings import FusionSettings, check_settings
from thrustd.fusion.thrust_filter import ThrustFilter

HZ = 10.0
STEP_NS = round(1e9 / HZ)
S = FusionSettings()
MOUNT_STD_N, SHAPE_STD_N = 60.0, 70.0  # as the filter expects them, whatever part of what it is told that is


def inputs(k, mount_n=nan, brochure_n=nan, n1_pct=80.0, n1_rate=0.0, **more):
    return FusionInputs(
        t_ns=(k + 1) * STEP_NS,
        mount_n=mount_n,
        mount_std_n=MOUNT_STD_N if mount_n == mount_n else nan,
        brochure_n=brochure_n,
        brochure_std_n=sqrt((S.brochure_bias_std * brochure_n) ** 2 + SHAPE_STD_N**2)
        if brochure_n == brochure_n
        else nan,
        n1_pct=n1_pct,
        n1_rate_pct_s=n1_rate,
        transient=abs(n1_rate) > 1.0,
        **more,
    ).row()


def flown(seed, seconds=300.0, mount=True, brochure=True):
    """Estimates, truth and filter on a flight with throttle steps, and errors as the filter has them."""
    rng, s = np.random.default_rng(seed), S
    n = round(seconds * HZ)
    wanted = np.repeat(rng.uniform(50, 90, 1 + n // 300), 300)[:n]
    n1 = np.empty(n)
    n1[0] = wanted[0]
    for k in range(1, n):
        n1[k] = n1[k - 1] + np.clip((wanted[k] - n1[k - 1]) / 9.0, -0.4, 0.4)
    rate = np.gradient(n1, 1 / HZ)
    truth = 2500.0 + 60.0 * (n1 - 70.0)
    bias = rng.normal(0, s.brochure_bias_std)
    error, shape = MOUNT_STD_N * rng.normal(), SHAPE_STD_N * rng.normal()
    keep = np.exp(-1 / (HZ * s.mount_error_tau_s))
    thrust_filter, estimates = ThrustFilter(s, 0), []
    tape = thrust_filter.keep()
    for k in range(n):
        error = keep * error + MOUNT_STD_N * sqrt(1 - keep**2) * rng.normal()
        shape = keep * shape + SHAPE_STD_N * sqrt(1 - keep**2) * rng.normal()
        mount_n = truth[k] + error + s.mount_noise_std_n * rng.normal() if mount else nan
        brochure_n = truth[k] * (1 + bias) + shape + s.brochure_noise_std_n * rng.normal() if brochure else nan
        estimates.append(thrust_filter.step(inputs(k, mount_n, brochure_n, n1[k], rate[k])))
    return estimates, truth, thrust_filter, tape


@pytest.mark.parametrize(("mount", "brochure"), [(True, True), (True, False), (False, True)])
def test_band_holds_the_truth(mount, brochure):
    inside = []
    for seed in range(120):
        estimates, truth, _, _ = flown(seed, 6.0, mount, brochure)
        inside += [abs(e.thrust_n - t) <= 1.96 * e.thrust_std_n for e, t in zip(estimates, truth, strict=True)]
    assert 0.92 < np.mean(inside) < 0.99  # as many draws of a slow error: each outside costs up to one of them


def test_fused_is_better_than_either_source():
    errors = {"fused": [], "mount": [], "brochure": []}
    for seed in range(24):
        estimates, truth, _, _ = flown(seed, 100.0)
        for e, t in zip(estimates[100:], truth[100:], strict=True):
            errors["fused"].append(e.thrust_n - t)
            errors["mount"].append(e.mount_n - t)
            errors["brochure"].append(e.brochure_n - t)
    rmse = {name: np.sqrt(np.mean(np.square(values))) for name, values in errors.items()}
    assert rmse["fused"] < min(rmse["mount"], rmse["brochure"])


def test_noise_of_the_engine_is_not_learnt_as_its_deviation():
    """In steady flight the deviation random-walks no further than its own band, however often the engine is read."""
    rng, thrust_filter = np.random.default_rng(4), ThrustFilter(FusionSettings(), 0)
    for k in range(6000):
        thrust_filter.step(inputs(k, 4000.0 + rng.normal(0, 5.0), 3900.0 + rng.normal(0, 10.0)))
    now = thrust_filter.snapshot()["now"]
    engine, std = now[ENGINE], sqrt(now[N_STATE + ENGINE * (N_STATE + 1)])
    assert abs(engine) < 2.0 * std


def test_a_sigma_that_grows_with_readings_high_by_noise_moves_nothing():
    """Without fuel flow N1's own noise widens the deck's sigma: not only its low readings may count."""
    rng, thrust_filter, std_n, said = np.random.default_rng(5), ThrustFilter(FusionSettings(), 0), 130.0, []
    for k in range(2000):
        noise_n = rng.normal(0, 10.0)
        if k > 1000:
            std_n = max(std_n, 130.0 + 0.2 * (k - 1000) + 0.1 * noise_n)
        told = inputs(k, 4000.0 + rng.normal(0, 5.0), 3850.0 + noise_n)
        told["brochure_std_n"] = std_n
        said.append(thrust_filter.step(told).thrust_n)
    assert np.mean(said[-200:]) == pytest.approx(np.mean(said[800:1000]), abs=15.0)


def test_smoothing_is_rauch_tung_striebel_where_no_error_is_learnt(monkeypatch):
    """Against filterpy's own smoother, over several blocks, when the readings have no other error than noise."""
    monkeypatch.setattr(smoother, "BLOCK", 64)
    rng, tape, kf = np.random.default_rng(3), smoother.Tape(), KalmanFilter(dim_x=N_STATE, dim_z=1)
    f, q = np.diag([1.0, 0.9, 0.99, 1.0, 0.99]), np.diag([4.0, 9.0, 2.0, 0.1, 2.0])
    f[0, 1] = 0.1
    kf.P, kf.H, kf.R = 1e4 * np.eye(N_STATE), np.eye(1, N_STATE), np.array([[25.0]])
    for k in range(200):
        kf.predict(F=f, Q=q)
        kf.update(50.0 * np.sin(k / 20) + 5.0 * rng.normal())
        tape.write(k, kf.x, kf.P, f, q)
    smoothed, columns = smoother.smooth(tape), tape.steps(0, len(tape))
    x, p, _, _ = kf.rts_smoother(columns[0][:, :, None], *columns[1:])
    assert smoothed.thrust_n == pytest.approx(x[:, 0, 0], rel=1e-6)
    assert smoothed.thrust_rate_n_s == pytest.approx(x[:, 1, 0], rel=1e-6, abs=1e-9)
    assert smoothed.thrust_std_n == pytest.approx(np.sqrt(p[:, 0, 0]), rel=1e-6)
    assert len(smoother.smooth(smoother.Tape()).thrust_n) == 0


def test_smoothed_is_better_than_filtered_and_its_band_narrower():
    better, errors = [], {"filtered": [], "smoothed": []}
    for seed in range(12):
        estimates, truth, _, tape = flown(seed, 100.0)
        smoothed = smoother.smooth(tape)
        assert (smoothed.thrust_std_n <= np.array([e.thrust_std_n for e in estimates]) + 1e-6).all()
        both = (np.array([e.thrust_n for e in estimates]) - truth)[100:], (smoothed.thrust_n - truth)[100:]
        better.append(np.mean(both[1] ** 2) < np.mean(both[0] ** 2))
        for name, error in zip(errors, both, strict=True):
            errors[name].append(np.mean(error**2))
    assert np.mean(errors["smoothed"]) < np.mean(errors["filtered"])
    assert np.mean(better) > 0.8


def test_smoothing_knows_no_more_of_a_step_before_the_first_measurement_than_of_that():
    thrust_filter = ThrustFilter(S, 0)
    tape = thrust_filter.keep()
    for k in range(50):
        thrust_filter.step(inputs(k, 3000.0 if k else nan))
    std_n = smoother.smooth(tape).thrust_std_n
    assert std_n[0] == pytest.approx(std_n[1], rel=0.1)


def settled():
    thrust_filter = ThrustFilter(FusionSettings(), 0)
    for k in range(300):
        estimate = thrust_filter.step(inputs(k, 3000.0 + 5 * (-1) ** k, 3050.0))
    return thrust_filter, estimate


@pytest.mark.parametrize("source", ["mount", "brochure"])
def test_a_source_that_jumps_is_rejected_and_the_band_holds_both(source):
    """Until others have said who is at fault; then the thrust is where they say it is."""
    thrust_filter, before = settled()
    for k in range(300, 450):
        mount_n = 3000.0 + 5 * (-1) ** k + (900.0 if source == "mount" else 0.0)
        estimate = thrust_filter.step(inputs(k, mount_n, 3050.0 + (900.0 if source == "brochure" else 0.0)))
        assert estimate.status & (Status.MOUNT_REJECTED | Status.BROCHURE_REJECTED)
        assert abs(estimate.thrust_n - before.thrust_n) < 200.0
        assert abs(estimate.thrust_n - 3900.0) < 1.96 * estimate.thrust_std_n
    for k in range(450, 500):
        estimate = thrust_filter.step(inputs(k, 3000.0 + 5 * (-1) ** k, 3050.0))
    assert not estimate.status
    assert abs(estimate.thrust_n - before.thrust_n) < before.thrust_std_n


def test_no_error_is_learnt_beyond_three_sigma_of_its_prior():
    """Mounts and brochure drift apart by 4 kN in ten minutes, slowly enough for every gate."""
    thrust_filter, _ = settled()
    for k in range(300, 6300):
        apart_n = 4000.0 * (k - 300) / 6000
        estimate = thrust_filter.step(inputs(k, 5000.0 - apart_n / 2, 5000.0 + apart_n / 2))
        assert abs(estimate.mount_bias_n) <= 3.0 * MOUNT_STD_N + 1e-6
        assert abs(thrust_filter._x[ENGINE, 0]) <= 3.0 * S.brochure_bias_std + 1e-9


@pytest.mark.parametrize("pushed", [True, False])
def test_a_jump_of_the_mounts_is_in_the_band_of_the_very_estimate_that_sees_it(pushed):
    """Before N1 or the deck say anything: with both mounts pushed it is trusted, else both explanations are held."""
    thrust_filter, before = settled()
    jump_n = -1500.0
    estimate = thrust_filter.step(inputs(300, 3000.0 + jump_n, 3050.0, push_n=jump_n if pushed else 0.0))
    assert bool(estimate.status & Status.MOUNT_REJECTED) != pushed
    assert abs(estimate.thrust_n - before.thrust_n) < 10.0 or pushed
    for true_n in (3000.0 + jump_n,) if pushed else (3000.0, 3000.0 + jump_n):
        assert abs(estimate.thrust_n - true_n) < 1.96 * estimate.thrust_std_n


@pytest.mark.parametrize("more", [{"push_n": 1500.0}, {"push_n": -1500.0, "mount_extrapolating": True}])
def test_mounts_that_no_engine_pushes_like_that_are_not_trusted(more):
    """Upwards no spool is as quick; outside the model's range no thrust is."""
    thrust_filter, before = settled()
    estimate = thrust_filter.step(inputs(300, 3000.0 + more["push_n"], 3050.0, **more))
    assert estimate.status & Status.MOUNT_REJECTED
    assert abs(estimate.thrust_n - before.thrust_n) < 10.0


def test_a_mean_whose_step_began_to_move_says_little_of_its_end():
    """A throttle cut within the step: the mean has seen a fifth of it."""
    thrust_filter = ThrustFilter(S, 0, mount_age_s=0.5 / HZ)
    for k in range(300):
        thrust_filter.step(inputs(k, 3000.0, 3050.0))
    estimate = thrust_filter.step(inputs(300, 2800.0, 3050.0, push_n=-200.0))
    assert abs(estimate.thrust_n - 2200.0) < 1.96 * estimate.thrust_std_n
    estimate = thrust_filter.step(inputs(301, 2100.0, 3050.0, push_n=-800.0))
    assert abs(estimate.thrust_n - 2100.0) < 30.0


@pytest.mark.parametrize("liar", ["mount", "brochure"])
def test_what_a_liar_taught_is_forgotten_when_another_hypothesis_leads(liar):
    """A drift of 200 N/s is followed; then the thrust is told, and the errors have their priors again."""
    thrust_filter, before = settled()
    for k in range(300, 320):
        off = 200.0 * (k - 300) / HZ
        mount_n = 3000.0 + 5 * (-1) ** k + (off if liar == "mount" else 0.0)
        thrust_filter.step(inputs(k, mount_n, 3050.0 + (off if liar == "brochure" else 0.0)))
    last = inputs(320, nan, 3050.0) if liar == "mount" else inputs(320, 3000.0, nan)
    thrust_filter.begin_anew(before.thrust_n, 60.0, last)
    for k in range(320, 420):
        mount_n, brochure_n = (nan, 3050.0) if liar == "mount" else (3000.0, nan)
        estimate = thrust_filter.step(inputs(k, mount_n, brochure_n))
        assert abs(estimate.thrust_n - before.thrust_n) < min(60.0, 1.96 * estimate.thrust_std_n)


def test_a_thrust_that_is_none_is_not_begun_from():
    thrust_filter, _ = settled()
    before = thrust_filter.snapshot()
    for thrust_n, std_n in ((nan, 50.0), (3000.0, nan), (3000.0, 0.0), (inf, 50.0)):
        thrust_filter.begin_anew(thrust_n, std_n, inputs(300, 3000.0, 3050.0))
    assert thrust_filter.snapshot() == before


def test_the_band_grows_when_a_source_goes():
    thrust_filter, before = settled()
    for k in range(300, 2300):
        alone = thrust_filter.step(inputs(k, nan, 3050.0))
    assert alone.status & Status.MOUNT_LOST
    assert before.thrust_std_n < alone.thrust_std_n < 300.0


@pytest.mark.parametrize("moved_n", [0.0, 1500.0, -1500.0])
def test_a_throttle_that_nobody_watched_is_in_the_first_band_after_a_pause(moved_n):
    thrust_filter = ThrustFilter(S, 0)
    for k in range(600):
        thrust_filter.step(inputs(k, 3000.0, 3000.0))
    blind = thrust_filter.step(inputs(640))  # N1 is held as it was, at rest
    assert abs(moved_n) < 1.96 * blind.thrust_std_n
    seen = [thrust_filter.step(inputs(641 + k, 3000.0 + moved_n, 3000.0 + moved_n)) for k in range(10)]
    assert all(abs(e.thrust_n - 3000.0 - moved_n) < 1.96 * e.thrust_std_n for e in seen)
    assert seen[0].thrust_std_n < 0.1 * blind.thrust_std_n


def test_engine_off_is_a_thrust_of_zero_and_a_zero_before_it_runs_for_the_first_time():
    thrust_filter, calibrated = ThrustFilter(FusionSettings(), 1), []
    for k in range(600):
        n1_pct = 0.0 if k < 300 or k > 400 else 30.0
        estimate = thrust_filter.step(inputs(k, 85.0, nan, n1_pct=n1_pct, unlit=n1_pct < 25.0))
        calibrated.append(thrust_filter.calibrates)
    assert sum(calibrated) == 1
    assert estimate.status & Status.ENGINE_OFF
    assert abs(estimate.thrust_n) < 20.0
    assert estimate.mount_bias_n == pytest.approx(85.0, abs=25.0)


def test_an_n1_of_nothing_alone_stops_no_engine():
    """Fuel flow and N2 say that it burns: brochure and mounts are listened to."""
    thrust_filter = ThrustFilter(FusionSettings(), 0)
    for k in range(300):
        n1_pct = dict(n1_pct=0.0, unlit=True) if k < 100 else dict(n1_pct=0.0, burns=True)
        thrust_n = 5.0 * max(k - 100, 0)
        estimate = thrust_filter.step(inputs(k, thrust_n, thrust_n, **n1_pct))
        assert bool(estimate.status & Status.ENGINE_OFF) == (31 <= k < 100) or k == 30
        assert k < 31 or abs(estimate.thrust_n - thrust_n) < 1.96 * estimate.thrust_std_n


@pytest.mark.parametrize(("mount_n", "off"), [(150.0, True), (600.0, True), (5000.0, False)])
def test_what_the_mounts_of_an_engine_show_that_nobody_else_hears_is_in_the_band(mount_n, off):
    """It ran; then fuel flow and spools say that it does not. Beyond the mounts' errors nothing tells who is right."""
    thrust_filter = ThrustFilter(FusionSettings(), 0)
    for k in range(400):
        silent = k > 200
        said = dict(n1_pct=0.0, unlit=True, installed_n=200.0) if silent else dict(burns=True)
        estimate = thrust_filter.step(inputs(k, mount_n, nan if silent else mount_n, **said))
    assert bool(estimate.status & Status.ENGINE_OFF) == off and bool(estimate.status & Status.DISAGREE) != off
    assert not thrust_filter.calibrates
    for thrust_n in (0.0, mount_n):
        assert abs(estimate.thrust_n - thrust_n) < 1.96 * hypot(estimate.thrust_std_n, MOUNT_STD_N)


def test_data_of_an_engine_that_fall_to_nothing_leave_one_answer_and_a_band_that_holds_both():
    """The thrust of an engine that is off was measured with, in turn with the mounts: 46 % of a flight's estimates were
    3 to 14.8 sigmas off."""
    thrust_filter, thrusts = ThrustFilter(FusionSettings(), 0, 0.5 / HZ), []  # forces are means over a step
    rng = np.random.default_rng(0)
    for k in range(800):
        dead = k > 200
        said = dict(n1_pct=0.0, unlit=True) if dead else dict(burns=True)
        mount_n, brochure_n = 1770.0 + rng.normal(0, 5.0), -200.0 if dead else 1770.0
        falls_pct_s = -650.0 * 0.82 ** (k - 201) if dead else 0.0  # N1, low-passed
        estimate = thrust_filter.step(inputs(k, mount_n, brochure_n, n1_rate=falls_pct_s, **said))
        if dead:
            assert estimate.status & Status.DISAGREE and not estimate.status & Status.ENGINE_OFF
            assert all(
                abs(estimate.thrust_n - t) < 1.96 * hypot(estimate.thrust_std_n, MOUNT_STD_N) for t in (0.0, 1770.0)
            )
            thrusts.append(estimate.thrust_n)
    assert np.abs(np.diff(thrusts)).max() < 100.0


odd = st.sampled_from((nan, inf, -inf, 0.0, 1e9, -1e9, 3000.0))


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(odd, odd, odd, odd, odd, odd), min_size=1, max_size=30))
def test_nothing_poisons_the_filter(rows):
    thrust_filter, _ = settled()
    for k, (mount, mount_std, brochure, brochure_std, n1, rate) in enumerate(rows):
        estimate = thrust_filter.step(
            FusionInputs((400 + k) * STEP_NS, mount, abs(mount_std), brochure, abs(brochure_std), n1, rate).row()
        )
        assert np.isfinite([estimate.thrust_n, estimate.thrust_std_n, estimate.mount_bias_n]).all()


def test_time_that_stands_still_or_goes_back_is_survived():
    thrust_filter, _ = settled()
    for k in (300, 300, 100, 5000):
        assert np.isfinite(thrust_filter.step(inputs(k, 3000.0, 3050.0)).thrust_std_n)


def test_a_restored_filter_goes_on_as_the_first():
    first, _ = settled()
    second = ThrustFilter(FusionSettings(), 0)
    assert second.restore(first.snapshot())
    for k in range(300, 420):
        if k == 310:
            for each in (first, second):
                each.begin_anew(3020.0, 70.0, inputs(k, 3010.0, 3040.0))
        both = [each.step(inputs(k, 3010.0, 3040.0)) for each in (first, second)]
        np.testing.assert_array_equal(*both)  # NaN, too


@pytest.mark.parametrize("change", [{"now": [nan] * 33}, {"now": [0.0] * 33}, {"past": [1.0]}, {"clock": None}])
def test_a_damaged_memory_is_refused(change):
    first, _ = settled()
    memory = {key: value for key, value in {**first.snapshot(), **change}.items() if value is not None}
    second = ThrustFilter(FusionSettings(), 0)
    before = second.snapshot()
    assert not second.restore(memory)
    assert second.snapshot() == before


def test_settings_must_be_positive():
    with pytest.raises(ConfigError, match=r"fusion\.gate_chi2 = -1"):
        check_settings(FusionSettings(gate_chi2=-1.0), "x.toml")


def test_a_mean_over_a_step_is_half_a_step_old():
    """A slam of 2 kN/s, told ten times a second as the mean of the last tenth."""
    late_n = []
    for age_s in (0.0, 0.05):
        thrust_filter = ThrustFilter(FusionSettings(), 0, mount_age_s=age_s)
        for k in range(160):
            thrust_n = 1000.0 + 200.0 * max(k - 100, 0)
            rate = 3.0 if k > 100 else 0.0
            estimate = thrust_filter.step(inputs(k, thrust_n - (100.0 if k > 101 else 0.0), nan, 60.0, rate))
        late_n.append(abs(estimate.thrust_n - thrust_n))
    assert late_n[0] > 80.0
    assert late_n[1] < 10.0


def test_a_band_that_is_wide_again_is_no_start_but_behind_a_pause():
    """A throttle that moves on one source widens the band beyond that of a start: the estimate stays valid."""
    thrust_filter = ThrustFilter(S, 0)
    for k in range(200):
        estimate = thrust_filter.step(inputs(k, mount_n=3000.0))
    assert not estimate.status & Status.CONVERGING
    for k in range(200, 230):
        estimate = thrust_filter.step(inputs(k, n1_rate=20.0))
    assert estimate.thrust_std_n > S.converging_std_n
    assert not estimate.status & Status.CONVERGING
    assert thrust_filter.step(inputs(400)).status & Status.CONVERGING


def test_a_bank_that_says_another_thrust_is_in_the_band_until_it_says_more():
    """It saw N1 and N2, the filter a fuel flow that is wrong by a fifth: 807 N apart, at a sigma of 188 N."""

    def weighed(lead_n):
        return Weighed(np.array([[1.0, 0.0, 0.0]]), 0, 0.0, np.ones(1), lead_n)

    thrust_filter = ThrustFilter(S, 0)
    before = [thrust_filter.step(inputs(k, 3000.0, 3000.0), weighed(nan)) for k in range(100)][-1]
    apart = thrust_filter.step(inputs(100, 3000.0, 3000.0), weighed(3600.0))
    assert apart.thrust_n == pytest.approx(3000.0, abs=5.0)
    assert apart.thrust_std_n == pytest.approx(hypot(before.thrust_std_n, 600.0), rel=0.01)
    moved = [thrust_filter.step(inputs(k, 2500.0, 2500.0, 70.0, -60.0), weighed(3600.0)) for k in range(101, 104)][-1]
    assert moved.thrust_n < 2900.0  # the same word, of the thrust that was
    assert moved.thrust_std_n == pytest.approx(600.0, rel=0.05)
    again = thrust_filter.step(inputs(104, 2500.0, 2500.0), weighed(moved.thrust_n))
    assert again.thrust_std_n < 150.0
    assert thrust_filter.step(inputs(105, 2500.0, 2500.0), weighed(nan)).thrust_std_n < 150.0  # an engine that stopped
