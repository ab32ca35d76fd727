"""One mount in flight against the same model on the ground."""

import numpy as np
import pytest

from tests.conftest import simple_model
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.mount_route import MountRoute

RATE_HZ = 100.0
EFFECTS = [
    EffectSpec("axial_inertia", {"mass_kg": 186.5}),
    EffectSpec("hysteresis_prandtl_ishlinskii", {"friction_n": 70.0, "spread_mm": 0.1}),
    EffectSpec("viscous_damping", {"damping_n_s_mm": 100.0}),
]


@pytest.fixture(scope="module")
def model():
    return compile_model(simple_model(effects=EFFECTS), RATE_HZ)


def flown(route, deformation_mm, accel_x_g):
    position = route.signals.index("accel_x_g")
    for k, (mm, g) in enumerate(zip(deformation_mm, accel_x_g, strict=True)):
        route.set_channel(position, g)
        route.take(k, mm)
        yield route.fused(1 / RATE_HZ).force_n


def test_flight_is_the_ground_simulation_bit_for_bit_whatever_channels_the_effects_read(model):
    t_s = np.arange(600) / RATE_HZ
    channels = {"deformation_mm": 0.4 + 0.2 * np.sin(2 * t_s), "accel_x_g": 0.05 * np.cos(t_s)}
    rows = model.inputs(channels)
    assert list(flown(MountRoute(model, 50), *channels.values())) == model.simulate(rows).tolist()


def test_through_a_gap_the_effects_see_the_straight_line_too(model):
    ramp_mm, gap = np.linspace(0.2, 0.8, 200), range(80, 120)
    route, whole = MountRoute(model, 50), MountRoute(model, 50)
    for k, mm in enumerate(ramp_mm):
        whole.take(k, mm)
        if k not in gap:
            route.take(k, mm)
    assert route.fused(1.0).force_n == pytest.approx(whole.fused(1.0).force_n, abs=20)
    for each in (route, whole):
        each.take(200, 0.8)
    assert route.fused(0.01).force_n == pytest.approx(whole.fused(0.01).force_n, abs=1e-6)
