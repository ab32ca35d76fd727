"""What a diagnosis shows sample by sample: the residual that every other page shows, less what each set takes off."""

import numpy as np
import pytest

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount, record
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.told import ParameterEstimate
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording


@pytest.fixture(scope="module")
def data():
    hidden = EffectSpec("axial_inertia", {"mass_kg": 300.0})
    return record([hidden], added=lambda c: -250.0 * np.exp(-c["time_s"] / 30.0))


def test_the_residual_is_the_one_that_compare_shows(data):
    found = diagnose(mount(), [data], beside=True).explained
    (shown,) = compare({"mount": mount()}, [data]).comparisons
    (stretch,) = found.stretches
    assert np.array_equal(stretch.time_s, shown.time_s)
    assert np.allclose(stretch.residual_n, shown.residual_n)
    later = stretch.time_s > 120.0
    left_n = (stretch.residual_n - stretch.explained_n[0])[later]
    assert found.words[0] == ("axial_inertia",) and float(np.sqrt(np.mean(left_n**2))) < 14.0


def test_the_past_of_a_record_is_no_part_of_its_picture():
    """A logger that starts two minutes after the load."""
    data = columns(14_400)
    data["deformation_mm"][:4000] = 0.8
    data["deformation_mm"][0] = 0.0
    slow = mount(gains=(0.05, 0.4), taus_s=(0.4, 120.0))
    model = compile_model(slow, 1 / DT_S)
    noise_n = np.random.default_rng(3).normal(0.0, NOISE_N, 14_400)
    force_n = model.simulate(model.inputs(data)) + 300.0 * 9.80665 * data["accel_x_g"] + noise_n
    late = make_recording("late", {name: column[2400:] for name, column in (data | {"force_N": force_n}).items()})
    report = diagnose(slow, [late], beside=True)
    (stretch,) = report.explained.stretches
    assert report.verdict == ("axial_inertia",)
    assert stretch.time_s == pytest.approx(late.time_s)
    assert {len(column) for column in stretch.channels.values()} == {len(late)}
    left_n = (stretch.residual_n - stretch.explained_n[0])[:2000]
    assert np.isfinite(left_n).all() and float(np.sqrt(np.mean(left_n**2))) < 1.2 * NOISE_N


def test_without_a_picture_nothing_is_run_for_one(data):
    assert diagnose(mount(), [data]).explained is None


def test_a_size_stands_beside_the_expected_one():
    drag = ParameterEstimate("nacelle_drag", "drag_area_m2", 0.0706, 0.0005, "m2", "about 0.02 m2")
    assert drag.sentence.endswith("0.0706 +- 0.00098 m2 (95 %); expected on PH-LAB: about 0.02 m2")
