"""One mount in flight against the same model on the ground."""

import msgspec
import numpy as np
import pytest

from tests.conftest import simple_model
from thrustd.core.calibration import MountCalibration, Zero
from thrustd.core.columns import GOOD, MOUNT_STATE
from thrustd.fusion.settings import FusionSettings
from thrustd.model.artifact import EffectSpec, ErrorMap, LinearBlock, RealMode, ValidRange
from thrustd.model.compile import compile_model
from thrustd.mounts.source import NOTHING_MEASURED, MountSource, upper_share
from thrustd.mounts.start import LOAD_AGE_S, Past, Unseen
from thrustd.mounts.step import IN_SHEAR_STD
from thrustd.sensors.engine_force import MountCombiner
from thrustd.sync import align
from thrustd.sync.grid import Grid
from thrustd.sync.hold import Hold

SPRINGS = 5079.0, 5954.0  # N/mm
RATE_HZ = 100.0
COUNT_MM = 2.0**-40
EFFECTS = [
    EffectSpec("axial_inertia", {"mass_kg": 186.5}),
    EffectSpec("hysteresis_prandtl_ishlinskii", {"friction_n": 70.0, "spread_mm": 0.1}),
    EffectSpec("viscous_damping", {"damping_n_s_mm": 100.0}),
]

UNDER_LOAD = MountCalibration(gain_std=0.003)  # a tethered run has told gain and zero
BEYOND = MountCalibration(gain_std=0.004, beyond_std=0.025, told_mm=0.1)


@pytest.fixture(scope="module")
def model():
    return compile_model(simple_model(effects=EFFECTS), RATE_HZ)


@pytest.fixture(scope="module")
def precise():
    """The same, and known to 3 N."""
    error = ErrorMap((0.0, 1e4), (0.0, 1e4), ((3.0,),))
    return compile_model(simple_model(effects=EFFECTS, error=error), RATE_HZ)


class Bench:
    """A source, fed sample by sample through the grid as in flight."""

    def __init__(self, model, measured=NOTHING_MEASURED):
        self._hold = Hold([("accel_x_g", 0)])
        listeners = np.array([[0, 0, model.channels.index("accel_x_g") - 1]])
        self._grid = Grid(1, len(model.channels) - 1, 10, self._hold, listeners)
        self._grid.mounts[0]["scale_mm"] = COUNT_MM
        self.source = MountSource(model, 50, self._grid, 0, FusionSettings(), measured)

    def started(self, k, mm):
        self.take(k, mm)
        return self.fused(1.0)

    def fused(self, dt_s):
        self.source.fuse(dt_s)
        return self.source.state.copy()

    def take(self, k, mm, accel_x_g=0.0):
        readings, samples = np.array([[0, GOOD, 0, 1]]), np.array([[0, GOOD, k, k * 10_000, round(mm / COUNT_MM)]])
        t_ns, kind = np.array([k * 10_000_000]), np.zeros(1, np.uint8)
        self._grid.begin()
        while (stop := self._grid.align(t_ns, kind, readings, np.array([accel_x_g]), samples)) != align.DONE:
            if stop == align.CATCH_UP:
                self.source.catch_up(k, float(self._grid.state["offered_mm"][0]))
            if stop == align.FULL:
                self.source.flush()


def flown(bench, deformation_mm, accel_x_g):
    for k, (mm, g) in enumerate(zip(deformation_mm, accel_x_g, strict=True)):
        bench.take(k, mm, g)
        yield bench.fused(1 / RATE_HZ)["force_n"]


def test_flight_is_the_ground_simulation_bit_for_bit_whatever_channels_the_effects_read(model):
    t_s = np.arange(600) / RATE_HZ
    channels = {
        "deformation_mm": np.round((0.4 + 0.2 * np.sin(2 * t_s)) / COUNT_MM) * COUNT_MM,
        "accel_x_g": 0.05 * np.cos(t_s),
    }
    rows = model.inputs(channels)
    held = lambda mm: np.where(np.isin(model.channels, "deformation_mm"), mm, rows[0])  # noqa: E731
    start = Unseen(model).start(held, rows[0, 0], Past(None, LOAD_AGE_S))
    assert list(flown(Bench(model), *channels.values())) == model.simulate(rows, start).tolist()


@pytest.mark.parametrize("zero_mm", [-0.009, 0.006, 0.011])
def test_a_zero_takes_the_zero_off_at_every_load_and_the_band_knows(precise, zero_mm):
    true_mm = np.concatenate([np.zeros(300), np.linspace(0.0, 0.9, 300), np.full(100, 0.9)])
    right, wrong, calibrated = Bench(precise), Bench(precise), Bench(precise)
    for k, mm in enumerate(true_mm):
        right_n, wrong_n, calibrated_n = (each.fused(1 / RATE_HZ)["force_n"] for each in (right, wrong, calibrated))
        for each, zero in ((right, 0.0), (wrong, zero_mm), (calibrated, zero_mm)):
            each.take(k, mm + zero)
        if k == 299:
            calibrated.fused(1 / RATE_HZ)
            calibrated.source.calibrate()
            assert not calibrated.source._unseen.branched  # nothing is left to doubt in its friction
            before, other = calibrated.source.snapshot(), Bench(precise)
            assert other.source.restore(before) and other.source.snapshot() == before
    assert abs(wrong_n - right_n) > 20.0
    assert abs(calibrated_n - right_n) < 0.1 * abs(wrong_n - right_n)
    assert calibrated.source.state["std_n"] < 0.8 * wrong.source.state["std_n"]


def fallen(model):
    """Deformations of a mount that went up and down again until it carried nothing, and stands there."""
    down_mm = np.concatenate([np.linspace(0.0, 0.9, 200), np.linspace(0.9, -0.05, 400)])
    force_n = model.simulate(model.inputs({"deformation_mm": down_mm, "accel_x_g": 0.0 * down_mm}))
    held_mm = down_mm[200 + np.flatnonzero(force_n[200:] < 0.0)[0]]
    taxi_mm = np.concatenate([np.full(3000, held_mm), np.linspace(held_mm, 0.9, 300)])
    whole_mm = np.concatenate([down_mm[:200], np.linspace(0.9, held_mm, 300), taxi_mm])
    return whole_mm, taxi_mm


def found_standing(bench, taxi_mm):
    """What is said of a mount that is calibrated after 3 s of standing."""
    said_n = []
    for k, n in enumerate(flown(bench, taxi_mm, 0.0 * taxi_mm)):
        said_n.append(n)
        if k == 300:
            bench.source.calibrate()
    return said_n


def test_what_friction_holds_since_the_last_flight_is_no_zero(precise):
    """The load fell long ago: far more than a zero. After the next take-off nothing is left of it."""
    whole_mm, taxi_mm = fallen(precise)
    *_, true_n = flown(Bench(precise), whole_mm, 0.0 * whole_mm)
    said_n = found_standing(Bench(precise), taxi_mm)
    new_n = precise.simulate(precise.inputs({"deformation_mm": taxi_mm[:1], "accel_x_g": np.zeros(1)}))[0]
    assert abs(said_n[2999]) < 0.6 * new_n
    assert said_n[-1] == pytest.approx(true_n, abs=20.0)


def test_a_zero_found_under_load_stands_and_friction_holds_the_rest(precise):
    """However little is shown: nobody at rest can tell a zero from what friction kept."""
    whole_mm, taxi_mm = fallen(precise)
    *_, true_n = flown(Bench(precise), whole_mm, 0.0 * whole_mm)
    new_n = precise.simulate(precise.inputs({"deformation_mm": taxi_mm[:1], "accel_x_g": np.zeros(1)}))[0]
    for zero_mm in (0.0, 0.004):
        measured = MountCalibration(zeros=(Zero("2026-01-01", zero_mm, 0.002),), gain_std=0.004)
        bench = Bench(precise, measured)
        said_n = found_standing(bench, taxi_mm + zero_mm)
        assert bench.source.snapshot()["zero"] == [zero_mm, 0.002]
        assert abs(said_n[400]) < 0.5 * new_n  # the rest is creep
        assert said_n[-1] == pytest.approx(true_n, abs=20.0)


@pytest.mark.parametrize("shown_mm", [0.1, -0.04])
def test_what_is_too_large_for_a_zero_is_not_taken_and_stays_in_the_band(precise, shown_mm):
    bench, mm = Bench(precise), np.full(400, shown_mm)
    for _ in flown(bench, mm, 0.0 * mm):
        pass
    zero_mm, std_mm = bench.source.snapshot()["zero"]
    assert not bench.source.calibrate()
    after_mm, wider_mm = bench.source.snapshot()["zero"]
    assert after_mm == zero_mm and wider_mm == pytest.approx(np.hypot(std_mm, shown_mm), rel=0.3)


@pytest.mark.parametrize(
    ("pressed_mm", "told", "measured"),
    [
        (0.0, 0.2, NOTHING_MEASURED),
        (-0.3, IN_SHEAR_STD, NOTHING_MEASURED),
        (-0.3, IN_SHEAR_STD, UNDER_LOAD),
        (-0.3, 0.025, BEYOND),
    ],
)
def test_a_mount_is_off_by_what_no_bench_has_shown_between_its_zero_and_where_it_is(pressed_mm, told, measured):
    valid = ValidRange((0.25, 1.5), (1000.0, 7000.0))
    spec = simple_model(valid=valid, pressed_mm=pressed_mm, effects=[EffectSpec("axial_inertia", {"mass_kg": 186.5})])
    model = compile_model(spec, RATE_HZ)
    off_n = []
    for mm in (0.0, 0.1, 0.25, 1.0, 1.5, 1.6):
        bench = Bench(model, measured)
        bench.started(1, mm)
        slopes = bench.source._means["stiffness_n_mm"][0]
        off_n.append(bench.source.terms_n()["beyond_n"] / (slopes[0] if mm <= 1.5 else slopes[-1]))
    told_mm = {NOTHING_MEASURED: 0.0, UNDER_LOAD: 0.25, BEYOND: 0.1}[measured]
    below_mm = abs(np.minimum([0.0, 0.1, 0.25, 1.0, 1.5], 0.25) - told_mm)
    assert off_n[:-1] == pytest.approx((told * below_mm).tolist(), abs=1e-6)
    assert off_n[-1] == pytest.approx(np.hypot(told * below_mm[-1], 0.2 * 0.1), rel=1e-3)


@pytest.mark.parametrize("pressed_mm", [0.0, -0.3])
def test_its_terms_add_up_to_its_sigma_and_none_of_them_is_a_remainder(pressed_mm):
    """What is left was called creep, and was nothing: what a model misses of creep is in its error map."""
    bench = Bench(compile_model(simple_model(pressed_mm=pressed_mm), RATE_HZ), NOTHING_MEASURED)
    bench.started(1, 0.5)
    terms_n = bench.source.terms_n()
    assert "creep_n" not in terms_n
    assert np.hypot.reduce(list(terms_n.values())) == pytest.approx(float(bench.source.state["std_n"]), rel=1e-9)


def test_a_curve_that_is_flat_at_rest_is_not_calibrated_and_stops_nobody(model):
    bench = Bench(model)
    bench.started(0, 0.005)
    bench.source._means["stiffness_n_mm"][0, 0] = 0.0
    before = bench.source.snapshot()
    bench.source.calibrate()
    assert bench.source.snapshot() == before


@pytest.mark.parametrize("flown_mm", [0.0, 0.9])
def test_at_idle_on_the_ground_the_band_holds_new_mounts_and_those_that_have_flown(precise, flown_mm):
    """And nothing is left of the doubt once the throttle has been up."""
    past_mm = np.concatenate([np.linspace(0.0, flown_mm, 200), np.linspace(flown_mm, 0.01, 200)])
    seen_mm = np.concatenate([np.full(100, 0.06), np.linspace(0.06, 0.95, 200)])
    whole_mm = np.concatenate([past_mm, np.linspace(0.01, 0.06, 50), seen_mm])
    true_n = precise.simulate(precise.inputs({"deformation_mm": whole_mm, "accel_x_g": 0.0 * whole_mm}))[-300:]
    found, stds_n, errors_n = Bench(precise), [], []
    for n, wanted_n in zip(flown(found, seen_mm, 0.0 * seen_mm), true_n, strict=True):
        errors_n.append(abs(n - wanted_n))
        stds_n.append(float(found.source.state["std_n"]))
    assert errors_n[99] < 1.96 * stds_n[99]
    assert stds_n[-1] < 0.7 * stds_n[99]
    assert errors_n[-1] < 20.0


def test_idle_in_flight_is_a_load_that_fell(model):
    """Found at idle: the same until somebody says that the aircraft flies; long after the start it is no news."""
    down_mm = np.concatenate([np.linspace(0.0, 0.8, 100), np.linspace(0.8, 0.05, 100), np.full(100, 0.05)])
    true_n = model.simulate(model.inputs({"deformation_mm": down_mm, "accel_x_g": 0.0 * down_mm}))[-1]
    late, whole = Bench(model), Bench(model)
    found_n = late.started(0, 0.05)["force_n"]
    late.source.fly()
    late.take(1, 0.05)
    assert abs(late.fused(0.01)["force_n"] - true_n) < 0.3 * abs(found_n - true_n)
    for k in range(300):
        whole.take(k, 0.05)
    before = whole.source.snapshot()
    whole.source.fly()
    assert whole.source.snapshot() == before


@pytest.mark.parametrize("most_mm", [0.08, 0.4, 0.9])
def test_idle_in_flight_the_band_holds_mounts_that_never_carried_more(precise, most_mm):
    """Whatever they came down from; the estimate is for those that came down from a take-off."""
    past_mm = np.concatenate([np.linspace(0.0, most_mm, 200), np.linspace(most_mm, 0.08, 200), np.full(200, 0.08)])
    true_n = precise.simulate(precise.inputs({"deformation_mm": past_mm, "accel_x_g": 0.0 * past_mm}))[-1]
    found = Bench(precise)
    found.started(0, 0.08)
    found.source.fly()
    found.take(1, 0.08)
    said = found.fused(0.01)
    assert abs(said["force_n"] - true_n) < 1.96 * said["std_n"]
    again = Bench(precise)
    assert again.source.restore(found.source.snapshot()) and again.source.snapshot() == found.source.snapshot()


def test_a_mount_that_is_known_does_not_start_anew_because_somebody_says_that_the_aircraft_flies(model):
    """After a warm restart and after a gap the state is that of before, however short ago that was."""
    before, after = Bench(model), Bench(model)
    for k, mm in enumerate(np.linspace(0.3, 0.6, 200)):
        before.take(k, mm)
    assert after.source.restore(before.source.snapshot())
    after.source.resume(199, 0)
    for each in (before, after):
        each.take(200 + round(0.8 * RATE_HZ), 0.6)  # nobody has seen what was between
        known = each.source.snapshot()
        each.source.fly()
        assert each.source.snapshot() == known


def test_through_a_gap_the_effects_see_the_straight_line_too(model):
    ramp_mm, gap = np.linspace(0.2, 0.8, 200), range(80, 120)
    holed, whole = Bench(model), Bench(model)
    for k, mm in enumerate(ramp_mm):
        whole.take(k, mm)
        if k not in gap:
            holed.take(k, mm)
    assert holed.fused(1.0)["force_n"] == pytest.approx(whole.fused(1.0)["force_n"], abs=20)
    for each in (holed, whole):
        each.take(200, 0.8)
    assert holed.fused(0.01)["force_n"] == pytest.approx(whole.fused(0.01)["force_n"], abs=1e-6)


@pytest.mark.parametrize("load_s", [0, 60, 900, 3600, 10_800])
def test_a_start_under_load_knows_what_it_does_not_know(load_s):
    """The model creeps; who starts it late does not know since when it is loaded."""
    creeping = simple_model(
        linear=LinearBlock(1.1, [RealMode(400.0, -0.06), RealMode(14_400.0, -0.04)]), effects=EFFECTS[:1]
    )
    model = compile_model(creeping, 1.0)
    loaded = np.full((load_s + 1, 1), 0.6)
    true_n = model.simulate(np.hstack([loaded, 0 * loaded]), model.start(np.zeros(2)))[-1]
    found = Bench(model).started(load_s, 0.6)
    assert abs(found["force_n"] - true_n) <= 1.96 * found["common_n"]
    assert found["common_n"] < 0.05 * 0.6 * 5079
    assert Bench(model).started(0, 0.0)["common_n"] == 0.0


def test_a_mount_whose_transducer_scattered_begins_anew_and_the_band_knows():
    """What was said meanwhile has moved the model's modes and not the mount's."""
    model = compile_model(simple_model(linear=LinearBlock(1.1, [RealMode(100.0, -0.2)]), effects=EFFECTS[:1]), 1.0)
    loaded = np.full((4000, 1), 0.6)
    true_n = model.simulate(np.hstack([loaded, 0 * loaded]), model.start(np.zeros(2)))[-1]
    bench, rng = Bench(model), np.random.default_rng(0)
    for k in range(3998):
        bench.take(k, 0.6 if k < 3900 else rng.uniform(-0.5, 0.6))
    scattered = bench.started(3998, 0.6)
    bench.source.hear_again()
    again = bench.started(3999, 0.6)
    assert abs(scattered["force_n"] - true_n) > 1.96 * scattered["common_n"]
    assert abs(again["force_n"] - true_n) <= 1.96 * again["common_n"]


def both_mounts():
    return np.array([(0.4, 2000.0, 50.0, 40.0, False, False)] * 2, MOUNT_STATE)


def test_both_mounts_of_an_engine_do_not_know_it_together():
    mounts = both_mounts()
    (both,) = MountCombiner([(0, 1)], SPRINGS).step(mounts, np.ones(2, np.bool_), 0.1)
    assert both["std_n"] == pytest.approx(np.hypot(np.hypot(30.0, 30.0), 40.0 + 40.0))


def test_of_one_mount_a_mass_that_is_off_presses_on_it_what_the_load_factor_adds():
    """Both have it to opposite sides: their sum has none of it."""
    combiner = MountCombiner([(0, 1)], SPRINGS, [0.4], 0.006, couple_n_g=15.0)
    for trusted, part in ((np.array([True, False]), 0.4), (np.array([False, True]), 0.6)):
        level, pulled = (float(combiner.step(both_mounts(), trusted, 0.1, g)[0]["std_n"]) for g in (1.0, 3.0))
        assert pulled == pytest.approx(np.hypot(level, 15.0 * 2.0 / part))
        assert float(combiner.step(both_mounts(), trusted, 0.1, np.nan)[0]["std_n"]) == level  # nobody measures it
    combiner.step(both_mounts(), np.array([True, False]), 0.1, 3.0)
    terms = combiner.terms_n(0, [{"start_n": 40.0}] * 2, "start_n")
    assert terms["share_n"] == pytest.approx(np.hypot(0.006 * 2000.0 / 0.4, 15.0 * 2.0) / 0.4)
    both = np.ones(2, np.bool_)
    level, pulled = (float(combiner.step(both_mounts(), both, 0.1, g)[0]["std_n"]) for g in (1.0, 3.0))
    assert level == pulled


@pytest.mark.parametrize(
    ("moved_mm", "push_n"),
    [((0.1, 0.1), 0.1 * 11033), ((-0.2, -0.1), -0.1 * 11033), ((0.5, 0.0), 0.0), ((0.5, -0.1), 0.0)],
)
def test_a_push_is_what_both_mounts_were_moved_by(moved_mm, push_n):
    combiner, trusted = MountCombiner([(0, 1)], SPRINGS), np.ones(2, np.bool_)
    mounts = both_mounts()
    assert combiner.step(mounts, trusted, 0.1)[0]["push_n"] == 0.0
    mounts["deformation_mm"] += moved_mm
    assert combiner.step(mounts, trusted, 0.1)[0]["push_n"] == pytest.approx(push_n)
    for _ in range(50):
        (rested,) = combiner.step(mounts, trusted, 0.1)
    assert abs(rested["push_n"]) < 1.0
    assert combiner.step(mounts, np.array([True, False]), 0.1)[0]["push_n"] == 0.0


def test_a_start_under_load_does_not_know_the_branch_of_friction_until_the_throttle_has_told():
    rubbing = compile_model(simple_model(linear=LinearBlock(1.0, []), effects=EFFECTS[:2]), RATE_HZ)
    levels_mm = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.5, 50), np.linspace(0.5, 0.1, 50)])
    true_n = rubbing.simulate(rubbing.inputs({"deformation_mm": levels_mm, "accel_x_g": 0.0 * levels_mm}))
    late, doubts_n = Bench(rubbing), []
    for k in range(100, 150):
        found = late.started(k, levels_mm[k])
        doubts_n.append(found["common_n"])
        assert abs(found["force_n"] - true_n[k]) <= 1.96 * found["common_n"] + 1.0
    assert doubts_n[0] > 30.0
    assert doubts_n[-1] == 0.0


def test_the_share_of_a_mount_is_that_of_its_curve_until_the_engine_pulls(model):
    """Minutes at idle with 4 um of zero on either mount leave it, minutes of climb with another share do not."""
    grid = Grid(2, 3, 10, Hold([("accel_x_g", 0)]), np.zeros((0, 3), np.int64))
    pair = [MountSource(model, 50, grid, number, FusionSettings()) for number in (0, 1)]
    assert upper_share(*pair) == pytest.approx(0.5)
    combiner, mounts, both = MountCombiner([(0, 1)], SPRINGS, [0.46]), np.zeros(2, MOUNT_STATE), np.ones(2, np.bool_)
    mounts["std_n"] = 10.0
    for force_n, zeros_n, seconds in ((600.0, 25.0, 120), (4000.0, 60.0, 300)):
        mounts["force_n"] = 0.46 * force_n + zeros_n, 0.54 * force_n - zeros_n
        for _ in range(10 * seconds):
            (engine,) = combiner.step(mounts, both, 0.1)
        wanted = 0.46 if force_n < 1000.0 else 0.475
        assert engine["load_share"] == pytest.approx(wanted, abs=0.003)


def test_a_signal_that_speaks_for_the_first_time_has_not_jumped(model):
    """An aircraft that taxis through a turn when its logger starts: 500 N of angular acceleration, in no mount."""
    effects = [EffectSpec("lever_arm", {"right_kg_m": 800.0}), EffectSpec("axial_inertia", {"mass_kg": 186.5})]
    turning = compile_model(msgspec.structs.replace(simple_model(), effects=effects, witness=None), RATE_HZ)
    place = turning.channels.index("yaw_rate_deg_s") - 1

    def forces(heard_at):
        bench, found = Bench(turning), []
        for k in range(60):
            if k == heard_at:
                bench.source.set_channel(place, 6.0)
            bench.take(k, 0.3)
            if k % 10 == 9:
                found.append(float(bench.fused(0.1)["force_n"]))
        return found

    first, late = forces(5), forces(-1)
    assert first == pytest.approx([first[-1]] * 6, abs=1.0)
    assert late == pytest.approx([late[-1]] * 6, abs=1.0)
