"""Hidden effects: the asked size, the sign physics gives, and records that keep the secret."""

import json

import numpy as np
import pytest

from thrustd.core.errors import UsageError
from thrustd.records.files import read_recording
from thrustd.twin.disturbance import DISTURBANCES, UNLISTED, Scene
from thrustd.twin.environment import moving, quiet, wander
from thrustd.twin.hide import MODEL_ERROR_N, SAMPLE_HZ, draw_mount, hidden_case, hide

ICD_NAMES = {
    "axial_inertia", "engine_weight", "hysteresis", "creep", "viscous_damping", "thermal_expansion",
    "thermal_stiffness", "free_play", "mullins_softening", "payne", "ageing", "sensor_drift", "sensor_scale",
    "nacelle_drag", "time_delay", "vibration_rectification",
}  # fmt: skip
MOUNT = draw_mount(np.random.default_rng(0))
LEVELS_N = np.repeat([1000.0, 5000.0, 1000.0, 5000.0], 2000)


def change_mm(name, amplitude, force_n=LEVELS_N, shape=None, **channels):
    """What an effect adds to the deformation, sample by sample."""
    surroundings = quiet(len(force_n), SAMPLE_HZ) | {key: np.full(len(force_n), v) for key, v in channels.items()}
    plain = Scene(force_n, surroundings, 1 / SAMPLE_HZ, MOUNT).deformation_mm()
    scene = Scene(force_n, surroundings, 1 / SAMPLE_HZ, MOUNT)
    (DISTURBANCES | UNLISTED)[name].apply(scene, amplitude, shape or {})
    return scene.deformation_mm() - plain


def test_every_effect_of_the_interface_document_can_be_hidden():
    assert set(DISTURBANCES) == ICD_NAMES


@pytest.mark.parametrize("name", [*DISTURBANCES, *UNLISTED])
def test_it_has_the_asked_size(name):
    truth = hidden_case((name,), seed=4, strength=3.0, seconds=900.0).truth
    assert truth["force_rms_n"][name][0] == pytest.approx(3.0 * MODEL_ERROR_N, rel=0.03)
    assert truth["verdict"] == ([name] if name in DISTURBANCES else ["unknown"])


def test_inertia_and_drag_unload_the_mount():
    assert change_mm("axial_inertia", 186.5, accel_x_g=0.1)[1999] == pytest.approx(-183 / 5000, rel=0.25)
    assert change_mm("nacelle_drag", 0.02, dynamic_pressure_Pa=9000.0)[1999] == pytest.approx(-180 / 5000, rel=0.25)


def test_weight_and_warmth():
    weight = change_mm("engine_weight", 1e-5, accel_z_g=1 + 500 / 1081, force_n=np.full(2000, 6000.0))[-1]
    assert weight == pytest.approx(-0.005, abs=0.001)
    assert change_mm("thermal_expansion", 0.001, temperature_degC=30.0) == pytest.approx(0.01)
    assert change_mm("thermal_stiffness", -0.01, temperature_degC=30.0)[1999] > 0


def test_friction_damping_and_play_depend_on_the_way_there():
    up, down = slice(3990, 3999), slice(5990, 5999)
    rubbed = change_mm("hysteresis", 80.0, shape={"yield_mm": 0.02})
    assert rubbed[up].mean() < 0 < rubbed[down].mean()
    play = change_mm("free_play", 0.02)
    assert play[up] == pytest.approx(0.01)
    assert play[down] == pytest.approx(-0.01)
    damped = change_mm("viscous_damping", 3000.0)
    assert damped[2001] < -0.01
    assert damped[3999] == pytest.approx(0.0, abs=2e-3)


def test_softening_needs_a_larger_load_before():
    shape = {"energy_n_mm": 600.0}
    softened = change_mm("mullins_softening", 0.1, shape=shape)
    assert softened[1999] == pytest.approx(0.0, abs=1e-6)  # never loaded more
    assert softened[5999] > 0.005  # the same force after 5 kN
    shaken = change_mm("payne", 0.1, shape={"vibration_c_mm_s": 10.0, "exponent_m": 0.6}, vibration_mm_s=10.0)
    assert shaken[1999] == pytest.approx(0.05 * 0.2, rel=0.35)


def test_sensor_effects():
    hours = np.arange(len(LEVELS_N)) / SAMPLE_HZ / 3600
    assert change_mm("sensor_drift", 0.01) == pytest.approx(0.01 * hours)
    assert change_mm("vibration_rectification", 0.5, vibration_mm_s=20.0) == pytest.approx(0.02)
    assert change_mm("sensor_scale", 0.01)[3999] == pytest.approx(0.01, rel=0.2)
    assert change_mm("time_delay", 0.5)[2001] < -0.1


def test_creep_grows_with_the_logarithm_of_time():
    crept = change_mm("creep", 0.02, force_n=np.full(round(3600 * SAMPLE_HZ), 4000.0))
    mm = 0.75
    minutes = lambda m: crept[round(m * 60 * SAMPLE_HZ) - 1]  # noqa: E731
    assert minutes(59) - minutes(10) == pytest.approx(0.02 * mm * np.log10(60 / 11), rel=0.2)


def test_ageing_and_strangers():
    aged = change_mm("ageing", 0.05, shape={"settling_h": 10.0}, force_n=np.full(72000, 4000.0))
    assert -0.05 * 0.75 < aged[-1] < -0.05 * 0.75 * 0.7  # stiffening makes the change smaller
    assert change_mm("hydraulic_line", 100.0, hydraulic_pressure_bar=113.0)[1999] == pytest.approx(-0.01, rel=0.2)
    assert change_mm("bleed_duct", 100.0, bleed_valve_pct=100.0)[1999] == pytest.approx(-0.018, rel=0.2)


def test_same_seed_same_case_other_seed_other_mount():
    one, two, other = (hidden_case(("creep",), seed, 1.0, 120.0) for seed in (1, 1, 2))
    assert np.array_equal(one.measured["deformation_mm"], two.measured["deformation_mm"])
    assert one.truth == two.truth
    assert one.truth["mount"] != other.truth["mount"]


def test_files_and_sealed_truth(tmp_path):
    hide(("axial_inertia", "unknown"), 5, 2.0, tmp_path / "case", seconds=900.0)
    names = {path.name for path in (tmp_path / "case").iterdir()}
    assert names == {"bench.csv", "measured.csv", "heldout.csv", "truth.json"}
    truth = json.loads((tmp_path / "case" / "truth.json").read_text())
    assert truth["verdict"] == ["axial_inertia", "unknown"]
    assert truth["depends_on"] in (["hydraulic_pressure_bar"], ["bleed_valve_pct"])
    bench, measured = (read_recording(tmp_path / "case" / f"{name}.csv") for name in ("bench", "measured"))
    assert len(bench) == len(measured) == 18000
    assert bench.sample_hz == pytest.approx(20.0)
    assert bench.notes == measured.notes == ()
    assert np.ptp(bench["accel_x_g"]) == 0 < np.ptp(measured["accel_x_g"])
    text = (tmp_path / "case" / "measured.csv").read_text()[:2000]
    assert "inertia" not in text
    assert set(bench.channels) == set(measured.channels)


def test_nothing_hidden_leaves_the_measured_mount_that_of_the_bench():
    case = hidden_case(("none",), 6, 3.0, 600.0)
    assert case.truth["verdict"] == ["none"]
    assert case.truth["force_rms_n"] == {}


def test_an_unknown_name_is_refused():
    with pytest.raises(UsageError, match="cannot hide 'gremlins': expected axial_inertia"):
        hidden_case(("gremlins",), 1, 1.0, 60.0)


def test_the_measured_loads_stay_inside_the_bench():
    case = hidden_case(("none",), 7, 1.0, 1800.0)
    assert case.measured["force_N"].min() > case.bench["force_N"].min()
    assert case.measured["force_N"].max() < case.bench["force_N"].max()


def test_channels_are_not_copies_of_each_other():
    rng = np.random.default_rng(3)
    force_n = 3000 + 1000 * wander(144000, SAMPLE_HZ, 60.0, rng)
    channels = moving(force_n, SAMPLE_HZ, rng)
    moved = {name: values for name, values in channels.items() if name not in ("mach", "fuel_flow_kg_s", "n1_pct")}
    correlation = np.abs(np.corrcoef(np.stack(list(moved.values())))) - np.eye(len(moved))
    assert correlation.max() < 0.9


def test_wander_has_unit_size():
    signal = wander(400_000, 20.0, 10.0, np.random.default_rng(1))
    assert signal.std() == pytest.approx(1.0, abs=0.12)
