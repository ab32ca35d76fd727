"""Zeros, gains, curves and hours on the aircraft: what is found, what is refused, and that a flight uses it."""

import json

import msgspec
import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.cli.files import read_models
from thrustd.commission.gauge_blocks import block_curve
from thrustd.commission.tether import SLOW_S, _fit, _Known, as_blocks_scatter, fit_tether
from thrustd.commission.tether_file import with_tether
from thrustd.commission.tether_models import rubbing
from thrustd.commission.zero import MountZero, with_zeros
from thrustd.core.aircraft import MountPlace
from thrustd.core.calibration import (
    Calibration,
    EngineCalibration,
    MountCalibration,
    Zero,
    read_calibration,
    write_calibration,
)
from thrustd.core.errors import ConfigError, RecordingError, ThrustdError
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import compile_model
from thrustd.mounts.start import at_rest, chords, resting_n
from thrustd.records.files import read_recording
from thrustd.records.recording import make_recording
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths
from thrustd.twin.airframe import MOUNTS, draw_airframe
from thrustd.twin.installation import PLAIN
from thrustd.twin.mount import LOWER, UPPER

from .conftest import SEED


def said(capsys):
    return json.loads(capsys.readouterr().out.splitlines()[-1])


@pytest.fixture(scope="module")
def tethered(static_run, tmp_path_factory):
    path = tmp_path_factory.mktemp("cal") / "calibration.toml"
    assert main(["zero", str(static_run), "-o", str(path), "--date", "2026-11-22"]) == 0
    zeroed = read_calibration(path.read_text(), "zeroed")
    cell = str(static_run.with_name("run-cell.csv"))
    assert main(["calibrate", "tether", str(static_run), "--cell", cell, "-o", str(path), "--date", "2026-11-23"]) == 0
    return zeroed, read_calibration(path.read_text(), "tethered")


def test_zeros_hold_the_truth_within_three_sigma(tethered):
    truth = [lvdt.zero_mm + 0.012 for lvdt in draw_airframe(SEED).lvdts]
    for name, zero_mm in zip(MOUNTS, truth, strict=True):
        found = tethered[0].of(name)
        assert abs(found.zero_mm - zero_mm) < 3 * found.zero_std_mm < 0.01, name


def test_the_tethered_run_finds_gains_and_halves_their_band(tethered):
    mounts = draw_airframe(SEED, PLAIN._replace(stiffness=0.02)).mounts
    pairs = zip(mounts, (UPPER, LOWER) * 2, strict=True)
    stiffer = [mount.stiffness_n_mm / nominal.stiffness_n_mm for mount, nominal in pairs]
    for engine in range(2):  # one engine's two mounts move together: their mean is what a run can tell
        both = [tethered[1].of(MOUNTS[2 * engine + k]) for k in range(2)]
        truth = np.mean(stiffer[2 * engine : 2 * engine + 2])
        assert abs(np.mean([mount.gain for mount in both]) - truth) < 3 * both[0].gain_std < 0.02
    assert tethered[1].tethered == "2026-11-23"
    assert len(tethered[1].of("left_upper").zeros) == 2


@pytest.fixture(scope="module")
def run(static_run):
    """(columns, cell, installation) of the static run."""
    log = LogRun(run_paths(static_run))
    installation = open_installation(log, None)
    return flight_columns(log, installation), read_recording(static_run.with_name("run-cell.csv")), installation


@pytest.fixture(scope="module")
def plain(run):
    """What the run tells as it is."""
    return fit_tether(*run)


def said_along(model, shown_mm):
    """What a model makes of readings that begin at rest."""
    good, row = np.isfinite(shown_mm), np.arange(len(shown_mm))
    rows = np.tile(at_rest(model, {})(0.0), (len(shown_mm), 1))
    rows[:, [name == "deformation_mm" for name in model.channels]] = np.interp(row, row[good], shown_mm[good])[:, None]
    return model.simulate(rows)


def test_what_grows_with_the_mounts_temperature_is_not_taken_for_their_gain(run, plain):
    """Load and heat come together in a run: a gain that took the heat's part would be wrong in cold air."""
    flight, cell, installation = run
    columns = {}
    for mount, model in zip(MOUNTS, installation.parts().models, strict=True):
        warm = flight[f"temperature_degC_{mount}"]
        warmer_k = np.nan_to_num(warm - warm[np.isfinite(warm)][0])
        shown = flight[f"deformation_mm_{mount}"]
        said = [said_along(model, shown + more_mm) for more_mm in (0.0, 6e-4 * warmer_k)]
        columns[f"deformation_mm_{mount}"] = shown + 6e-4 * warmer_k
        columns[f"model_N_{mount}"] = flight[f"model_N_{mount}"] + said[1] - said[0]
    grown = fit_tether(flight.with_channels(**columns), cell, installation)
    for mount in MOUNTS:
        line = grown.lines[mount]
        assert abs(line.expansion_mm_k - plain.lines[mount].expansion_mm_k - 6e-4) < line.expansion_std_mm_k
        assert grown.gains[mount][0] == pytest.approx(plain.gains[mount][0], abs=0.003)


def test_what_friction_held_at_rest_is_found_once_the_mounts_have_moved(run, plain):
    """25 N that a mount had held before its first load: a zero at rest is wrong by as much under load."""
    flight, cell, installation = run
    columns, slopes_n_um = {}, {}
    for mount, model in zip(MOUNTS, installation.parts().models, strict=True):
        engine = mount.partition("_")[0]
        ran = np.maximum.accumulate(flight[f"n1_pct_{engine}"] > 5.0)
        columns[f"model_N_{mount}"] = flight[f"model_N_{mount}"] + 25.0 * ran
        slopes_n_um[mount] = chords(model, at_rest(model, {}))[1][0] / 1e3
    held = fit_tether(flight.with_channels(**columns), cell, installation)
    for mount in MOUNTS:
        more_n = 1e3 * (held.zeros_mm[mount][0] - plain.zeros_mm[mount][0]) * slopes_n_um[mount]
        assert more_n == pytest.approx(25.0, abs=8.0)
        assert held.gains[mount][0] == pytest.approx(plain.gains[mount][0], abs=0.003)


def test_friction_of_its_own_is_neither_gain_nor_zero(run, plain):
    """It adds while the load grows, and takes off while it falls."""
    flight, cell, installation = run
    columns, part = {}, 0.12
    for mount, model in zip(MOUNTS, installation.parts().models, strict=True):
        rubs_n = rubbing(model.spec, flight[f"deformation_mm_{mount}"], flight.sample_hz, 8.0).friction_n
        columns[f"model_N_{mount}"] = flight[f"model_N_{mount}"] + part * rubs_n
    more = fit_tether(flight.with_channels(**columns), cell, installation)
    for mount in MOUNTS:
        assert more.frictions[mount] - plain.frictions[mount] == pytest.approx(-part, abs=0.03)
        assert more.gains[mount][0] == pytest.approx(plain.gains[mount][0], abs=0.0015)
        assert more.zeros_mm[mount][0] == pytest.approx(plain.zeros_mm[mount][0], abs=0.001)
    assert more.after_n < 1.1 * plain.after_n


def test_a_clock_that_is_off_by_less_than_is_looked_for_is_no_friction(run, plain):
    flight, cell, installation = run
    late = make_recording("cell", {"time_s": cell.time_s + 0.04, "force_N": cell["force_N"]})
    shifted = fit_tether(flight, late, installation)
    for mount in MOUNTS:
        assert shifted.frictions[mount] == pytest.approx(plain.frictions[mount], abs=0.005)
        assert shifted.gains[mount][0] == pytest.approx(plain.gains[mount][0], abs=0.0005)
    assert shifted.after_n < 20.0


def test_numbers_are_as_unsure_as_blocks_of_the_run_disagree():
    """Noise that is white leaves the covariance; one of four levels' length says by how much too sure it was."""
    rng, covariance = np.random.default_rng(3), np.eye(1) / 4000.0
    white = rng.standard_normal((4000, 1))
    lasting = np.repeat(rng.standard_normal(20), 200)[:, None]
    assert as_blocks_scatter(covariance, white, 50)[0, 0] < 1.6 * covariance[0, 0]
    assert as_blocks_scatter(covariance, lasting, 50)[0, 0] > 50.0 * covariance[0, 0]


def test_numbers_that_take_the_noise_for_theirs_do_not_hide_it():
    """As many numbers as levels leave next to nothing, however loud: the noise was known to be 20 N."""
    rng, n, levels = np.random.default_rng(4), 100, 12
    design = np.repeat(np.eye(levels), n, axis=0)[:, : levels - 2]
    wanted_n = np.repeat(20.0 * rng.standard_normal(levels), n) + rng.standard_normal(n * levels)
    known = _Known(np.eye(levels - 2) / 30.0**2, np.zeros(levels - 2))
    _, covariance, left_n = _fit(design, known, wanted_n, n / SLOW_S, np.zeros((len(design), 0)))
    assert left_n < 12.0
    assert 10.0 < np.sqrt(covariance[0, 0]) < 30.0


def test_elements_of_friction_that_differ_are_in_the_interval_of_their_sum(run, plain, monkeypatch):
    """One factor does not say that some of the friction is more, as much of it less."""
    flight, cell, installation = run
    columns, rng = {}, np.random.default_rng(7)
    for mount, model in zip(MOUNTS, installation.parts().models, strict=True):
        one = rubbing(model.spec, flight[f"deformation_mm_{mount}"], flight.sample_hz, 8.0)
        assert one.std * np.sqrt(np.sum(one.slips_n**2)) == pytest.approx(8.0)
        parts = one.std * rng.standard_normal(len(one.slips_n))
        parts -= np.average(parts, weights=one.slips_n)
        columns[f"model_N_{mount}"] = flight[f"model_N_{mount}"] - one.elements_n @ parts
    halves = []
    for fit in (plain, fit_tether(flight.with_channels(**columns), cell, installation)):
        halves.append([(n.value, n.half_width) for n in fit.numbers if n.what.startswith("friction")])
    monkeypatch.setattr("thrustd.commission.tether.friction_errors_n", lambda run: np.zeros((len(run.runs), 0)))
    bare = [n.half_width for n in fit_tether(flight, cell, installation).numbers if n.what.startswith("friction")]
    for (told, half), (moved, _), without in zip(*halves, bare, strict=True):
        assert without < 0.7 * half
        assert abs(moved - told) < half


def test_what_the_scale_of_a_transducer_may_be_is_in_the_gain_of_its_mount(run, plain):
    """0.5 % where nobody has measured it; gauge blocks have."""
    flight, cell, installation = run
    blocks = MountCalibration(read_mm=(0.0, 2.0), true_mm=(0.0, 2.0), curve_std_mm=2e-4)
    file = Calibration(on="2026-01-01", mount=dict.fromkeys(MOUNTS, blocks))
    fits = plain, fit_tether(flight, cell, installation.calibrated_by(write_calibration(file)))
    for (_, unknown), (_, known) in zip(*(fit.gains.values() for fit in fits), strict=True):
        assert unknown > 1.1 * known


def test_a_calibrated_mount_has_so_much_of_its_own_friction():
    (spec,) = read_models([shipped("models/left-upper.json", "")]).values()
    place = MountPlace("left_upper", "left", 0, 0.46, MountCalibration(friction=0.9))
    up_and_down = np.concatenate((np.linspace(0.0, 0.8, 200), np.linspace(0.8, 0.1, 200)))
    before_n, after_n = (rubbing(one, up_and_down, 10.0, 8.0).friction_n for one in (spec, calibrated(spec, place, "")))
    assert before_n[199] > 50.0 > -20.0 > before_n[-1]
    assert after_n == pytest.approx(0.9 * before_n, abs=1e-6)
    kept = Calibration(on="2026-01-01", mount={"left_upper": place.calibration})
    assert read_calibration(write_calibration(kept), "").of("left_upper").friction == 0.9


def test_a_zero_at_rest_hardly_moves_one_that_was_found_under_load():
    found = [MountZero("left_upper", 0.012, 0.0012, 80.0)]
    for gain_std, expected_mm, std_mm in ((None, 0.012, 0.0012), (0.004, 0.0071, 0.002)):
        mount = MountCalibration(zeros=(Zero("2026-01-01", 0.007, 0.002),), gain_std=gain_std)
        after = with_zeros(Calibration(on="2026-01-01", mount={"left_upper": mount}), found, "2026-01-02")
        assert after.of("left_upper").zero_mm == pytest.approx(expected_mm, abs=1e-4)
        assert after.of("left_upper").zero_std_mm == pytest.approx(std_mm, abs=1e-4)


def test_a_calibrated_mount_gives_its_growth_back():
    """Beside that of its bench, whatever that is: together they may be next to nothing, at no temperature."""
    (spec,) = read_models([shipped("models/left-upper.json", "")]).values()
    own = sum(e.parameters["expansion_mm_k"] for e in spec.effects if e.name == "thermal_expansion")
    bench = compile_model(spec, 20.0)
    for rate in (6e-4, -own, -own + 1e-6):
        grown = MountCalibration(expansion_mm_k=rate, reference_degc=35.0)
        model = compile_model(calibrated(spec, MountPlace("left_upper", "left", 0, 0.46, grown), ""), 20.0)
        shown, true = (at_rest(each, {"temperature_degC": 5.0}) for each in (model, bench))
        assert resting_n(model, shown(0.5 - 30.0 * rate)) == pytest.approx(resting_n(bench, true(0.5)), abs=1.0)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (lambda time_s, force_n: (time_s, -force_n), r"tells no gain, .* pull \+"),
        (lambda time_s, force_n: (time_s + 8.0, force_n), "its clock within 3 s"),
        (lambda time_s, force_n: (time_s, np.random.default_rng(0).permutation(force_n)), "expected"),
        (lambda time_s, force_n: (time_s, np.nan * force_n), "less than 60 s"),
    ],
)
def test_a_cell_that_is_not_of_this_run_tells_nothing_and_writes_nothing(run, changed, words):
    flight, cell, installation = run
    time_s, force_n = changed(cell.time_s, cell["force_N"])
    with pytest.raises(RecordingError, match=words):
        fit_tether(flight, make_recording("cell", {"time_s": time_s, "force_N": force_n}), installation)


@pytest.mark.parametrize("share", [0.6, 1.3])
def test_a_cell_that_feels_a_part_of_the_pull_is_refused(run, share):
    """A second rope beside it, or a scale that is off: 0.61 and 1.33 were written as gains."""
    flight, cell, installation = run
    fit = fit_tether(flight, cell.with_channels(force_N=1.02 * share * cell["force_N"]), installation)
    with pytest.raises(RecordingError, match=r"^cell.csv: gain of \w+ \d.\d+, expected 0.85 to 1.15: is the cell"):
        with_tether(Calibration(on="2026-01-01"), fit, "2026-01-02", "cell.csv")


def test_an_engine_that_hangs_as_a_rigid_body_is_said_aloud(run, plain):
    flight, cell, installation = run
    assert not plain.remarks
    parts = {"upper": 0.36 / 0.46, "lower": 0.64 / 0.54}
    shifted = {n: parts[n.split("_")[-1]] * c for n, c in flight.channels.items() if n.startswith("model_N")}
    remarks = fit_tether(flight.with_channels(**shifted), cell, installation).remarks
    assert [line.split(":")[0] for line in remarks] == ["left_upper", "right_upper"]
    assert all("a rigid body's 35 % against 46 %" in line and "expected rigid_body = true" in line for line in remarks)


def test_what_the_cells_certificate_leaves_open_is_in_every_gain_and_in_nothing_else(run, plain):
    flight, cell, installation = run
    vague = fit_tether(flight, cell, installation, 0.005)
    for name, (gain, std) in plain.gains.items():
        assert vague.gains[name] == pytest.approx((gain, np.hypot(std, 0.005)))
    assert (vague.zeros_mm, vague.frictions, vague.lines) == (plain.zeros_mm, plain.frictions, plain.lines)
    shares = [[one.half_width for one in fit.numbers if one.what.startswith("share")] for fit in (plain, vague)]
    assert shares[0] == pytest.approx(shares[1])  # both mounts of an engine are off by the same
    for wrong in (-0.001, 0.2, float("nan")):
        with pytest.raises(ThrustdError, match="one sigma of the cell's scale"):
            fit_tether(flight, cell, installation, wrong)


def test_a_hole_in_the_cells_record_is_not_bridged(run, plain):
    """Nothing is known of what it pulled meanwhile; a straight line over it was 2.5 kN RMS wrong."""
    flight, cell, installation = run
    middle = abs(cell.time_s - 250.0) < 50.0
    silent = cell.with_channels(force_N=np.where(middle, np.nan, cell["force_N"]))
    for record in (
        silent,
        make_recording("cell", {"time_s": cell.time_s[~middle], "force_N": cell["force_N"][~middle]}),
    ):
        found = fit_tether(flight, record, installation)
        assert found.after_n < 1.5 * plain.after_n
        assert found.gains["left_upper"][0] == pytest.approx(plain.gains["left_upper"][0], abs=0.005)


def test_samples_of_the_cell_without_a_number_are_said_and_tell_no_more(run, plain):
    """With every seventh missing all rows beside them fell out, unsaid, and zeros were narrower than of all of it."""
    flight, cell, installation = run
    some = cell.with_channels(force_N=np.where(np.arange(len(cell)) % 7 == 3, np.nan, cell["force_N"]))
    found = fit_tether(flight, some, installation)
    assert "samples have no number and are left out" in found.remarks[0]
    for one, other in zip(plain.numbers, found.numbers, strict=True):
        assert other.value == pytest.approx(one.value, abs=0.5 * one.half_width)
        assert other.half_width == pytest.approx(one.half_width, rel=0.05)


def test_a_record_in_kilonewtons_is_one_line_and_writes_nothing(static_run, tmp_path, capsys):
    table = np.loadtxt(static_run.with_name("run-cell.csv"), delimiter=",", skiprows=1)
    table[:, 1] /= 1000
    np.savetxt(tmp_path / "cell.csv", table, delimiter=",", header="time_s,force_N", comments="")
    out, cell = tmp_path / "calibration.toml", str(tmp_path / "cell.csv")
    assert main(["calibrate", "tether", str(static_run), "--cell", cell, "-o", str(out)]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("thrustd:")]
    assert "is it kN?" in line and "expected N" in line
    assert not out.exists()


def test_what_is_no_zero_is_refused_aloud(tmp_path, capsys):
    log, out = tmp_path / "pushed.mcap", tmp_path / "calibration.toml"
    pushed = "zero_mm=0.0,0.0,0.09,0.0"
    assert main(["simulate", "--minutes", "0.5", "--seed", "3", "--knob", pushed, "-o", str(log)]) == 0
    assert main(["zero", str(log), "-o", str(out)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines if "refused" in line] == ["right_upper"]
    assert set(read_calibration(out.read_text(), "x").mount) == {"left_upper", "left_lower", "right_lower"}
    assert main(["replay", str(log), "--json"]) == 0
    faults = said(capsys)["faults"]
    assert faults["right_upper zero_refused"] == 1 and faults["left zero"] == 1
    assert not any("zero_refused" in name for name in faults if "right_upper" not in name)
    both = "zero_mm=0.0,0.0,0.09,0.09"
    assert main(["simulate", "--minutes", "0.5", "--seed", "3", "--knob", both, "-o", str(log)]) == 0
    capsys.readouterr()
    assert main(["replay", str(log)]) == 0
    (taken, refused) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("zeros ")]
    assert taken.endswith(": left")  # no engine is called calibrated of which no mount was
    assert refused.startswith("zeros refused") and refused.endswith(": right_lower, right_upper")


def test_a_log_that_begins_with_engines_running_has_no_zeros(static_run, tmp_path, capsys):
    log = str(shipped("replay_logs/throttle-steps.mcap", "log"))
    status = main(["zero", log, "-o", str(tmp_path / "c.toml")])
    if status:  # one that begins with engines off would have zeros
        assert "engines off" in capsys.readouterr().err
        assert not (tmp_path / "c.toml").exists()


def with_calibration(tmp_path, calibration):
    """The shipped bench configuration in a folder of its own, with this calibration beside it."""
    installation = read_installation(shipped("deploy/hil.toml", "config"))
    return installation.calibrated_by(write_calibration(calibration))


def test_a_flight_takes_zero_gain_and_hours_from_the_file(tmp_path):
    mount = MountCalibration(zeros=(Zero(on="2026-01-01", mm=0.02, std_mm=0.001),), gain=1.05, service_h=3.0)
    place = with_calibration(tmp_path, Calibration(on="2026-01-01", mount={"left_upper": mount}))
    plain, own = read_installation(place.where).parts().models[0], place.parts().models[0]
    row = np.zeros(len(plain.channels))
    row[0] = 0.5
    stiff = [np.ptp(model.simulate(np.outer([0.1, 0.9], row > 0))) for model in (plain, own)]
    assert stiff[1] > 1.04 * stiff[0]
    pipeline = place.pipeline()
    assert pipeline._sources[0]._zero_mm == 0.02  # what a calibration would take off is off already
    assert pipeline._sources[0]._means["zero_std_mm"][0] == 0.001
    assert pipeline.service_s == [10800.0, 0.0, 0.0, 0.0]


def test_a_tethered_run_narrows_what_nobody_had_measured_of_the_installation(tmp_path):
    zeros = (Zero(on="2026-01-01", mm=0.01, std_mm=0.002),)
    told = {"gain": 1.01, "gain_std": 0.004, "expansion_std_mm_k": 5e-5}
    mounts = {name: MountCalibration(zeros=zeros, **told) for name in MOUNTS}
    before = with_calibration(tmp_path, Calibration(on="2026-01-01", mount=mounts)).aircraft().installation
    both = {"left": EngineCalibration(0.0021), "right": EngineCalibration(0.0018)}
    run = Calibration(on="2026-01-01", tethered="2026-01-01", mount=mounts, engine=both)
    after = with_calibration(tmp_path, run)
    left = after.aircraft().installation
    assert (left.scale, left.told_scale, left.zero_n) == (0.0, 0.0021, 0.0)  # they are in the mounts' own sigma
    older = with_calibration(tmp_path, msgspec.structs.replace(run, engine={})).aircraft().installation
    assert older.told_scale == 0.004  # it does not say what both share
    assert left.drag_m2 == before.drag_m2
    means = after.pipeline()._sources[0]._means[0]
    assert (means["stiffness_std"], means["zero_std_mm"]) == (0.004, 0.002)
    anew = mounts | {"left_upper": MountCalibration(**told)}  # rigged anew, its zeros deleted
    some = with_calibration(tmp_path, Calibration(on="2026-01-01", tethered="2026-01-01", mount=anew))
    assert some.aircraft().installation.zero_n == before.zero_n


def test_a_curve_of_gauge_blocks_straightens_the_transducer(tmp_path, capsys):
    blocks = np.repeat([0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2], 5)
    read = blocks + 0.02 * np.sin(2.5 * blocks) + np.random.default_rng(1).normal(0, 1e-4, len(blocks))
    table = np.column_stack((np.arange(len(blocks)), blocks, read))
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="time_s,gauge_mm,deformation_mm", comments="")
    out = tmp_path / "c.toml"
    command = ["calibrate", "blocks", str(tmp_path / "b.csv"), "--mount", "left_upper", "-o", str(out)]
    assert main(command) == 0
    place = with_calibration(tmp_path, read_calibration(out.read_text(), "c"))
    plain, own = read_installation(place.where).parts().models[0], place.parts().models[0]
    for true_mm in (0.15, 0.5, 1.0):
        rows = [np.zeros((1, len(plain.channels))) for _ in range(2)]
        rows[0][:, 0], rows[1][:, 0] = true_mm, true_mm + 0.02 * np.sin(2.5 * true_mm)
        for row in rows:  # friction is asked for the reading; it does not see the curve
            row[:, 1:] = [true_mm if name == "deformation_mm" else 0.0 for name in plain.channels[1:]]
        assert abs(plain.simulate(rows[0])[0] - own.simulate(rows[1])[0]) < 10.0
    once = make_recording("b", {"time_s": table[::5, 0], "gauge_mm": table[::5, 2], "deformation_mm": table[::5, 1]})
    with pytest.raises(RecordingError, match="are they swapped"):
        block_curve(once)
    known = ["--config", str(shipped("deploy/hil.toml", "config"))]
    assert main([*(word.replace("left_upper", "upper_left") for word in command), *known]) == 2
    assert "--mount upper_left: not in the configuration" in capsys.readouterr().err
    table[:, 2] *= 1000  # in um
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="time_s,gauge_mm,deformation_mm", comments="")
    assert main(command) == 2
    assert "was it mm?" in capsys.readouterr().err


def test_a_tethered_run_that_is_read_again_says_the_same(tethered, static_run, tmp_path):
    """It was taken for another run beside the first, its bow for gauge blocks: bands narrower by a third."""
    path, cell = tmp_path / "again.toml", str(static_run.with_name("run-cell.csv"))
    path.write_text(write_calibration(tethered[1]))
    assert main(["calibrate", "tether", str(static_run), "--cell", cell, "-o", str(path), "--date", "2026-11-23"]) == 0
    again = read_calibration(path.read_text(), "again")
    for name in MOUNTS:
        found, first = again.of(name), tethered[1].of(name)
        assert (found.gain, found.gain_std) == pytest.approx((first.gain, first.gain_std), abs=1e-5)
        assert found.zero_mm == pytest.approx(first.zero_mm, abs=1e-5)
        assert found.true_mm == pytest.approx(first.true_mm, abs=1e-5)
    stds = [{name: one.gain_std for name, one in each.engine.items()} for each in (again, tethered[1])]
    assert stds[0] == pytest.approx(stds[1], rel=1e-3)


def test_gauge_blocks_after_a_tethered_run_ask_for_it_again(tethered, tmp_path, capsys):
    """Its gains hold what the curve says now: a transducer 2 % wrong was corrected twice, 110 N."""
    out = tmp_path / "c.toml"
    out.write_text(write_calibration(tethered[1]))
    blocks = np.linspace(0.0, 1.2, 7)
    table = np.column_stack((np.arange(7), blocks, 1.02 * blocks))
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="time_s,gauge_mm,deformation_mm", comments="")
    assert main(["calibrate", "blocks", str(tmp_path / "b.csv"), "--mount", "left_upper", "-o", str(out)]) == 0
    assert "tethered run of 2026-11-23 was read by another curve and is taken out" in capsys.readouterr().err
    found = read_calibration(out.read_text(), "c")
    assert (found.tethered, found.engine) == (None, {})
    assert all((found.of(name).gain, found.of(name).gain_std) == (1.0, None) for name in MOUNTS)
    assert found.of("right_upper").zeros == tethered[0].of("right_upper").zeros
    assert found.of("right_upper").read_mm == ()


def test_hours_are_counted_once_per_run(static_run, tmp_path, capsys):
    out = str(tmp_path / "c.toml")
    assert main(["calibrate", "hours", str(static_run), "-o", out]) == 0
    hours = read_calibration((tmp_path / "c.toml").read_text(), "c").of("left_upper").service_h
    assert 0.15 < hours < 0.24  # 15 minutes, two and a half of them off
    assert main(["calibrate", "hours", str(static_run), "-o", out]) == 2
    assert "counted already" in capsys.readouterr().err


def test_the_file_is_read_as_it_was_written_and_refuses_what_no_mount_has():
    zeros = tuple(Zero(on=f"2026-01-{day:02d}", mm=0.001 * day, std_mm=0.0005) for day in (1, 11, 21))
    mount = MountCalibration(zeros=zeros, read_mm=(0.0, 1.0), true_mm=(0.0, 1.01), gain_std=0.002, service_h=2.5)
    both = {"left": EngineCalibration(0.0021)}
    whole = Calibration(on="2026-01-21", mount={"left_upper": mount}, engine=both, runs=("a", "b"))
    assert read_calibration(write_calibration(whole), "c") == whole
    for text in (
        'on = "2026-01-01"\n[mount.x]\nzeros = [{on = "2026-01-01", mm = 0.3, std_mm = 0.001}]',
        'on = "2026-01-01"\n[mount.x]\nzeros = [{on = "2026-01-01", mm = 0.07, std_mm = 0.001}]',
        "on = 1",
        "[[",
    ):
        with pytest.raises(ConfigError, match=r"^c: "):
            read_calibration(text, "c")
    loaded = 'on = "2026-01-01"\n[mount.x]\ngain_std = 0.01\nzeros = [{on = "2026-01-01", mm = 0.07, std_mm = 0.001}]'
    assert read_calibration(loaded, "c").of("x").zero_mm == 0.07  # found under load: friction held the rest
    with pytest.raises(ThrustdError, match=r"mount\.nobody: expected one of left_upper"):
        with_calibration(None, Calibration(on="2026-01-01", mount={"nobody": mount})).parts()
    with pytest.raises(ThrustdError, match=r"engine\.middle: expected one of left, right"):
        with_calibration(None, Calibration(on="2026-01-01", engine={"middle": EngineCalibration(0.002)})).parts()
