"""Structures, table, checks: small records of a known system."""

import json
from math import nan

import msgspec
import numpy as np
import pytest

from thrustd.core.errors import RecordingError, UsageError
from thrustd.diagnose.compare.first_look import first_look
from thrustd.identify.checks import check_records
from thrustd.identify.identify import identify, split, useless
from thrustd.identify.regression.general import Asked
from thrustd.identify.report import Errors, Score, as_table, errors_of
from thrustd.identify.segments import FORCE, segments_of
from thrustd.identify.structures import shelf, static, structure_named
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure
from thrustd.model.artifact import (
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    ValidRange,
    read_model,
    write_model,
)
from thrustd.model.compile import check_witness, compile_model
from thrustd.records.recording import make_recording

from .hw_truth import OSCILLATING, record, truth

SMALL = Asked(order=2, segments=4)
QUICK = [name for name in shelf() if shelf()[name].family in {"physical", "static", "autoregressive"}]


@pytest.fixture(scope="module")
def bench():
    return record(truth(), 6000)[0], record(truth(), 6000, seed=3, name="other")[0]


@pytest.fixture(scope="module")
def found(bench):
    names = [*QUICK, "arx", "armax", "oe-2-2", "box-jenkins", "hammerstein"]
    return identify([bench[0]], [bench[1]], names, name="left upper")


def test_every_structure_of_the_issue_is_on_the_shelf():
    wanted = """maxwell kelvin-voigt zener generalised-maxwell polynomial-ols polynomial-wls static-pwl arx armax oe-2-2
    oe-6-4 box-jenkins narx hammerstein hammerstein-pwl wiener hammerstein-wiener hw-pwl wiener-hammerstein feedback
    hw-pwl+bouc-wen hw-pwl+prandtl-ishlinskii hw-pwl+weight"""
    assert set(wanted.split()) == set(shelf())


def test_the_table_scores_all_of_them(found):
    scores = {score.structure: score for score in found.scores}
    assert len(scores) == len(QUICK) + 5
    rmse = {name: score.validation.rmse_n for name, score in scores.items()}
    assert rmse["hammerstein"] < min(rmse["oe-2-2"], rmse["arx"])
    assert scores["generalised-maxwell"].train.rmse_n < scores["zener"].train.rmse_n
    assert scores["static-pwl"].train.rmse_n < scores["polynomial-ols"].train.rmse_n
    assert as_table(found.scores).row_count == len(scores)
    json.dumps(found.to_json(), allow_nan=False)


def test_segments_predict_other_records_as_well_as_the_polynomial():
    """Ten minutes of a system with memory, which neither follows; five show fifteen levels, and luck decides."""
    train, other = (record(truth(), 60_000, seed=seed)[0] for seed in (0, 3))
    scores = identify([train], [other], ["static-pwl", "polynomial-ols"]).scores
    assert scores[0].validation.rmse_n < 1.02 * scores[1].validation.rmse_n


def test_the_best_becomes_an_artifact_that_proves_itself(found):
    best = min((s for s in found.scores), key=lambda s: s.validation.rmse_n)
    assert found.spec.structure in {best.structure, "hammerstein"}
    check_witness(read_model(write_model(found.spec), "model"), "model")
    assert found.spec.provenance["held_out"][0].startswith("other ")


def test_without_validation_data_the_end_of_every_record_is_held_out(bench):
    only = identify([bench[0]], structures=["static-pwl"])
    assert only.scores[0].validation.samples == 1200
    assert only.scores[0].train.samples == 4800


def test_friction_is_found_beyond_the_core(bench):
    """A mount with a friction loop: Bouc-Wen friction added to the core removes most of what it leaves."""
    line = PiecewiseLinear([0.0, 1.2], [0.0, 1.2])
    core = ModelSpec(
        "thrustd-model/1", "m", "hw-pwl", line, LinearBlock(1.0), PiecewiseLinear([0.0, 1.2], [0.0, 6000.0]),
        ValidRange((0.0, 1.2), (0.0, 6000.0)),
    )  # fmt: skip
    loop = EffectSpec("hysteresis", {"friction_n": 120.0, "yield_mm": 0.05})
    model = compile_model(msgspec.structs.replace(core, effects=[loop]), 20.0)
    force_n = model.simulate(model.inputs(bench[0].channels))
    data = make_recording(
        "loop",
        {"time_s": np.arange(6000) / 20, "deformation_mm": bench[0]["deformation_mm"], "force_N": force_n},
    )
    fitted = structure_named("hw-pwl+bouc-wen").fit(segments_of([data]), BlockFits(), None)
    [rubs] = fitted.spec.effects
    assert rubs.parameters["friction_n"] == pytest.approx(120.0, rel=0.1)
    assert fitted.spec.structure == "hw-pwl+bouc-wen"


def test_an_unstable_free_run_is_reported_and_no_crash(bench):
    segments = segments_of([bench[0]])
    runaway = Fitted(1, lambda segment: np.exp(np.arange(len(segment)) * 1.0))
    errors = errors_of(runaway, segments)
    assert not errors.stable
    assert np.isnan(errors.rmse_n)


def test_a_structure_that_cannot_be_fitted_is_a_line_of_the_table_and_no_end_of_the_others(bench, monkeypatch):
    def singular(segments, fits, progress):
        raise np.linalg.LinAlgError("Singular matrix")

    sick = Structure("static-pwl", "sick", "static", singular)
    monkeypatch.setattr(static, "STRUCTURES", (shelf()["polynomial-ols"], sick))
    found = identify([bench[0]], [bench[1]], ["polynomial-ols", "static-pwl"])
    assert found.spec.structure == "polynomial-ols"
    assert "static-pwl: could not be fitted: Singular matrix" in found.warnings
    with pytest.raises(RecordingError, match="could not be fitted: Singular matrix"):
        identify([bench[0]], [bench[1]], ["static-pwl"])


def test_weight_is_a_second_input(bench):
    structure = structure_named("hw-pwl+weight")
    assert structure.channels == ("accel_z_g",)
    load_g = 1.0 + 0.5 * np.sin(np.arange(6000) / 100)
    force_n = bench[0][FORCE] * (1.0 + 2e-5 * 1081.0 * (load_g - 1.0))
    data = bench[0].with_channels(accel_z_g=load_g, force_N=force_n)
    fitted = structure.fit(segments_of([data], structure.channels), BlockFits(), None)
    assert fitted.spec.effects[-1].parameters["stiffening_1_n"] == pytest.approx(2e-5, rel=0.1)


def test_unknown_structures_are_named():
    with pytest.raises(UsageError, match="unknown structure 'hw', expected one of maxwell"):
        structure_named("hw")


def test_wrong_units_clipping_and_rates_are_said(bench):
    good = bench[0]
    metres = good.with_channels(deformation_mm=good["deformation_mm"] / 1000)
    clipped = good.with_channels(force_N=np.minimum(good["force_N"], 3500.0))
    slower = make_recording("slow", {"time_s": good.time_s * 5, **good.channels})
    assert any("is it in m?" in line for line in check_records([metres]))
    assert any("clipped above" in line for line in check_records([clipped]))
    assert any("different rates" in line for line in check_records([good, slower]))
    assert check_records([good]) == []
    turned = good.with_channels(deformation_mm=-good["deformation_mm"])
    assert any("force_N falls while deformation_mm grows" in line for line in check_records([turned]))
    assert check_records([turned], mount=False) == []


def test_useless_records_are_refused(bench):
    flat = bench[0].with_channels(deformation_mm=np.ones(6000))
    with pytest.raises(RecordingError, match="deformation_mm is 1 all the time"):
        check_records([flat])
    empty = bench[0].with_channels(force_N=np.full(6000, np.nan))
    with pytest.raises(RecordingError, match="force_N has no value"):
        check_records([empty])


def test_what_is_held_out_is_not_reported_as_missing():
    flat = make_recording("bench", {"time_s": np.arange(100.0), "deformation_mm": np.ones(100), FORCE: np.ones(100)})
    (training,), (held_out,) = split([flat])
    assert np.isnan(training[FORCE]).sum() == 20
    assert np.all(np.isnan(training[FORCE]) != np.isnan(held_out[FORCE]))
    assert training.notes == flat.notes
    assert held_out.notes == flat.notes == ()


def test_where_the_usual_structure_fails_others_are_tried_and_said():
    """A resonance, which one real mode between two straight lines cannot follow."""
    data, _ = record(truth(OSCILLATING), 2000, hold=150)
    found = identify([data], settings=Asked(order=1, segments=1), others=("static-pwl", "oe-2-2"))
    assert [score.structure for score in found.scores] == ["hw-pwl+prandtl-ishlinskii", "static-pwl", "oe-2-2"]
    assert found.spec.structure == "oe-2-2"
    assert any("others were tried" in line for line in found.warnings)


def test_what_is_held_out_stays_hidden_on_an_uneven_time_axis():
    """One hiccup of the clock resamples the record; what was no number must not come back as one."""
    time_s = 0.02 * np.arange(1000.0)
    time_s[500:] -= 0.019
    ramp = make_recording("bench", {"time_s": time_s, "deformation_mm": np.arange(1000.0), FORCE: np.arange(1000.0)})
    for part in (one for parts in split([ramp]) for one in parts):
        (segment,) = segments_of([part])
        back = np.interp(part.time_s, segment.time_s, np.isfinite(segment.force_n))
        hidden = np.isnan(part[FORCE])
        inside = hidden & np.roll(hidden, 20) & np.roll(hidden, -20)
        assert inside.sum() > 20
        assert not back[inside].any()


def test_a_model_worse_than_a_constant_is_called_useless():
    """The record to validate on does what the bench never showed."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(0, 1, 50), 20)
    bench, other = (
        make_recording(name, {"time_s": np.arange(1000.0), "deformation_mm": u, FORCE: slope * u + 0.01 * noise})
        for name, slope, noise in zip(("bench", "other"), (1.0, -3.0), rng.normal(size=(2, 1000)), strict=True)
    )
    found = identify([bench], [other], structures=["static-pwl"])
    assert found.warnings[0].startswith("DO NOT USE THIS MODEL: the best of them (static-pwl) is ")


def test_a_model_that_is_better_than_a_constant_by_chance_alone_is_called_useless(bench):
    """One in six of benches of pure noise, 2160 samples: 1051 N on 432 that were held back."""
    for samples, words in ((432, "DO NOT USE THIS MODEL"), (432_000, None)):
        held_out = Errors(1051.0, nan, nan, 0.4, nan, True, samples)
        said = useless(Score("hw-pwl", "", "", held_out, held_out, 0.0, 8, nan, nan), bench)
        assert [line.split(":")[0] for line in said] == ([words] if words else [])


def test_a_model_that_explains_little_for_sure_is_usable():
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0, 1, 200), 20)
    records = [
        make_recording(name, {"time_s": np.arange(4000.0), "deformation_mm": u, FORCE: u + rng.normal(size=4000)})
        for name in ("bench", "other")
    ]
    found = identify(records[:1], records[1:], structures=["static-pwl"])
    assert found.usable and found.scores[0].validation.fit_pct < 10.0


def test_structures_share_the_fits_they_have_in_common(bench):
    made = []
    fits = BlockFits(SMALL)
    weight, core = structure_named("hw-pwl+weight"), structure_named("hw-pwl")
    still = bench[0].with_channels(accel_z_g=np.ones(6000))
    for structure in (core, weight):
        fitted = structure.fit(segments_of([still], structure.channels), fits, lambda step, _: made.append(step))
        made.append(structure.name)
    assert made[-2:] == ["hw-pwl", "hw-pwl+weight"]
    assert fitted.note == "accel_z_g never moves: this is hw-pwl"


@pytest.mark.parametrize(("name", "other"), [("force_N", "deformation_mm"), ("deformation_mm", "force_N")])
def test_a_transducer_that_stands_still_while_the_other_one_moves_is_said(bench, name, other):
    held = bench[0][name].copy()
    held[1000:2500] = held[1000]
    stuck = bench[0].with_channels(**{name: held})
    (line,) = check_records([stuck])
    assert line.startswith(f"bench: {name} stays at {held[1000]:g} for 1500 samples from 10 s on while {other} moves")
    assert line in first_look([stuck]).lines


def test_rubber_that_is_held_and_relaxes_is_no_stuck_transducer():
    time_s = np.arange(4000) * 0.05
    held = np.where(time_s < 5.0, time_s / 5.0, 1.0)
    noise = np.random.default_rng(0).normal(0.0, 5.0, len(time_s))
    force_n = 3000.0 * held * (1.0 + np.exp(-time_s / 40.0)) / 2.0 + noise
    data = {"time_s": time_s, "deformation_mm": held, "force_N": force_n}
    assert check_records([make_recording("hold", data)]) == []


def test_small_inputs_of_other_things_are_not_taken_for_metres(bench):
    tiny = bench[0].with_channels(deformation_mm=bench[0]["deformation_mm"] / 1000)
    assert check_records([tiny], mount=False) == []


def test_an_input_of_three_levels_is_enough_for_a_static_curve():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.integers(0, 3, 30), 20).astype(float)
    data = {"time_s": np.arange(600) * 0.1, "deformation_mm": u, "force_N": 2 * u + rng.normal(0, 0.01, 600)}
    found = identify([make_recording("levels", data)], structures=["polynomial-ols", "polynomial-wls", "static-pwl"])
    assert all(score.validation.rmse_n < 0.012 for score in found.scores)


def test_held_out_data_that_stand_still_judge_no_model():
    rng = np.random.default_rng(5)
    n = 4000
    u = np.where(np.arange(n) < 3100, np.repeat(rng.uniform(0.1, 1.0, n // 50), 50), 0.5 + 1e-4 * rng.normal(size=n))
    y = 5000.0 * u + rng.normal(0.0, 5.0, n) + np.where(np.arange(n) < 3100, 0.0, 40.0)
    record = make_recording("bench", {"time_s": np.arange(n) / 10.0, "deformation_mm": u, "force_N": y})
    found = identify([record.rows(slice(0, 3100))], [record.rows(slice(3100, n))], structures=["static-pwl"])
    assert not found.usable
    assert found.warnings[0].startswith("NOT JUDGED: the best of them (static-pwl) is ")
    assert "give --validate another record" in found.warnings[0]
