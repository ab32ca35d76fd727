"""The twin's loads are the net thrust of the page on flight tests: what the mounts carry, plus inertia, plus drag."""

import numpy as np
import pytest

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.model.effects import effect_named
from thrustd.twin.installation import MASS_KG, PLAIN, carried_parts

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
