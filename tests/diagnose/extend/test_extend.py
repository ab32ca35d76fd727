"""Extend: the error falls on data not used, the ledger tells it, the new model flies."""

import numpy as np
import pytest

from tests.diagnose.scene import DT_S, inertia, mount, record
from thrustd.bench.plan_test import BenchPlan, programme
from thrustd.core.errors import ModelError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend import extend as module
from thrustd.diagnose.extend.extend import extend
from thrustd.identify.identify import identify
from thrustd.model.artifact import EffectSpec, read_model, write_model
from thrustd.model.compile import check_witness, compile_model
from thrustd.model.expression import expression_effect
from thrustd.records.recording import make_recording
from thrustd.twin.bench import RIG, programme_bench
from thrustd.twin.mount import UPPER


def test_the_error_falls_on_the_twins_held_out_record(twin_case):
    case = twin_case(("axial_inertia",))
    longer = extend(case.model, [case.measured], ["axial_inertia"])
    before, after = compare({"before": case.model, "after": longer.spec}, [case.heldout]).comparisons
    assert after.rmse_n < 0.5 * before.rmse_n
    truth = case.truth["parameters"]["axial_inertia"]["mass_kg"]
    assert longer.parameters[0].value == pytest.approx(truth, rel=0.1)


def test_the_ledger_tells_parent_and_fall():
    first = extend(mount(), [record([inertia(100.0)])], ["axial_inertia"], name="second")
    entry = first.spec.ledger[-1]
    assert (entry.added, entry.data, first.spec.name) == ("axial_inertia", "measured", "second")
    assert entry.rmse_after_n < entry.rmse_before_n
    assert len(entry.parent_sha256) == 64
    assert {"rmse_before_n", "rmse_after_n", "parameters"} <= set(first.to_json())


def test_a_models_file_holds_the_sigma_that_is_printed():
    """A mass is known no better than the scale of the load cell it was weighed with."""
    first = extend(mount(), [record([inertia(100.0)])], ["axial_inertia"])
    (mass,) = [number for number in first.parameters if number.name == "mass_kg"]
    (written,) = first.spec.effects
    assert written.std["mass_kg"] == pytest.approx(mass.half_width / 1.96, rel=1e-3)
    assert mass.std > 0.005 * mass.value


def test_two_effects_one_after_the_other_end_where_they_end_together():
    both = record([inertia(100.0)], added=lambda d: -0.02 * d["dynamic_pressure_Pa"])
    one = extend(mount(), [both], ["axial_inertia"]).spec
    after = extend(one, [both], ["nacelle_drag"]).spec
    at_once = extend(mount(), [both], ["axial_inertia", "nacelle_drag"]).spec
    assert len(after.ledger) == 2
    for spec in (after, at_once):
        values = {e.name: e.parameters for e in spec.effects}
        assert values["axial_inertia"]["mass_kg"] == pytest.approx(100.0, rel=0.03)
        assert values["nacelle_drag"]["drag_area_m2"] == pytest.approx(-0.02, rel=0.05)


def test_more_of_what_identify_found_by_itself_is_added_on_top():
    """A bench that held no load knows no slow branch: what `diagnose` then names, `extend` takes."""
    model = mount(effects=[EffectSpec("relaxation_maxwell", {"stiffness_03_n_mm": 100.0}, {})])
    slow = EffectSpec("relaxation_maxwell", {"stiffness_03_n_mm": 100.0, "stiffness_08_n_mm": 700.0}, {})
    more = extend(model, [record([slow])], ["relaxation"])
    assert more.effects == ("relaxation",)
    assert more.rmse_after_n < 0.5 * more.rmse_before_n
    assert compare({"more": more.spec}, [record([slow], seed=1)]).comparisons[0].rmse_n < 20.0


def test_what_may_as_well_be_nothing_is_left_out_of_several():
    """Two at once: without either alone the other did not stand, and both were written."""
    report = extend(mount(), [record([inertia(100.0)])], ["axial_inertia", "sensor_drift", "nacelle_drag"])
    assert report.effects == ("axial_inertia",)
    assert set(report.left_out) == {"sensor_drift", "nacelle_drag"}


def test_what_these_data_do_not_tell_stays_as_it_was_found():
    one = extend(mount(), [record([inertia(100.0)])], ["axial_inertia"]).spec
    drag = record(added=lambda d: -0.02 * d["dynamic_pressure_Pa"], seed=3)
    rest = make_recording("bench", {**drag.channels, "time_s": drag.time_s, "accel_x_g": 1e-4 * drag["accel_x_g"]})
    after = extend(one, [rest], ["nacelle_drag"]).spec
    assert after.effects[0].parameters == pytest.approx(one.effects[0].parameters, rel=1e-4)
    assert after.effects[1].parameters["drag_area_m2"] == pytest.approx(-0.02, rel=0.05)


def test_an_expression_survives_its_artifact_and_flies():
    data = record(added=lambda d: 60.0 * (d["cabin_psi"] - 14.0))
    guess = expression_effect("k * (cabin_psi - c)", data.channels)
    spec = read_model(write_model(extend(mount(), [data], [guess]).spec), "mount.json")
    check_witness(spec, "mount.json")
    values = spec.effects[0].parameters
    assert values["k"] == pytest.approx(60.0, rel=0.1)
    assert values["c"] == pytest.approx(14.0, rel=0.02)
    model = compile_model(spec, 1 / DT_S)
    rows = model.inputs({"deformation_mm": data["deformation_mm"][:200], "cabin_psi": data["cabin_psi"][:200]})
    state = model.start(rows[0])
    assert np.array_equal([model.step(state, row[1:], row[0]) for row in rows], model.simulate(rows))


def test_an_effect_that_stays_neutral_is_not_added_for_what_the_rest_gains():
    def forward(data):  # the opposite of friction
        return 20.0 * np.sign(np.diff(data["deformation_mm"], prepend=data["deformation_mm"][0]))

    with pytest.raises(ModelError, match="none of it"):
        extend(mount(k1=5050.0, own_n=40.0), [record(added=lambda d: -forward(d))], ["hysteresis_dahl"])


def test_two_chambers_begun_unloaded_tell_stiffness_from_expansion():
    """No start of a lag takes the place of either: nothing was loaded before. The twin: -2e-4 1/K, 1e-4 mm/K.

    Only a record's first minutes, before any load, tell expansion from the cell's zero: of two one may be held back.
    """

    def chamber(room_degc, seed):
        asked = make_recording("steps", programme("steps", BenchPlan(hours=1.0, seed=seed)))
        return programme_bench(asked, seed, UPPER, RIG._replace(room_degc=room_degc)).resample(2.0)

    known = identify([chamber(20.0, 1)], name="upper").spec
    records = [chamber(-10.0, 2), chamber(-10.0, 4), chamber(50.0, 3), chamber(50.0, 5)]
    report = extend(known, records, ["thermal_stiffness", "thermal_expansion"])
    values = {p.name: p.value for p in report.parameters}
    assert values["stiffness_1_k"] == pytest.approx(-2e-4, abs=1e-4)
    assert values["expansion_mm_k"] == pytest.approx(1e-4, abs=4e-5)
    assert not [name for name in values if name in ("lag_s", "surface_s")]  # which steady temperatures do not tell


@pytest.mark.parametrize("growth", [0.0, 2.0])
def test_friction_that_a_model_had_as_an_effect_is_in_the_model_that_is_written(growth):
    """A model that nobody identified here: its stops are known by their values alone."""
    stops = EffectSpec("hysteresis_stops", {"travel_mm": 1.0, "growth": growth, "friction_08_n": 60.0}, {})
    measured = record([stops, inertia(100.0)])
    more = extend(mount(effects=[stops]), [measured], ["axial_inertia"])
    assert not more.remarks
    assert compare({"more": more.spec}, [measured]).comparisons[0].rmse_n < 1.1 * more.rmse_after_n


def test_a_law_with_more_shapes_is_tried_only_where_its_channels_are():
    """Much is left beside the inertia; the law of a canted mount has no second acceleration to read."""
    rich = record([inertia(100.0)], added=lambda d: 60.0 * np.sin(0.05 * d["time_s"]))
    seen = {name: rich[name] for name in ("deformation_mm", "accel_x_g")}
    poor = make_recording("bench", {**seen, "time_s": rich.time_s, "force_N": rich["force_N"]})
    assert extend(mount(), [poor], ["axial_inertia"]).effects == ("axial_inertia",)


def test_a_model_that_is_not_its_fit_is_said_and_one_worse_than_its_parent_is_not_written(monkeypatch):
    """What is written is simulated: here as if it left so much more of the record."""
    measured, left = record([inertia(100.0)]), {}
    monkeypatch.setattr(module, "free_runs", lambda spec, s: (s.force_n, s.force_n - left[spec.name]))
    left |= {"mount": 60.0, "more": 12.5}
    assert extend(mount(), [measured], ["axial_inertia"], name="more").remarks == ()
    left["more"] = 30.0
    more = extend(mount(), [measured], ["axial_inertia"], name="more")
    [said] = more.to_json()["remarks"]
    assert "the model leaves 30 N of these records where its fit leaves 1" in said
    assert more.spec.ledger[-1].rmse_after_n == 30.0  # what it delivers, not what was promised
    assert more.rmse_after_n < 13.0
    left["more"] = 1e4
    with pytest.raises(ModelError, match=r"leaves 1e\+04 N .* and the model before 60 N; no model written"):
        extend(mount(), [measured], ["axial_inertia"], name="more")


def test_where_an_effect_carries_the_reading_beyond_the_data_the_model_follows_its_fit():
    """The rate of a lagging reading counts: the curve is read at more than twice what the record shows.

    A table goes straight on along its last chord, the curve of the fit along its end: 124 N were left of 31.
    """
    late = EffectSpec("time_delay_lag", {"delay_s": 4.0, "filter_s": 0.1})
    measured = record([late])
    more = extend(mount(), [measured], ["time_delay"])
    assert not more.remarks
    assert compare({"more": more.spec}, [measured]).comparisons[0].rmse_n < 1.1 * more.rmse_after_n


def test_what_a_model_leaves_is_what_compare_says_of_it():
    """A fit laid to a load before its record what no model knows: 33 N stood in the ledger of one that leaves 12."""
    angle = 8.0 * np.sin(np.arange(6000) * DT_S / 7.0)
    hidden = record(n=6000, added=lambda columns: 150.0 * np.tanh(angle / 2.0))
    kept = {name: hidden[name] for name in ("time_s", "force_N", "deformation_mm")} | {"incidence_deg": angle}
    flight = make_recording("flight", kept)
    report = extend(mount(), [flight], ["curve of incidence_deg"])
    leaves = compare({"with it": report.spec}, [flight]).comparisons[0].rmse_n
    assert not report.remarks
    assert report.spec.ledger[-1].rmse_after_n == pytest.approx(leaves, rel=0.1)
