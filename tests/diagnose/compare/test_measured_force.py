"""A measured force that is another unit's, or no load, is said before an effect is made of it."""

import numpy as np
import pytest

from tests.diagnose.scene import inertia, mount, record
from thrustd.core.errors import RecordingError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.measured_force import another_unit, no_load
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.records.roles import Roles, with_trusted_units

BASE = record(n=6000)
LOAD_N = 3000.0 + 2500.0 * np.sin(0.01 * np.arange(4000))
NOISE_N = np.random.default_rng(0).normal(0.0, 60.0, 4000)


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (1 / 4.448, "0.225 times what the model says: is force_N in lbf?"),
        (0.227, "force_N in lbf?"),
        (1e-3, "deformation_mm in um or force_N in kN?"),
        (1 / 9.8, "force_N in daN or force_N in kgf?"),
        (4.448, "4.45 times what the model says: is the model made of force_N in lbf?"),
        (1.0, ""), (1.05, ""), (0.5, ""), (0.28, ""), (-1.0, ""),
    ],
)  # fmt: skip
def test_a_gain_that_is_the_ratio_of_two_units_is_named(gain, words):
    said = another_unit(LOAD_N, gain * (LOAD_N + NOISE_N) + 40.0, Roles())
    assert said.endswith(words) and bool(said) == bool(words)


def test_it_is_none_where_the_force_goes_otherwise_or_is_in_no_unit_of_force():
    assert another_unit(LOAD_N, (LOAD_N + 60.0 * NOISE_N) / 4.448, Roles()) == ""
    assert another_unit(LOAD_N, LOAD_N / 4.448, Roles(output="Stress [kPa]")) == ""
    assert "is Load [kN] in" in another_unit(LOAD_N, LOAD_N * 1000.0 / 4.448, Roles(output="Load [kN]"))


@pytest.mark.parametrize("value", [36e3, -36e3, 1e9])
def test_two_samples_that_are_no_load_are_said_with_time_and_value(value):
    """No effect was found beside them: the verdict was `unknown`, without a word of why."""
    force_n = BASE["force_N"].copy()
    force_n[[2000, 4001]] = value
    data = BASE.with_channels(force_N=force_n)
    line = rf"measured: force_N is {value:.4g} N at 100\.0 s, one of 2 \(of 6000\) that no load is".replace("+", r"\+")
    for ask in (diagnose, lambda spec, given: extend(spec, given, ["axial_inertia"])):
        with pytest.raises(RecordingError, match=line + ".*expected such samples empty or excluded"):
            ask(mount(), [data])
    assert any("that no load is" in remark for remark in compare({"mount": mount()}, [data]).remarks)


def test_compare_says_it_and_goes_on_and_who_vouches_for_the_unit_is_believed():
    pounds = BASE.with_channels(force_N=BASE["force_N"] / 4.4482)
    assert any("is force_N in lbf?" in remark for remark in compare({"mount": mount()}, [pounds]).remarks)
    assert "lbf" not in " ".join(diagnose(mount(), [with_trusted_units(pounds)]).advice)


def test_a_healthy_record_with_an_effect_has_nothing_to_be_said():
    data = record(effects=[inertia(170.0)], n=6000)
    assert compare({"mount": mount()}, [data]).remarks == ()
    assert no_load(LOAD_N, LOAD_N + NOISE_N, LOAD_N, mount(), Roles()) == ""
