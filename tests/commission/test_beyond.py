"""A mount that its engine's weight holds beyond its bench: how steep its curve is there, a tethered run tells."""

import msgspec
import numpy as np
import pytest

from thrustd.commission.tether import fit_tether
from thrustd.commission.tether_file import with_tether
from thrustd.commission.tether_models import beyond_n
from thrustd.commission.tether_told import Beyond, Solved, _beyond
from thrustd.core.calibration import Calibration, MountCalibration, read_calibration, write_calibration
from thrustd.core.measures import SIGMAS_95
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import compile_model
from thrustd.mounts.start import at_rest, resting_n
from thrustd.mounts.step import IN_SHEAR_STD
from thrustd.records.files import read_recording
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths
from thrustd.twin.airframe import MOUNTS

from ..installation.test_geometry import HIL, RIGID, changed

PART = 0.06
UPPERS = "left_upper", "right_upper"


@pytest.fixture(scope="module")
def run(static_run):
    """(columns, cell, installation) of a static run, read as of engines that hang as rigid bodies."""
    log = LogRun(run_paths(static_run))
    flight = flight_columns(log, open_installation(log, None))
    return flight, read_recording(static_run.with_name("run-cell.csv")), changed(RIGID)


@pytest.fixture(scope="module")
def plain(run):
    """What the run tells as it is."""
    return fit_tether(*run)


def test_rubber_that_is_steeper_where_no_bench_was_is_neither_gain_nor_zero_of_any_mount(run, plain):
    """Without it in the regression the zero of the one mount took it and the other one the rest: 40 N each, unsaid."""
    flight, cell, installation = run
    columns = {}
    for mount in installation.config.mount:
        name = mount.name
        more_n = beyond_n(installation, mount, flight[f"deformation_mm_{name}"], flight.sample_hz)
        assert (np.nanmax(PART * more_n) > 40.0) == (name in UPPERS)
        columns[f"model_N_{name}"] = flight[f"model_N_{name}"] - PART * more_n
    steeper = fit_tether(flight.with_channels(**columns), cell, installation)
    assert set(steeper.beyond) == set(UPPERS)
    for name in UPPERS:
        assert steeper.beyond[name].factor - plain.beyond[name].factor == pytest.approx(PART, abs=0.015)
        assert 0.0 < steeper.beyond[name].std < 0.8 * IN_SHEAR_STD
    for name in MOUNTS:
        assert steeper.gains[name][0] == pytest.approx(plain.gains[name][0], abs=0.002)
        assert steeper.zeros_mm[name][0] == pytest.approx(plain.zeros_mm[name][0], abs=0.002)
    assert {one.what for one in steeper.numbers if "beyond" in one.what} == {
        f"slope beyond its bench of {name}" for name in UPPERS
    }


def test_engines_whose_mounts_move_together_have_no_such_number(run):
    flight, cell, _ = run
    found = fit_tether(flight, cell, HIL)
    assert not found.beyond and not any("beyond" in one.what for one in found.numbers)
    mounts = with_tether(Calibration(on="2026-01-01"), found, "2026-01-02", "cell.csv").mount.values()
    assert all((one.beyond, one.beyond_std, one.told_mm) == (1.0, None, None) for one in mounts)


def test_what_was_found_is_in_the_file_and_comes_on_top_of_what_it_had(run, plain):
    installation = run[2]
    old = Calibration(on="2026-01-01", mount={"left_upper": MountCalibration(beyond=1.1)})
    text = write_calibration(with_tether(old, plain, "2026-01-02", "cell.csv"))
    after = read_calibration(text, "c")
    found = plain.beyond["left_upper"]
    assert after.of("left_upper").beyond == pytest.approx(1.1 * found.factor, abs=1e-4)
    assert after.of("right_upper").beyond == pytest.approx(plain.beyond["right_upper"].factor, abs=1e-4)
    assert after.of("left_upper").beyond_std == pytest.approx(found.std, abs=1e-6)
    assert after.of("left_upper").told_mm == pytest.approx(found.told_mm, abs=1e-6)
    assert "beyond" not in text.partition("[mount.left_lower]")[2].partition("[mount.")[0]
    means = installation.calibrated_by(text).pipeline()._sources[0]._means
    assert means["below_std"][0] == after.of("left_upper").beyond_std
    assert means["told_mm"][0] == after.of("left_upper").told_mm


def test_a_mount_rests_nearer_on_a_steeper_curve_and_is_as_its_bench_has_shown_from_there():
    installation = changed(RIGID)
    mount = installation.config.mount[0]
    spec, place = installation.bench_model(mount), installation.place(mount.name)
    smooth = msgspec.structs.replace(spec, effects=[e for e in spec.effects if not e.name.startswith("hysteresis")])
    models = [
        compile_model(calibrated(smooth, place._replace(calibration=MountCalibration(beyond=factor)), ""), 10.0)
        for factor in (1.0, 1.1)
    ]
    starts_mm = [model.spec.valid.deformation_mm[0] for model in models]  # readings where its bench begins
    assert starts_mm[1] == pytest.approx(starts_mm[0] / 1.1, rel=0.01)
    rows = [at_rest(model, {}) for model in models]
    for past_mm in (0.0, 0.2, 0.8):
        forces_n = [resting_n(m, row(mm + past_mm)) for m, row, mm in zip(models, rows, starts_mm, strict=True)]
        assert forces_n[1] == pytest.approx(forces_n[0], abs=2.0)  # from where both are on the bench
    assert resting_n(models[1], rows[1](0.0)) == pytest.approx(0.0, abs=0.5)


def test_zero_and_slope_have_nothing_in_common_where_the_zero_is_known_best():
    """std^2 is least there; beyond the bench's begin or behind the rest nobody looks."""
    zero, slope, begins_mm = 2e-3, 0.03, 0.3
    for together, told_mm in ((0.0, 0.0), (0.1 * slope**2, 0.1), (-1e-5, 0.0), (0.9 * slope**2, begins_mm)):
        covariance = np.array([[zero**2 + together**2 / slope**2, together], [together, slope**2]])
        found = _beyond(Solved(np.ones(2), np.array([0.0, 0.05]), covariance, 0.0), 0, 1, begins_mm)
        left_mm2 = covariance[0, 0] - 2.0 * told_mm * together + (told_mm * slope) ** 2
        assert found == Beyond(1.05, pytest.approx(slope), pytest.approx(told_mm), pytest.approx(np.sqrt(left_mm2)))
        assert SIGMAS_95 * found.zero_std_mm > 0.0


def test_the_slope_is_as_unsure_as_what_the_curves_of_the_models_err_by(run, plain, monkeypatch):
    """An error that repeats with the load is in no residual: the fit is as good, and its slope another one."""
    flight, cell, installation = run
    name = "model_N_left_upper"
    load = flight[name] / np.nanmax(flight[name])
    bent = flight.with_channels(**{name: flight[name] + 12.0 * np.interp(load, (0.0, 0.3, 1.0), (0.0, 1.0, 0.0))})
    other = fit_tether(bent, cell, installation)
    monkeypatch.setattr("thrustd.commission.tether.curve_errors_n", lambda run: np.zeros((len(run.runs), 0)))
    known = fit_tether(flight, cell, installation).beyond["left_upper"]
    found, moved = plain.beyond["left_upper"], other.beyond["left_upper"]
    assert other.after_n < 1.03 * plain.after_n
    assert known.factor == found.factor and known.std < 0.9 * found.std < 0.9 * IN_SHEAR_STD
    assert 0.5 * known.std < abs(moved.factor - found.factor) < SIGMAS_95 * found.std
