"""Drag of nacelles: found where the deck knows the thrust, however wrong it is in cruise, and flown with afterwards."""

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.commission.drag import fit_drag, missing_stretch, with_drag, without_drag
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.calibration import Calibration, read_calibration, write_calibration
from thrustd.core.errors import RecordingError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.flighttest.flight import deck_thrust
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import read_deck, shipped
from thrustd.mounts.start import at_rest, resting_n
from thrustd.records.recording import make_recording
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths

TRUE_M2 = 0.024


@pytest.fixture(scope="module")
def installation():
    return read_installation(shipped("deploy/hil.toml", "config"))


def flight(drag_m2=TRUE_M2, cruise_off=0.08, idle_s=60):
    """Cruise, where the deck is 8 % low, then fast flight at idle, where it is right."""
    n = 600 + idle_s
    idle = np.arange(n) >= 600
    columns = {"time_s": np.arange(n) * 1.0, "mach": np.full(n, 0.4), "pressure_altitude_m": np.full(n, 2000.0),
               "sat_degC": np.full(n, 2.0)}  # fmt: skip
    for engine in ("left", "right"):
        columns |= {f"n1_pct_{engine}": np.where(idle, 40.0, 75.0), f"n2_pct_{engine}": np.where(idle, 58.0, 85.0),
                    f"fuel_flow_kg_s_{engine}": np.where(idle, 0.026, 0.078)}  # fmt: skip
    record = make_recording("flight.mcap", columns)
    pressure_pa = dynamic_pressure_pa(0.4, 2000.0)
    columns["dynamic_pressure_Pa"] = np.full(n, pressure_pa)
    for number, engine in enumerate(("left", "right")):
        thrust_n = deck_thrust(record, read_deck(), number, engine)[0] * np.where(idle, 1.0, 1.0 - cruise_off)
        for mount, share in (("upper", 0.46), ("lower", 0.54)):
            columns[f"model_N_{engine}_{mount}"] = share * (thrust_n - drag_m2 * pressure_pa)
    return make_recording("flight.mcap", columns)


def test_idle_tells_the_drag_that_cruise_would_hide(installation):
    fit = fit_drag([flight()], installation)
    assert abs(fit.m2 - TRUE_M2) < 0.1 * TRUE_M2 and fit.std_m2 < TRUE_M2 / 3
    (one,) = fit.flights
    assert one.n1_pct < 45.0 and one.seconds <= 60
    hidden = fit_drag([flight(idle_s=0)], installation)  # no flight at idle: so it says
    assert hidden.std_m2 > 1.5 * fit.std_m2
    assert abs(hidden.m2 - TRUE_M2) < 3 * hidden.std_m2
    assert missing_stretch(one) == ""
    said = missing_stretch(hidden.flights[0])
    assert "no steady 30 s fast at flight idle" in said and "s at Mach 0.40, N1 75 %" in said


def test_the_file_is_flown_with_and_the_same_flight_again_says_the_same(installation):
    fit = fit_drag([flight()], installation)
    calibration = with_drag(Calibration(on="2026-01-01"), fit, installation, "2026-01-02")
    assert read_calibration(write_calibration(calibration), "c").drag == calibration.drag
    flown = installation.calibrated_by(write_calibration(calibration))
    assert flown.aircraft().installation.drag_m2 == pytest.approx(fit.std_m2, abs=1e-5)
    areas = [
        effect.parameters["drag_area_m2"]
        for model in flown.parts().models
        for effect in model.spec.effects
        if effect.name == "nacelle_drag"
    ]
    assert sum(areas) == pytest.approx(2 * fit.m2, abs=1e-4)  # of two engines
    again = fit_drag([flight()], flown)  # as if the file held nothing
    assert with_drag(calibration, again, flown, "2026-01-02") == calibration


def test_cruise_does_not_undo_what_idle_told(installation):
    fit = fit_drag([flight()], installation)
    flown = installation.calibrated_by(
        write_calibration(with_drag(Calibration(on="2026-01-01"), fit, installation, "2026-01-02"))
    )
    cruise = fit_drag([flight(idle_s=0)], flown)
    assert abs(cruise.m2 - TRUE_M2) < abs(fit_drag([flight(idle_s=0)], installation).m2 - TRUE_M2)
    assert cruise.std_m2 == pytest.approx(fit.std_m2, rel=1e-3)  # the deck errs in every flight alike


def test_pull_ups_tell_how_the_mounts_lean_and_models_take_it_off(installation):
    """Their weight on leaning mounts is no thrust: 2 degrees are 128 N per g of an engine."""
    level, mass_kg = flight(), installation.aircraft().engine_mass_kg
    load_g = 1.0 + 0.6 * np.sin(level.time_s / 4.0) * (np.arange(len(level)) % 100 < 25)
    more_n = mass_kg * STANDARD_GRAVITY_M_S2 * (load_g - 1.0)
    leaning = {"left": 2.0, "right": -1.0}
    columns = {name: level[name] - 0.5 * np.sin(np.radians(leaning[name.split("_")[2]])) * more_n
               for name in level.channels if name.startswith("model_N")}  # fmt: skip
    fit = fit_drag([level.with_channels(accel_z_g=load_g, **columns)], installation)
    assert fit.lean_deg == pytest.approx([2.0, -1.0], abs=0.1)
    assert abs(fit.m2 - TRUE_M2) < 0.1 * TRUE_M2
    calibration = with_drag(Calibration(on="2026-01-01"), fit, installation, "2026-01-02")
    models = [
        each.parts().models for each in (installation, installation.calibrated_by(write_calibration(calibration)))
    ]
    for number, name in ((0, "left_upper"), (2, "right_upper")):
        lean_deg = calibration.mount[name].lean_deg
        pulled_n = []
        for model in (each[number] for each in models):
            rows = [at_rest(model, {"accel_z_g": g})(0.5) for g in (1.0, 2.0)]
            pulled_n.append(resting_n(model, rows[1]) - resting_n(model, rows[0]))
        share = 5079.0 / (5079.0 + 5954.0)
        expected_n = share * mass_kg * STANDARD_GRAVITY_M_S2 * np.sin(np.radians(lean_deg))
        assert pulled_n[1] - pulled_n[0] == pytest.approx(expected_n, rel=0.03)


def test_a_logs_columns_have_the_drag_of_the_file_in_them():
    """And `without_drag` takes them out: else a file's own drag and lean would be found again with every flight."""
    log = LogRun(run_paths(shipped("replay_logs/throttle-steps.mcap", "log")))
    place = open_installation(log, None)
    dragging = place.calibrated_by(
        'on = "2026-01-01"\ndrag = { on = "2026-01-01", m2 = 0.05, std_m2 = 0.01 }\n'
        "[mount.left_upper]\nlean_deg = 1.0\n"
    )
    plain, more, without = (flight_columns(log, each) for each in (place, dragging, without_drag(dragging)))
    assert all(np.array_equal(plain[name], without[name], equal_nan=True) for name in plain.channels)
    added_n = sum(more[f"model_N_left_{mount}"] - plain[f"model_N_left_{mount}"] for mount in ("upper", "lower"))
    good = np.isfinite(added_n) & np.isfinite(plain["dynamic_pressure_Pa"])
    assert good.sum() > 100 and np.ptp(plain["dynamic_pressure_Pa"][good]) > 500.0
    assert np.median(abs(added_n - 0.05 * plain["dynamic_pressure_Pa"])[good]) < 2.0


def test_a_log_that_never_flies_is_one_line_and_writes_nothing(static_run, tmp_path, capsys):
    out = tmp_path / "c.toml"
    assert main(["calibrate", "drag", str(static_run), "-o", str(out)]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("thrustd:")]
    assert "less than 20 s of steady flight" in line and not out.exists()


def test_what_tells_no_drag_is_one_line(installation):
    with pytest.raises(RecordingError, match="less than 20 s of steady flight"):
        fit_drag([flight().window(0.0, 15.0)], installation)
    with pytest.raises(RecordingError, match="expected a drag"):
        fit_drag([flight(drag_m2=-0.06)], installation)
