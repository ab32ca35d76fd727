"""One mount in flight against the same model on the ground."""

import numpy as np
import pytest

from tests.conftest import simple_model
from thrustd.columns import GOOD, MOUNT_STATE
from thrustd.fusion.mounts import MountCombiner
from thrustd.model.artifact import EffectSpec, LinearBlock, RealMode
from thrustd.model.compile import compile_model
from thrustd.mount_route import MountRoute
from thrustd.mount_start import LOAD_AGE_S, Unseen
from thrustd.sync import align
from thrustd.sync.grid import Grid
from thrustd.sync.hold import Hold

RATE_HZ = 100.0
EFFECTS = [
    EffectSpec("axial_inertia", {"mass_kg": 186.5}),
    EffectSpec("hysteresis_prandtl_ishlinskii", {"friction_n": 70.0, "spread_mm": 0.1}),
    EffectSpec("viscous_damping", {"damping_n_s_mm": 100.0}),
]


@pytest.fixture(scope="module")
def model():
    return compile_model(simple_model(effects=EFFECTS), RATE_HZ)


class Bench:
    """A route, fed sample by sample through the grid as in flight."""

    def __init__(self, model):
        self._hold = Hold([("accel_x_g", 0)])
        listeners = np.array([[0, 0, model.channels.index("accel_x_g") - 1]])
        self._grid = Grid(1, len(model.channels) - 1, 10, self._hold, listeners)
        self._grid.mounts[0]["scale_mm"] = 1.0  # counts are millimetres here ...
        self.route = MountRoute(model, 50, self._grid, 0)

    def started(self, k, mm):
        self.take(k, mm)
        return self.fused(1.0)

    def fused(self, dt_s):
        self.route.fuse(dt_s)
        return self.route.state.copy()

    def take(self, k, mm, accel_x_g=0.0):
        self._grid.mounts[0]["offset_mm"] = mm  # ... and zero
        readings, samples = np.array([[0, GOOD, 0, 1]]), np.array([[0, GOOD, k, k * 10_000, 0]])
        t_ns, kind = np.array([k * 10_000_000]), np.zeros(1, np.uint8)
        self._grid.begin()
        while (stop := self._grid.align(t_ns, kind, readings, np.array([accel_x_g]), samples)) != align.DONE:
            if stop == align.CATCH_UP:
                self.route.catch_up(k, mm)
            if stop == align.FULL:
                self.route.flush()


def flown(bench, deformation_mm, accel_x_g):
    for k, (mm, g) in enumerate(zip(deformation_mm, accel_x_g, strict=True)):
        bench.take(k, mm, g)
        yield bench.fused(1 / RATE_HZ)["force_n"]


def test_flight_is_the_ground_simulation_bit_for_bit_whatever_channels_the_effects_read(model):
    t_s = np.arange(600) / RATE_HZ
    channels = {"deformation_mm": 0.4 + 0.2 * np.sin(2 * t_s), "accel_x_g": 0.05 * np.cos(t_s)}
    rows = model.inputs(channels)
    held = lambda mm: np.where(np.isin(model.channels, "deformation_mm"), mm, rows[0])  # noqa: E731
    start = Unseen(model).start(held, rows[0, 0], None, LOAD_AGE_S, 0.0)
    assert list(flown(Bench(model), *channels.values())) == model.simulate(rows, start).tolist()


def test_idle_in_flight_is_a_load_that_fell(model):
    """Found at idle: the same until somebody says that the aircraft flies; long after the start it is no news."""
    down_mm = np.concatenate([np.linspace(0.0, 0.8, 100), np.linspace(0.8, 0.05, 100), np.full(100, 0.05)])
    true_n = model.simulate(model.inputs({"deformation_mm": down_mm, "accel_x_g": 0.0 * down_mm}))[-1]
    late, whole = Bench(model), Bench(model)
    found_n = late.started(0, 0.05)["force_n"]
    late.route.fly()
    late.take(1, 0.05)
    assert abs(late.fused(0.01)["force_n"] - true_n) < 0.3 * abs(found_n - true_n)
    for k in range(300):
        whole.take(k, 0.05)
    before = whole.route.snapshot()
    whole.route.fly()
    assert whole.route.snapshot() == before


def test_a_mount_that_is_known_does_not_start_anew_because_somebody_says_that_the_aircraft_flies(model):
    """After a warm restart and after a gap the state is that of before, however short ago that was."""
    before, after = Bench(model), Bench(model)
    for k, mm in enumerate(np.linspace(0.3, 0.6, 200)):
        before.take(k, mm)
    assert after.route.restore(before.route.snapshot())
    after.route.resume(199, 0)
    for each in (before, after):
        each.take(200 + round(0.8 * RATE_HZ), 0.6)  # nobody has seen what was between
        known = each.route.snapshot()
        each.route.fly()
        assert each.route.snapshot() == known


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


def both_mounts():
    return np.array([(0.4, 2000.0, 50.0, 40.0, False, False)] * 2, MOUNT_STATE)


def test_both_mounts_of_an_engine_do_not_know_it_together():
    mounts = both_mounts()
    (both,) = MountCombiner([(0, 1)]).step(mounts, np.ones(2, np.bool_), 0.1)
    assert both["std_n"] == pytest.approx(np.hypot(np.hypot(30.0, 30.0), 40.0 + 40.0))


@pytest.mark.parametrize(
    ("moved_mm", "push_n"),
    [((0.1, 0.1), 0.1 * 11033), ((-0.2, -0.1), -0.1 * 11033), ((0.5, 0.0), 0.0), ((0.5, -0.1), 0.0)],
)
def test_a_push_is_what_both_mounts_were_moved_by(moved_mm, push_n):
    combiner, believed = MountCombiner([(0, 1)]), np.ones(2, np.bool_)
    mounts = both_mounts()
    assert combiner.step(mounts, believed, 0.1)[0]["push_n"] == 0.0
    mounts["deformation_mm"] += moved_mm
    assert combiner.step(mounts, believed, 0.1)[0]["push_n"] == pytest.approx(push_n)
    for _ in range(50):
        (rested,) = combiner.step(mounts, believed, 0.1)
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
