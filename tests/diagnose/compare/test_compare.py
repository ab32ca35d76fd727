"""Compare: the numbers are right, and where it fails is said in words."""

import json

import numpy as np
import pytest
from rich.console import Console
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, inertia, mount, record
from thrustd.diagnose.compare.before_after import before_after_pictures
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.failures import where_it_fails
from thrustd.diagnose.compare.motion import motion_of
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.picture_data import spectrum_of
from thrustd.diagnose.compare.pictures import comparison_pictures, in_unit
from thrustd.diagnose.compare.regions import errors_by_region, regions_of
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording
from thrustd.records.roles import Roles
from thrustd.records.shown import as_text


def test_a_right_model_leaves_the_noise():
    c = compare({"mount": mount()}, [record()], load_cell_std_n=NOISE_N).comparisons[0]
    assert c.rmse_n == pytest.approx(NOISE_N, rel=0.03)
    assert c.rmse_in_noise == pytest.approx(1.0, rel=0.03)
    assert abs(c.bias_n) < 1.0
    assert c.fit_pct > 99.0
    assert all(abs(value) < 0.05 for value in c.autocorrelation.values())


def test_the_worst_error_is_found_with_its_time():
    data = record()
    force = data["force_N"].copy()
    force[1000] += 500.0
    c = compare({"mount": mount()}, [data.with_channels(force_N=force)]).comparisons[0]
    assert c.worst_at_s == pytest.approx(50.0)
    assert c.worst_n == pytest.approx(500.0, abs=60.0)


def test_a_failure_is_named_in_words_with_its_shares():
    wrong = record(added=lambda d: np.where(d["temperature_degC"] > 34.0, 100.0, 0.0))
    c = compare({"mount": mount()}, [wrong]).comparisons[0]
    first = c.where_it_fails[0]
    assert "temperature above" in first.words
    assert first.share_of_squared_error > 0.8
    assert "% of the squared error in" in first.sentence


def test_what_thrustd_said_itself_is_no_place_where_a_model_fails():
    data = record()
    rest_n = lfilter([1.0], [1.0, -0.999], np.random.default_rng(3).normal(size=len(data)))
    off_n = np.where(rest_n > np.quantile(rest_n, 0.8), 150.0, 0.0)
    off = data.with_channels(force_N=data["force_N"] + off_n, check_source_residual_n_left=rest_n)
    assert not any("check_" in one.sentence for one in compare({"mount": mount()}, [off]).comparisons[0].where_it_fails)


def test_an_even_error_fails_nowhere():
    rng = np.random.default_rng(0)
    force = np.linspace(0, 6000, 20_000)
    assert where_it_fails(regions_of(force, 0.05, {}), rng.normal(0, 10, 20_000)) == []


def test_an_error_without_a_region_is_said_to_be_a_constant_or_to_have_happened_once():
    """A bias of 0.053 of an RMSE of 0.053, and a resonance that a sweep passes once, were "nowhere in particular"."""
    data, t = record(), record().time_s
    cases = {"everywhere alike: measured minus model is +": np.full(len(t), 40.0),
             "once: ": np.where(abs(t - 305.0) < 4.0, 300.0 * np.sin(9.0 * t), 0.0)}  # fmt: skip
    for words, added in cases.items():
        c = compare({"mount": mount()}, [data.with_channels(force_N=data["force_N"] + added)]).comparisons[0]
        assert c.where_it_fails == () and c.nowhere.startswith(words), c.where_it_fails
        assert c.to_json()["nowhere"] == c.nowhere
        if words == "once: ":
            begin, end = (float(c.nowhere.split(" s;")[0].split()[i]) for i in (-3, -1))
            assert begin <= 305.0 <= end
        console = Console(record=True, width=200)
        compare({"mount": mount()}, [data.with_channels(force_N=data["force_N"] + added)]).print(console)
        assert c.nowhere in console.export_text()
    assert compare({"mount": mount()}, [data]).comparisons[0].nowhere.startswith("nowhere in particular")


def test_chance_slices_are_not_led_with():
    """Slow noise, ten seconds of memory: whatever stands out of thousands of slices is chance."""
    data, named = record(), 0
    for seed in range(8):
        slow = lfilter([1.0], [1.0, -np.exp(-DT_S / 10.0)], np.random.default_rng(seed).normal(size=len(data)))
        named += bool(where_it_fails(regions_of(data["force_N"], DT_S, data.channels), slow))
    assert named <= 1


def test_what_happened_once_is_no_rule():
    data = record()
    error = np.random.default_rng(0).normal(0, 10, len(data))
    error[4000:4100] += 300.0
    assert where_it_fails(regions_of(data["force_N"], DT_S, data.channels), error) == []


def test_the_far_end_that_is_right_is_not_said_to_fail():
    """A record that warms up, an error that is small and one-sided where it is cold."""
    data = record()
    warm = np.linspace(0.0, 1.0, len(data))
    error = 142.0 - 600.0 * np.maximum(warm - 0.2, 0.0) + np.random.default_rng(0).normal(0, 10, len(data))
    found = where_it_fails(regions_of(data["force_N"], DT_S, dict(data.channels) | {"temperature_degC": warm}), error)
    assert found and all(failure.share_of_squared_error > 0.7 * failure.share_of_time for failure in found)
    assert found[0].bias_n < 0.0


def test_an_even_error_that_is_one_sided_after_each_movement_is_friction_to_the_eye():
    """As much squared error everywhere: only its sign goes with the last movement."""
    data = record()
    motion = motion_of(data["deformation_mm"], DT_S)
    error = 200.0 * motion.direction + np.random.default_rng(0).normal(0, 10, len(data))
    found = where_it_fails(regions_of(data["force_N"], DT_S, data.channels), error)
    held = {failure.labels: failure.bias_n for failure in found}
    assert held[("holding after loading",)] == pytest.approx(200.0, abs=10.0)
    assert held[("holding after unloading",)] == pytest.approx(-200.0, abs=10.0)


def _staircase():
    """Up in steps of any size, then down to idle at once: low load is held after unloading only."""
    rng, levels = np.random.default_rng(0), []
    while len(levels) < 40:
        levels += [*sorted(rng.uniform(0.4, 1.1, rng.integers(2, 5))), 0.1]
    held = np.repeat(levels[:40], 300)
    return np.convolve(np.pad(held, (40, 0), mode="edge"), np.ones(41) / 41, mode="valid")


def _of_a_mount(deformation_mm, added_n, **channels):
    """A record of `mount` that moves so, with further force and 12 N of noise."""
    data = {"time_s": np.arange(len(deformation_mm)) * DT_S, "deformation_mm": deformation_mm}
    model = compile_model(mount(), 1 / DT_S)
    noise = np.random.default_rng(5).normal(0, NOISE_N, len(deformation_mm))
    force = model.simulate(model.inputs(data)) + added_n + noise
    return make_recording("measured", data | {"force_N": force} | channels)


def test_friction_is_told_by_the_last_movement_and_not_by_the_channels_that_go_with_it():
    """At idle the mount came down and at full thrust it came up: load and N2 show nearly the same."""
    x = _staircase()
    direction = np.where(motion_of(x, DT_S).direction < 0, -1.0, 1.0)
    record_ = _of_a_mount(x, 150.0 * direction, n2_pct=60.0 + 35.0 * x, n1_pct=40.0 + 55.0 * x)
    first, second, *_ = compare({"mount": mount()}, [record_]).comparisons[0].where_it_fails
    assert {first.labels, second.labels} == {("holding after loading",), ("holding after unloading",)}
    assert first.bias_n * second.bias_n < 0


def test_relaxation_of_a_few_cycles_is_not_nowhere():
    """What an elastic law leaves of an elastomer that is pulled, held and let go: no two holds alike."""
    step_s, time_s = 0.5, np.arange(0.0, 300.0, 0.5)
    strain = np.interp(time_s % 60.0, [0.0, 6.0, 28.0, 34.0, 60.0], [0.0, 1.0, 1.0, 0.0, 0.0])
    strain *= np.repeat([0.6, 1.0, 0.8, 1.2, 0.7], 120)
    stress = 10.0 * strain + sum(
        lfilter([g, -g], [1.0, -np.exp(-step_s / tau)], strain) for g, tau in ((6.0, 3.0), (4.0, 30.0))
    )
    slope = float(strain @ stress / (strain @ strain))
    (first, *_) = where_it_fails(regions_of(stress, step_s, {"deformation_mm": strain}), stress - slope * strain)
    assert any("hold" in word for word in first.labels), first.words


def test_a_late_reading_is_told_by_sign_and_size_of_the_velocity():
    data = record(n=36_000)
    velocity = np.gradient(data["deformation_mm"], DT_S)
    found = where_it_fails(
        regions_of(data["force_N"], DT_S, data.channels),
        1000.0 * velocity + np.random.default_rng(1).normal(size=len(data)),
    )
    assert found[0].labels[0] in ("loading", "unloading") and found[1].labels[0] in ("loading", "unloading")
    assert "moving faster" in found[0].words
    assert found[0].bias_n * found[1].bias_n < 0


def test_what_scatters_more_somewhere_without_a_side_is_told_too():
    data = record()
    rng = np.random.default_rng(1)
    size = np.where(data["accel_z_g"] > 1.05, 40.0, 10.0)
    found = where_it_fails(regions_of(data["force_N"], DT_S, data.channels), size * rng.normal(size=len(data)))
    assert found and "load factor above" in found[0].words
    assert abs(found[0].bias_n) < 5.0


def test_a_channel_that_explains_more_than_the_motion_leads():
    data = record(added=lambda d: 3000.0 * d["accel_x_g"])
    assert "longitudinal acceleration" in compare({"mount": mount()}, [data]).comparisons[0].where_it_fails[0].words


def test_what_was_not_visited_before_is_told_from_what_was():
    data = record()
    motion = motion_of(data["deformation_mm"], DT_S)
    error = np.where(motion.newest, 100.0, 5.0) * np.random.default_rng(0).normal(size=len(data))
    regions = {r.label: r for r in errors_by_region(regions_of(data["force_N"], DT_S, data.channels), error)}
    assert regions["at a new extreme"].rmse_n > 10 * regions["within the range reached before"].rmse_n


def test_shares_of_a_dimension_add_up():
    """Those of the whole record; motion has dimensions of what moves or is held alone."""
    c = compare({"mount": mount()}, [record([inertia(150.0)])]).comparisons[0]
    for dimension in {"force", "direction", "time since reversal", "travel", "history", "temperature"}:
        lines = [r for r in c.regions if r.dimension == dimension]
        assert sum(r.share_of_time for r in lines) == pytest.approx(1.0)
        assert sum(r.share_of_squared_error for r in lines) == pytest.approx(1.0)


def test_several_models_and_recordings_side_by_side(tmp_path):
    models = {"without": mount(), "with": mount(effects=[inertia(150.0)])}
    report = compare(models, [record([inertia(150.0)], name="one"), record([inertia(150.0)], seed=3, name="two")])
    data = json.loads(json.dumps(report.to_json()))
    assert [(c["model"], c["recording"]) for c in data["comparisons"]] == [
        ("without", "one"),
        ("without", "two"),
        ("with", "one"),
        ("with", "two"),
    ]
    assert {"rmse_n", "mae_n", "bias_n", "fit_pct", "worst", "regions"} <= set(data["comparisons"][0])
    assert data["comparisons"][2]["rmse_n"] < data["comparisons"][0]["rmse_n"]


def test_the_sign_of_the_error_is_told(capsys):
    """Force that the model lacks is positive, in numbers, table and JSON."""
    data = record()
    report = compare({"mount": mount()}, [data.with_channels(force_N=data["force_N"] + 50.0)])
    assert report.comparisons[0].bias_n > 40.0  # the first state takes a few of the 50 N
    assert report.to_json()["error"] == "measured minus model"
    report.print(Console(width=160))
    assert "bias and worst: measured minus model" in " ".join(capsys.readouterr().out.split())


def test_pictures_are_written(tmp_path):
    comparison = compare({"mount": mount()}, [record(n=4000)]).comparisons[0]
    paths = comparison_pictures(comparison, tmp_path / "pictures")
    assert len(paths) == 5
    assert all(path.stat().st_size > 5000 for path in paths)


def test_several_models_are_drawn_before_and_after_in_one_scale(tmp_path):
    models = {"without": mount(), "with": mount(effects=[inertia(150.0)])}
    report = compare(
        models, [record([inertia(150.0)], n=n, name=name) for name, n in (("one.csv", 4000), ("two.csv", 4200))]
    )
    paths = before_after_pictures(report.comparisons, tmp_path)
    assert [path.name for path in paths] == ["one-models.png", "two-models.png"]
    assert all(path.stat().st_size > 20_000 for path in paths)
    assert before_after_pictures(report.comparisons[:1], tmp_path / "none") == []
    assert not (tmp_path / "none").exists()


def test_pictures_are_in_the_units_of_the_file():
    assert in_unit("force", "N") == "force [N]"
    assert in_unit("Load [kN]", "kN") == "Load [kN]"
    assert in_unit("y", "") == "y"


def test_what_was_before_the_recording_is_no_error_of_the_model():
    whole = record(n=14_000)
    late = make_recording("late", {"time_s": whole.time_s[2000:], **{n: c[2000:] for n, c in whole.channels.items()}})
    slow = mount(gains=(0.05, 0.12), taus_s=(0.4, 60.0))
    model = compile_model(slow, 1 / DT_S)
    force = model.simulate(model.inputs({"time_s": whole.time_s, **whole.channels}))[2000:]
    report = compare({"mount": slow}, [late.with_channels(force_N=force)])
    (c,) = report.comparisons
    assert c.rmse_n < 0.3 * c.rmse_from_rest_n
    assert f"begun at rest it leaves {newtons(c.rmse_from_rest_n, unit='N')}" in as_text(report.print)


def test_places_of_failure_go_with_the_load_of_another_kind_of_rubber():
    """A strip of half a newton, wrong while it is let go."""
    force = 0.5 * np.abs((np.arange(4000) / 1000.0) % 2.0 - 1.0)
    unloading = np.gradient(force) < 0.0
    residual = np.where(unloading, 0.1, 0.001)
    (worst, *_) = where_it_fails(regions_of(force, 0.02, {}), residual)
    assert worst.labels == ("unloading",)
    assert "0.1 N RMS, measured minus model" in worst.sentence
    assert {"below 0.2 N", "above 0.3 N"} <= {region.label for region in regions_of(force, 0.02, {})}


def test_a_dash_for_a_unit_is_none():
    data = record(n=3000)
    found = regions_of(data["force_N"], DT_S, data.channels, Roles("Shear strain [-]", "Ratio [-]"))
    assert not [region.label for region in found if " - " in f"{region.label} " or " -/" in region.label]
    assert any("of travel since a reversal" in region.label for region in found)


def test_what_does_not_go_with_the_residual_has_little_coherence_and_what_does_comes_first():
    """That of a single stretch would be 1 for any two columns."""
    rng = np.random.default_rng(3)
    data = record(n=3000)
    noise = rng.normal(size=len(data))
    force = data["force_N"] + 20.0 * noise
    data = data.with_channels(force_N=force, hidden=noise, idle=rng.normal(size=len(data)))
    spectrum = spectrum_of(compare({"mount": mount()}, [data]).comparisons[0])
    assert next(iter(spectrum.coherence)) == "hidden"
    assert 0.65 < spectrum.explained["hidden"] < 0.82  # 20 N of it, 12 N of noise: 0.735
    assert spectrum.explained["idle"] < 0.25
