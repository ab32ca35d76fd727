"""PH-LAB recordings: units, signs and derived channels; the real files where they are at hand."""

from pathlib import Path

import numpy as np
import pytest

from thrustd.records.files import read_recording
from thrustd.records.phlab import from_ftis, from_openap

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "ph_lab"


def flight(name: str):
    if not (DATA / name).exists():
        pytest.skip(f"{name} is not at hand")
    return read_recording(DATA / name)


def test_ftis_units_and_the_missing_g():
    raw = {
        name: np.array([x, x]) for name, x in {"Dadc1_mach": 0.3, "Dadc1_alt": 1000.0, "Ahrs1_bNormAcc": -1.0}.items()
    }
    raw |= {"time": np.array([9.0, 9.1]), "lh_engine_FMF": np.array([1000.0, 1000.0])}
    columns = from_ftis(raw, {}, "flight").columns
    assert columns["accel_z_g"].tolist() == [0.0, 0.0]  # free fall
    assert columns["fuel_flow_kg_s_left"][0] == pytest.approx(0.12600, rel=1e-4)
    assert columns["pressure_altitude_m"][0] == pytest.approx(304.8)


def test_openap_steady_climb_feels_gravity_along_the_body():
    n = 20
    raw = {
        "ts": np.arange(n) * 1.0,
        "tas": np.full(n, 200.0),
        "roc": np.full(n, 2000.0),
        "alt": np.full(n, 5000.0),
        "mach": np.full(n, 0.31),
        "mass": np.full(n, 6300.0),
        "acc": np.zeros(n),
        "ff_l": np.full(n, 0.1),
    }
    columns = from_openap(raw, "flight").columns
    pitch = np.radians(columns["pitch_deg"])
    assert columns["accel_x_g"] == pytest.approx(np.sin(pitch), abs=1e-9)
    assert columns["accel_z_g"] == pytest.approx(np.cos(pitch), abs=1e-9)
    assert pitch[0] > np.arcsin(2000 * 0.3048 / 60 / (200 * 1852 / 3600)) - 0.01


def test_reference_flight_signs():
    record = flight("ftis_20180312_ref.npz")
    steady = (np.abs(record["roll_deg"]) < 3) & (record["mach"] > 0.2)
    assert np.median(record["accel_z_g"][steady]) == pytest.approx(1.0, abs=0.02)
    gathering = np.gradient(record["tas_m_s"], record.time_s) / 9.80665
    felt = (record["accel_x_g"] - gathering)[steady]  # forward +: nose up is felt as forward specific force
    slope = np.polyfit(np.sin(np.radians(record["pitch_deg"][steady])), felt, 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)
    assert record.sample_hz == pytest.approx(10.0)


def test_openap_flight_is_plausible():
    record = flight("openap_phlab_20170320_08.npz")
    flying = record["mach"] > 0.2
    assert np.median(record["accel_z_g"][flying]) == pytest.approx(1.0, abs=0.03)
    assert any("derived" in note for note in record.notes)
