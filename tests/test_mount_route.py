"""One mount in flight against the same model on the ground."""

import numpy as np
import pytest

from tests.conftest import simple_model
from thrustd.columns import GOOD
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.mount_route import MountRoute
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
        yield bench.route.fused(1 / RATE_HZ).force_n


def test_flight_is_the_ground_simulation_bit_for_bit_whatever_channels_the_effects_read(model):
    t_s = np.arange(600) / RATE_HZ
    channels = {"deformation_mm": 0.4 + 0.2 * np.sin(2 * t_s), "accel_x_g": 0.05 * np.cos(t_s)}
    rows = model.inputs(channels)
    assert list(flown(Bench(model), *channels.values())) == model.simulate(rows).tolist()


def test_through_a_gap_the_effects_see_the_straight_line_too(model):
    ramp_mm, gap = np.linspace(0.2, 0.8, 200), range(80, 120)
    holed, whole = Bench(model), Bench(model)
    for k, mm in enumerate(ramp_mm):
        whole.take(k, mm)
        if k not in gap:
            holed.take(k, mm)
    assert holed.route.fused(1.0).force_n == pytest.approx(whole.route.fused(1.0).force_n, abs=20)
    for each in (holed, whole):
        each.take(200, 0.8)
    assert holed.route.fused(0.01).force_n == pytest.approx(whole.route.fused(0.01).force_n, abs=1e-6)
