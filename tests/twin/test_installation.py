"""The twin's loads are the net thrust of the page on flight tests: what the mounts carry, plus inertia, plus drag."""

import numpy as np
import pytest

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.model.effects import effect_named
from thrustd.twin.airframe import draw_airframe
from thrustd.twin.installation import MASS_KG, PLAIN, Knobs, carried_parts, felt_g, hostile, seen_mm

DRAG_M2, UPPER = 0.04, 0.4603


@pytest.mark.parametrize("statics", [False, True])
@pytest.mark.parametrize("accel_g", [(0.0, 0.0, 1.0), (0.2, 0.0, 1.5), (-0.1, 0.05, 0.4)])
def test_two_effects_add_back_what_the_mounts_do_not_carry(statics, accel_g):
    thrust_n, pressure_pa = 6000.0, dynamic_pressure_pa(0.42, 5000.0)
    knobs = PLAIN._replace(statics=statics, drag_m2=DRAG_M2)
    carried_n = carried_parts(UPPER, knobs, np.array([thrust_n]), np.array(accel_g)[:, None], pressure_pa).sum()
    for name, size, channel in (("axial_inertia", MASS_KG, accel_g[0]), ("nacelle_drag", DRAG_M2, pressure_pa)):
        effect = effect_named(name)
        values = {effect.parameters[0].name: size}
        c = effect.prepare(values, 0.1) if effect.prepare else np.array([size])
        carried_n = effect.step(np.empty(0), c, np.array([channel]), carried_n)
    assert carried_n == pytest.approx(thrust_n)


def seen(knobs, seed=5):
    """All that knobs can change: loads, deformations as they are sent, what the accelerometer feels, mounts."""
    time_s, pressure_pa = np.arange(0.0, 10.0, 0.1), dynamic_pressure_pa(0.42, 5000.0)
    accel_g, rates_deg_s = (np.stack([size * np.sin(k * time_s) for k in (1, 2, 3)]) for size in (0.3, 5.0))
    carried_n = carried_parts(UPPER, knobs, 6000.0 + 0.0 * time_s, accel_g, pressure_pa)
    read_mm = [seen_mm(mount, 0.3 + 0.01 * time_s, 20.0 + time_s, knobs) for mount in range(4)]
    stiffness_n_mm = [mount.stiffness_n_mm for mount in draw_airframe(seed, knobs).mounts]
    return np.concatenate(
        [carried_n.ravel(), np.ravel(read_mm), felt_g(accel_g, rates_deg_s, time_s, knobs).ravel(), stiffness_n_mm]
    )


@pytest.mark.parametrize("knob", Knobs._fields)
def test_every_knob_changes_what_is_measured(knob):
    value = getattr(PLAIN, knob)
    other = True if knob == "statics" else (0.01,) * len(value) if isinstance(value, tuple) else 0.01
    base = PLAIN._replace(statics=knob == "thrust_line_mm")
    assert not np.array_equal(seen(base._replace(**{knob: other})), seen(base))


def test_a_hostile_installation_is_drawn_from_its_seed_and_errs_in_every_way_that_is_asked_for():
    one, again, other = hostile(7), hostile(7), hostile(8)
    asked = "drag_m2", "zero_mm", "bow_mm", "scale", "expansion_mm_k", "cant_deg", "arm_m", "share", "accel_zero_g"
    assert one == again and all(
        getattr(one, name) not in (getattr(PLAIN, name), getattr(other, name)) for name in asked
    )
