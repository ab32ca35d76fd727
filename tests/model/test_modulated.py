"""An effect whose strength follows a channel is that effect times the channel, on the ground, in flight and in C."""

import numpy as np
import pytest

from thrustd.core.errors import ModelError
from thrustd.model.c_function import Library
from thrustd.model.effects import effect_named

N, DT_S = 2000, 0.05
D = np.sin(np.arange(N) * DT_S)
VOLTAGE = np.linspace(0.0, 4.0, N)
FRICTION = {"friction_n": 100.0, "yield_mm": 0.05}


def run(name, parameters, columns):
    effect = effect_named(name)
    return effect.stage(effect.neutral() | parameters, DT_S).from_rest(columns, np.zeros(N))


def test_it_grows_with_the_channel():
    plain = run("hysteresis", FRICTION, {"deformation_mm": D})
    by = run("hysteresis by voltage_V", FRICTION | {"full_at": 2.0}, {"deformation_mm": D, "voltage_V": VOLTAGE})
    assert np.array_equal(by, plain * VOLTAGE / 2.0)


def test_it_fades_to_nothing_and_not_below():
    ends = {"absent_at": 2.0, "full_at": 0.0}
    by = run("hysteresis by voltage_V", FRICTION | ends, {"deformation_mm": D, "voltage_V": VOLTAGE})
    assert np.ptp(by[: N // 2]) > 100.0
    assert not by[N // 2 + 1 :].any()


def test_the_channel_acts_late_and_not_in_proportion():
    """A coil behind its voltage, and a magnet that saturates: a step of the channel lets the effect in by steps."""
    step = np.where(np.arange(N) < N // 2, 0.0, 2.0)
    plain = run("hysteresis", FRICTION, {"deformation_mm": D})
    late = {"full_at": 2.0, "channel_late_s": 1.0, "channel_exponent": 0.5}
    by = run("hysteresis by voltage_V", FRICTION | late, {"deformation_mm": D, "voltage_V": step})
    since = (np.arange(N) - N // 2 + 1) * DT_S
    share = np.sqrt(np.where(since > 0.0, 1.0 - np.exp(-since), 0.0))
    np.testing.assert_allclose(by, share * plain, atol=1e-9)


def test_a_channel_that_is_there_from_the_beginning_was_there_before():
    late = FRICTION | {"full_at": 2.0, "channel_late_s": 5.0}
    by = run("hysteresis by voltage_V", late, {"deformation_mm": D, "voltage_V": np.full(N, 2.0)})
    np.testing.assert_allclose(by, run("hysteresis", FRICTION, {"deformation_mm": D}))


def test_some_of_it_is_there_without_the_channel():
    plain = run("hysteresis", FRICTION, {"deformation_mm": D})
    rest = FRICTION | {"full_at": 4.0, "channel_rest": 0.25}
    by = run("hysteresis by voltage_V", rest, {"deformation_mm": D, "voltage_V": VOLTAGE})
    np.testing.assert_allclose(by, plain * (0.25 + 0.75 * VOLTAGE / 4.0))


@pytest.mark.parametrize(("level", "slope", "most"), [(0.0, 0.5, 0.5), (1.0, 1.0, 0.5), (0.5, 0.5**0.5, 0.5)])
def test_its_level_alone_may_follow(level: float, slope: float, most: float):
    """Half the voltage: half the largest force, and of the slope at small rates as much as is no level."""
    law = {"damping_n_s_mm": 100.0, "saturates_mm_s": 1.0, "sharpness": 8.0, "filter_s": 0.05}
    by = law | {"full_at": 4.0, "channel_level": level}
    half = np.full(N, 2.0)
    for rate, expected in ((0.01, slope), (100.0, most)):
        d = rate * DT_S * np.arange(N)
        plain = run("viscous_damping_saturating", law, {"deformation_mm": d})
        found = run("viscous_damping_saturating by voltage_V", by, {"deformation_mm": d, "voltage_V": half})
        assert found[-1] == pytest.approx(expected * plain[-1], rel=1e-3)


def test_a_law_without_a_scale_has_no_level():
    assert "channel_level" in effect_named("hysteresis_coulomb by voltage_V").neutral()
    assert "channel_level" not in effect_named("viscous_damping by voltage_V").neutral()
    assert "channel_level" not in effect_named("payne_own by voltage_V").neutral()


def test_neutral_is_identity():
    effect = effect_named("viscous_damping by voltage_V")
    v = 5000.0 * D
    columns = {"deformation_mm": D, "voltage_V": VOLTAGE}
    assert np.array_equal(effect.stage(effect.neutral(), DT_S).from_rest(columns, v), v)


def test_a_variant_goes_by_its_own_word():
    assert effect_named("hysteresis_coulomb by voltage_V").word == "hysteresis by voltage_V"
    assert effect_named("hysteresis by voltage_V") is effect_named("hysteresis by voltage_V")


def test_two_of_them_are_two_functions_of_c():
    library = Library("m")
    laws = "hysteresis", "viscous_damping", "viscous_damping_saturating"  # with a level of its own, and without
    names = [library.add(effect_named(f"{law} by voltage_V").step) for law in laws]
    assert len(set(names)) == 3 and all(name in library.text() for name in names)


def test_a_law_that_is_none():
    with pytest.raises(ModelError, match="unknown effect 'gravity'"):
        effect_named("gravity by voltage_V")
