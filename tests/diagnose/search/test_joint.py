"""Laws as other people's mounts have them: beside the model's branches, under a trembling reading, on the spring."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount, record
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.base import SEARCHED, base_of, is_nuisance, records_of
from thrustd.diagnose.search.blocks import block_equations, std_over
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.grow import begin_at
from thrustd.diagnose.search.joint import counted, joint_fit, told
from thrustd.diagnose.search.library import rig_of, terms_of
from thrustd.diagnose.search.question import NOTHING, asked
from thrustd.diagnose.search.records import stretches
from thrustd.diagnose.search.rig import shipped_rig
from thrustd.diagnose.search.sets import exchanged, look, otherwise
from thrustd.identify.regression.friction import play_of
from thrustd.identify.regression.noise import Lasting
from thrustd.identify.regression.posterior import point_of
from thrustd.identify.regression.sweep import normal_equations
from thrustd.identify.regression.table import std_of
from thrustd.identify.regression.touched import run_apart
from thrustd.identify.segments import segments_of
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named
from thrustd.records.recording import make_recording

TREMBLE_MM = 3e-4


def rmse_n(spec, data):
    return compare({"model": spec}, [data]).comparisons[0].rmse_n


def trembling(effects):
    """`record` whose reading has noise that the mount does not feel."""
    data, clean = record(effects), columns()
    model = compile_model(mount(effects=effects), 1 / DT_S)
    force = model.simulate(model.inputs(clean))
    rng = np.random.default_rng(5)
    read = clean["deformation_mm"] + TREMBLE_MM * rng.standard_normal(len(force))
    noise = NOISE_N * rng.standard_normal(len(force))
    return make_recording("measured", {**data.channels, "time_s": data.time_s, "deformation_mm": read,
                                       "force_N": force + noise})  # fmt: skip


def measured_on(true_mount, data, step_s=DT_S):
    """What a load cell reads of a mount that is moved as `data` say."""
    model = compile_model(true_mount, 1 / step_s)
    noise = np.random.default_rng(3).normal(0, NOISE_N, len(data["time_s"]))
    return make_recording("measured", data | {"force_N": model.simulate(model.inputs(data)) + noise})


def test_a_further_branch_lies_beside_the_models_own():
    other = mount(gains=(0.05, 0.04, 0.07), taus_s=(0.4, 60.0, 30.0))
    measured = measured_on(other, columns())
    better = extend(mount(), [measured], ["relaxation"]).spec
    assert rmse_n(better, measured) < 1.03 * NOISE_N


def test_friction_of_bouc_and_wen_does_not_forget_under_noise():
    hidden = EffectSpec("hysteresis", {"friction_n": 150.0, "yield_mm": 0.1})
    report = extend(mount(), [trembling([hidden])], ["hysteresis"])
    numbers = {p.name: p for p in report.parameters}
    assert numbers["friction_n"].value == pytest.approx(150.0, rel=0.05)
    assert numbers["yield_mm"].value == pytest.approx(0.1, rel=0.15)


def test_play_begins_above_the_noise_of_the_reading():
    rng = np.random.default_rng(0)
    moving = np.sin(np.linspace(0.0, 20.0, 20_000)) + 0.002 * rng.standard_normal(20_000)
    assert play_of(moving) == pytest.approx(3.0 * 0.002, rel=0.05)
    assert play_of(np.zeros(100)) == 0.0


def test_the_artifact_softens_its_spring_as_the_fit_did():
    hidden = EffectSpec("mullins_softening_spring", {"softening": 0.1, "m_mm": 0.4})
    measured = record([hidden])
    report = extend(mount(), [measured], ["mullins_softening_spring"])
    assert report.parameters[0].value == pytest.approx(0.1, rel=0.05)
    assert rmse_n(report.spec, measured) < 1.03 * NOISE_N


def test_a_second_search_begins_at_the_equations_of_the_first(monkeypatch):
    """They are those of its end, to the bit; it only need not make them again."""
    question = asked(mount(), [record([EffectSpec("axial_inertia", {"mass_kg": 100.0})], n=6000)], NOTHING)
    joint, begun = import_module("thrustd.diagnose.search.joint"), []
    search = joint.solve

    def ended(forget):
        def solved(*args, given, **more):
            begun.append(given.normal is not None)
            return search(*args, given=given._replace(normal=None) if forget else given, **more)

        monkeypatch.setattr(joint, "solve", solved)
        return joint_fit(question.base, question.rows, ()).solution.point.vector(question.base.shape)

    assert np.array_equal(ended(forget=True), ended(forget=False)) and any(begun)


def test_sigmas_grow_where_blocks_disagree():
    steps = np.random.default_rng(2).standard_normal(12_000)
    wanders = np.repeat(200.0 * steps[::600], 600)
    effects = [EffectSpec("axial_inertia", {"mass_kg": 100.0})]
    wandering = record(effects, added=lambda data: wanders[: len(steps)] * data["accel_x_g"])
    spec = mount()
    segments = stretches(spec, [wandering])
    base = base_of(spec, segments)
    rows = [replace(row) for row in records_of(base, spec, segments)]
    term = next(terms_of(effect_named("axial_inertia"), rig_of(rows, base, spec, shipped_rig())))
    fit = joint_fit(base, rows, (term,), np.array(begin_at(term)))
    assert fit.std[-1] > 1.5 * std_of(fit.solution)[-1]


def test_friction_that_is_added_is_known_when_the_next_effect_is_looked_for():
    hidden = [
        EffectSpec("hysteresis_prandtl_ishlinskii", {"friction_n": 150.0}),
        EffectSpec("axial_inertia", {"mass_kg": 150.0}),
    ]
    measured = record(hidden)
    rubs = extend(mount(), [measured], ["hysteresis_stops"])
    again = diagnose(rubs.spec, [measured])
    assert again.rmse_before_n == pytest.approx(rubs.rmse_after_n, rel=0.05)
    assert again.verdict == ("axial_inertia",)


def test_a_spectrum_takes_the_size_that_the_data_have():
    far_from_typical = mount(gains=(0.05, 0.04, 2.5), taus_s=(0.4, 60.0, 10.0))
    report = diagnose(mount(), [measured_on(far_from_typical, columns())])
    assert report.verdict == ("relaxation",)
    assert report.rmse_after_n < 1.1 * NOISE_N


def test_the_noise_is_that_of_the_record_where_the_model_promised_less_exactness():
    modest = mount(k1=5500.0, k3=0.0, own_n=400.0)
    data = columns()
    data["deformation_mm"] *= np.clip(data["time_s"] / 20.0, 0.0, 1.0)
    report = diagnose(modest, [measured_on(mount(gains=(0.05, 0.04, 0.3), taus_s=(0.4, 60.0, 10.0)), data)])
    assert report.verdict == ("relaxation",)
    assert report.rmse_after_n < 2.0 * NOISE_N


def test_a_fast_record_that_stood_still_is_shorter_than_the_time_it_has_to_stand():
    quick, n, step_s = mount(taus_s=(0.01, 0.5)), 3001, 0.0011
    fast = {name: column[:n] for name, column in columns().items()} | {"time_s": np.arange(n) * step_s}
    report = diagnose(quick, [measured_on(quick, fast, step_s)])
    assert report.verdict == ("none",)


def test_a_large_effect_is_seen_from_the_core_as_it_was(identified):
    """A core that may move takes on two thirds of a zero that wanders by 0.07 mm, and others then remove as much."""
    measured = record([EffectSpec("sensor_drift", {"drift_mm_h": -1.0, "settling_h": 0.07})])
    question = asked(identified(7), [measured], NOTHING)
    names = ("sensor_drift", "thermal_expansion", "nacelle_drag", "creep", "ageing")
    nothing = joint_fit(question.base, question.rows, ())
    seen = look(question.base, question.rows, nothing, [effect_named(name) for name in names], question.rig)
    assert seen.looked[0].term.effect.name == "sensor_drift"
    assert seen.looked[0].removes > 0.95


def test_what_could_stand_in_a_members_place_is_tried_before_it_is_named(identified):
    """Creep beside inertia follows a part of a zero that wanders, which nobody had tried in its place."""
    wanders = EffectSpec("sensor_drift", {"drift_mm_h": -1.0, "settling_h": 0.07})
    measured = record([wanders, EffectSpec("axial_inertia", {"mass_kg": 100.0})])
    question = asked(identified(7), [measured], NOTHING)
    base, rows, rig = question.base, question.rows, question.rig
    effects = [effect_named(name) for name in ("creep_kelvin_voigt", "axial_inertia", "sensor_drift", "nacelle_drag")]
    creep, mass = (next(terms_of(effect, rig)) for effect in effects[:2])
    nothing = joint_fit(base, rows, ())
    looks, found = look(base, rows, nothing, effects, rig), joint_fit(base, rows, (creep, mass))
    rivals = exchanged(base, rows, looks, found, [nothing, found])
    best = min(rivals, key=lambda fit: fit.mse)
    assert set(best.words) == {"sensor_drift", "axial_inertia"}
    assert best.mse < 0.8 * found.mse
    assert not exchanged(base, rows, looks, found, [nothing, found, *rivals])


def test_the_laws_of_an_effect_are_tried_where_one_of_them_ended(identified):
    """From its own starts Bouc-Wen's ended at 40 N where Dahl's left 17 and itself, begun there, 13."""
    rubs = record(
        [EffectSpec("hysteresis_bouc_wen", {"friction_n": 120.0, "yield_mm": 0.02, "gamma": 0.3, "exponent": 1.6})]
    )
    question = asked(identified(7), [rubs], NOTHING)
    base, rows, rig = question.base, question.rows, question.rig
    effects = [effect_named(name) for name in ("hysteresis_dahl", "hysteresis_bouc_wen", "hysteresis", "creep")]
    nothing = joint_fit(base, rows, ())
    looks, dahl = look(base, rows, nothing, effects, rig), joint_fit(base, rows, (next(terms_of(effects[0], rig)),))
    found = {fit.terms[0].effect.name: fit for fit in otherwise(base, rows, looks, dahl)}
    assert "hysteresis_bouc_wen" in found and not {"hysteresis_dahl", "creep"} & set(found)
    assert found["hysteresis_bouc_wen"].mse < dahl.mse
    yields = dahl.terms[0].values(dahl.solution.point.terms[base.shape.sizes["terms"] :])["yield_mm"]
    assert all(fit.terms[0].fixed["yield_mm"] == pytest.approx(yields) for fit in found.values())


def test_what_lags_may_remember_when_a_record_begins_goes_with_the_load_there(identified):
    """A small load at first is no room for a zero, or a drift, that memory could stand in for."""
    spec, data = identified(7), record()

    def memory_n(begins):
        later = {name: column[begins:] for name, column in data.channels.items()}
        [segment] = segments_of([make_recording("later", {"time_s": data.time_s[begins:], **later})])
        base = base_of(spec, [segment])
        sizes = [term.std["lag_0"] for term in base.shape.terms if is_nuisance(term) and "lag_0" in term.std]
        return abs(float(segment.force_n[: round(1.0 / DT_S)].mean())), sizes

    loaded = [memory_n(begins) for begins in (2000, 2500, 3100)]
    for load_n, [size] in loaded:
        assert size / load_n == pytest.approx(loaded[0][1][0] / loaded[0][0], rel=1e-3)
    assert max(load for load, _ in loaded) > 1.2 * min(load for load, _ in loaded)


def test_friction_that_grows_with_the_travel_is_added_with_its_growth():
    weights = {"friction_06_n": 20.0, "friction_10_n": 30.0, "friction_13_n": 25.0}
    grown = EffectSpec("hysteresis_stops", {"travel_mm": 1.0, "growth": 2.0} | weights)
    data = record([grown])
    wider = extend(mount(), [data], ["hysteresis"]).spec
    assert rmse_n(wider, data) < 1.05 * NOISE_N
    [friction] = [effect for effect in wider.effects if effect.name == "hysteresis_stops"]
    assert friction.parameters["growth"] == pytest.approx(2.0 * friction.parameters["travel_mm"], rel=0.4)
    assert point_of(wider.posterior).growth[0] == friction.parameters["growth"]


def test_few_samples_rank_what_all_of_them_then_tell():
    measured = record([EffectSpec("axial_inertia", {"mass_kg": 150.0})], n=3 * SEARCHED)
    spec = mount()
    segments = stretches(spec, [measured])
    base = base_of(spec, segments)
    rows = records_of(base, spec, segments)
    few, [thin] = counted(base, rows, SEARCHED)
    term = next(terms_of(effect_named("axial_inertia"), rig_of(rows, base, spec, shipped_rig())))
    fit = joint_fit(few, [thin], (term,), np.array(begin_at(term)))
    assert len(thin.known) <= SEARCHED
    assert fit.plateau * base.scale == pytest.approx(NOISE_N, rel=0.03)  # neighbours are among them
    whole = told(base, rows, fit)
    assert len(whole.records[0].known) == 3 * SEARCHED
    assert whole.std[-1] < 0.8 * fit.std[-1]
    assert whole.mse == pytest.approx(fit.mse, rel=0.05)


@pytest.mark.parametrize(("name", "hidden"), [("relaxation", 0.0), ("axial_inertia", 150.0)])
def test_a_fit_passes_through_the_record_no_more_often_than_it_gains(monkeypatch, name, hidden):
    measured = record([EffectSpec("axial_inertia", {"mass_kg": hidden})])
    spec = mount()
    segments = stretches(spec, [measured])
    base = base_of(spec, segments)
    rows = records_of(base, spec, segments)
    term = next(terms_of(effect_named(name), rig_of(rows, base, spec, shipped_rig())))
    passes, runs = [], []

    def passed(*told):
        passes.append(told)
        return normal_equations(*told)

    def ran(*told):
        runs.append(told)
        return run_apart(*told)

    for module, attribute, counted_run in (("solve", "normal_equations", passed), ("touched", "run_apart", ran)):
        monkeypatch.setattr(import_module(f"thrustd.identify.regression.{module}"), attribute, counted_run)
    joint_fit(base, rows, (term,), np.array(begin_at(term)))
    assert len(passes) <= 4 and not runs


def test_blocks_add_up_to_the_white_normal_equations_and_the_errors_as_read():
    question = asked(mount(), [record(n=6000)], NOTHING)
    base, lasting = question.base, Lasting(0.2, 3.0)
    rows = [replace(row, lasting=lasting) for row in question.rows]
    normal = normal_equations(base.shape, base.point, rows)
    read, white = block_equations(base.shape, base.point, rows)
    assert white.matrix.sum(axis=0) == pytest.approx(normal.matrix)
    assert white.right.sum(axis=0) == pytest.approx(normal.right)
    assert white.squares.sum() == pytest.approx(normal.squares)
    assert read.squares.sum() == pytest.approx(sum(float(np.nansum(r**2)) for r in normal.residuals))
    assert white.squares.sum() < 0.99 * read.squares.sum()  # of which a part is known from the samples before


def test_an_error_that_lasts_a_third_of_the_record_widens_the_intervals():
    """A load cell that drifts pulls at the same numbers for twenty minutes: as many blocks say it as one."""
    question = asked(mount(), [record([EffectSpec("sensor_scale", {"scale_error": 0.02})])], NOTHING)
    term = next(iter(terms_of(effect_named("sensor_scale"), question.rig)))
    found = joint_fit(question.base, question.rows, [term])
    _, blocks = block_equations(found.solution.shape, found.solution.point, found.records)
    pull = 30.0 * blocks.right[:, found.new].std()
    size, std = len(blocks.size), []
    for pattern in (np.arange(size) % 3, np.arange(size) * 3 // size):  # by turns, and each third of the record alike
        scores = np.zeros_like(blocks.right)
        scores[:, found.new] = pull * (pattern - 1.0)[:, None]
        std.append(std_over(found.solution, replace(blocks, right=scores))[found.new][0])
    assert std[1] > 8.0 * std[0], std
