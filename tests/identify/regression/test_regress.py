"""The regression: exact gradients, the floor on an unknown mount, groups that switch themselves off, its artifact."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from thrustd.identify.first_state import Beginning, begun_at
from thrustd.identify.regression.bounds import bounded
from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.friction import BESIDE, branched, law_of
from thrustd.identify.regression.general import MOUNT
from thrustd.identify.regression.hypotheses import explained, records_for
from thrustd.identify.regression.known import Known
from thrustd.identify.regression.posterior import information_of, kept, point_of, shape_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import first_point, prepared, regress, with_branches
from thrustd.identify.regression.solve import noise_level, prior_of, solve
from thrustd.identify.regression.sweep import columns, normal_equations
from thrustd.identify.regression.terms import APART, NUDGE, at_start
from thrustd.identify.segments import Segment
from thrustd.identify.sensitivity import residuals
from thrustd.identify.structures.mount import fitted_from
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named

DT_S, NOISE_N = 0.05, 12.0


def mount(n=20_000, seed=0, friction_n=0.0, settled=False):
    """Deformation steps -> force of a cubic spring with two relaxing branches and one slider."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(0.1, 1.1, n // 200 + 1), 200)[:n]
    d = lfilter([0.2], [1.0, -0.8], levels) + 0.002 * rng.standard_normal(n)
    w = 4500 * d + 700 * d**3
    force = w.copy()
    for gain, tau_s in ((0.1, 0.7), (0.06, 40.0)):
        keep = np.exp(-DT_S / tau_s)
        ramp = (1 - keep) * tau_s / DT_S
        start = w[0] if settled else 0.0
        before = np.concatenate(([start], w[:-1]))
        lag = lfilter([1.0], [1.0, -keep], (ramp - keep) * before + (1 - ramp) * w, zi=[keep * start])[0]
        force += gain * (w - lag)
    slider = 0.0
    for k in range(n):
        slider = min(max(slider + (d[k] - (d[k - 1] if k else 0.0)) / 0.05, -1.0), 1.0)
        force[k] += friction_n * slider
    return d, force, force + NOISE_N * rng.standard_normal(n)


def segment(d, y, name="bench"):
    return Segment(name, 0.0, DT_S, {"deformation_mm": d}, y)


@cache
def found_of(**options):
    """What is found of a record of such a mount."""
    d, _, y = mount(**options)
    return regress([segment(d, y)])


@pytest.mark.parametrize("growth", [0.0, 3.0])
def test_friction_that_grows_with_the_deformation_is_told_from_friction_that_does_not(growth):
    d, plain, _ = mount()
    friction = mount(friction_n=80.0)[1] - plain
    y = plain + (1 + growth * np.abs(d)) * friction + NOISE_N * np.random.default_rng(3).standard_normal(len(d))
    found = regress([segment(d, y)])
    assert np.sqrt(found.mean_square) * found.shape.output_scale == pytest.approx(NOISE_N, rel=0.03)
    [friction_n] = [e for e in fitted_from(found, [segment(d, y)]).spec.effects if e.name == "hysteresis_stops"]
    assert friction_n.parameters["growth"] == pytest.approx(growth * found.shape.radii[-1], rel=0.5, abs=0.15)


def unseen_error(found, **options):
    d, clean, _ = mount(seed=7, **options)
    record = Record(d, clean / found.shape.output_scale, DT_S, d[0] if options.get("settled") else 0.0)
    return (
        float(np.sqrt(np.mean((record.y - simulate(found.shape, found.point, record)) ** 2))) * found.shape.output_scale
    )


@pytest.mark.parametrize("friction_n", [0.0, 80.0])
def test_a_mount_is_found_to_a_fraction_of_the_noise(friction_n):
    found = found_of(friction_n=friction_n)
    assert np.sqrt(found.mean_square) * found.shape.output_scale == pytest.approx(NOISE_N, rel=0.02)
    assert unseen_error(found, friction_n=friction_n) < 0.35 * NOISE_N


def stiff_spring(n, seed):
    """A spring that hardens and does not relax, and two branches that the deformation stretches."""
    d = mount(n, seed)[0]
    force = 4500.0 * d + 4000.0 * d**3
    for stiffness, tau_s in ((900.0, 0.7), (700.0, 40.0)):
        keep = np.exp(-DT_S / tau_s)
        ramp = (1 - keep) * tau_s / DT_S
        before = np.concatenate(([0.0], d[:-1]))
        force += stiffness * (d - lfilter([1.0], [1.0, -keep], (ramp - keep) * before + (1 - ramp) * d))
    return d, force


def test_a_spring_that_does_not_relax_beside_branches_that_do():
    """The generalised Maxwell body with a nonlinear spring: one relaxation of the whole force cannot be both."""
    d, force = stiff_spring(20_000, 0)
    bench = [segment(d, force + NOISE_N * np.random.default_rng(5).standard_normal(len(d)))]
    whole = regress(bench)
    assert np.sqrt(whole.mean_square) * whole.shape.output_scale > 1.5 * NOISE_N
    found = explained(bench)
    other, unseen = stiff_spring(20_000, 7)
    model = compile_model(fitted_from(found, bench).spec, 1 / DT_S)
    from_rest = model.simulate(model.inputs({"deformation_mm": np.concatenate(([0.0], other))}))[1:]
    assert np.sqrt(np.mean((from_rest - unseen) ** 2)) < 0.5 * NOISE_N
    d, _, y = mount()
    assert all(term.effect not in BESIDE for term in explained([segment(d, y)]).shape.terms)


def test_branches_are_tried_beside_a_spring_of_which_no_lag_is_left():
    """Of an output that is noise nothing remains to say how slow branches may be: the records' own lengths do."""
    rng = np.random.default_rng(1)
    d = np.convolve(rng.normal(0.0, 1.0, 6050), np.ones(51) / 51, "valid")
    bench = [segment(d, rng.normal(0.0, 1.0, 6000))]
    plain = regress(bench)
    assert len(plain.shape.taus_s) == 0
    for law in BESIDE:
        assert with_branches(plain, bench, law).mean_square < 1.01 * plain.mean_square


def flowing(n, seed, within=8):
    """Bergstrom and Boyce: beside a spring, one behind a dashpot, whose rate is the fourth power of its load."""
    d = mount(n, seed)[0]
    force, load = np.empty(n), 0.0
    for k, step in enumerate(np.diff(d, prepend=0.0) / within):
        for _ in range(within):
            load += 900.0 * step
            slip = 900.0 * 0.004 * (load / 60.0) ** 4 * DT_S / within
            load -= slip * np.sign(load) / (1.0 + 4.0 * slip / max(abs(load), 1e-9))
        force[k] = 4500.0 * d[k] + 300.0 * d[k] ** 2 + load
    return d, force


def test_a_rubber_that_flows_the_faster_the_more_it_carries():
    """By a law that is none of ours: what a linear relaxation leaves on other data falls to less than half."""
    d, force = flowing(20_000, 0)
    bench = [segment(d, force + NOISE_N * np.random.default_rng(5).standard_normal(len(d)))]
    other, unseen = flowing(20_000, 7)

    def error(found):
        model = compile_model(fitted_from(found, bench).spec, 1 / DT_S)
        from_rest = model.simulate(model.inputs({"deformation_mm": np.concatenate(([0.0], other))}))[1:]
        return np.sqrt(np.mean((from_rest - unseen) ** 2))

    found = explained(bench)
    assert branched(found.shape).name == "relaxation_power"
    assert error(found) < 0.5 * error(regress(bench))
    assert error(found) < 0.35 * NOISE_N


def test_friction_that_is_not_there_switches_itself_off():
    found, rubbing = found_of(friction_n=0.0), found_of(friction_n=80.0)
    assert found.point.stops.sum() * found.shape.output_scale < 0.3 * NOISE_N
    assert rubbing.point.stops.sum() * rubbing.shape.output_scale == pytest.approx(80.0, rel=0.25)


def test_what_does_not_rub_is_learnt_without_friction():
    """A model's own output, as `diagnose` learns it: stops would only follow the curve's corners."""
    d, clean, _ = mount()
    found = regress([segment(d, clean)], laws=())
    assert not found.shape.terms and not len(found.shape.radii) and not found.shape.grows
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 0.3 * NOISE_N
    rubbing = regress([segment(d, mount(friction_n=80.0)[1])], laws=())
    assert np.sqrt(rubbing.mean_square) * rubbing.shape.output_scale > NOISE_N


def test_a_record_that_begins_settled_is_told_from_one_that_begins_unloaded():
    for settled, found in ((True, found_of(settled=True)), (False, found_of(friction_n=0.0))):
        assert np.sqrt(found.mean_square) * found.shape.output_scale == pytest.approx(NOISE_N, rel=0.02), settled
        assert unseen_error(found, settled=settled) < 0.35 * NOISE_N


def test_missing_references_carry_no_weight():
    d, _, y = mount()
    y[3000:9000] = np.nan
    found = regress([segment(d, y)])
    assert np.sqrt(found.mean_square) * found.shape.output_scale == pytest.approx(NOISE_N, rel=0.03)


@pytest.mark.parametrize(
    "options", [{}, {"move": True, "passive": False}, {"with_h": True, "poles": True, "move": True}]
)
def test_the_gradient_is_that_of_differences(options):
    d, _, y = mount(3000)
    shape, records = prepared([segment(d, y)])
    from dataclasses import replace

    if options.pop("with_h", False):
        shape = replace(shape, h_grid=Grid(-3.0, 5.0, 8))
    if options.pop("poles", False):
        shape = replace(shape, poles=np.log([[0.5, 3.0], [2.0, 9.0]]))
    shape = replace(shape, **options)
    rng = np.random.default_rng(3)
    point = first_point(shape, records)
    vector = point.vector(shape) + 0.05 * rng.random(shape.n)
    point = point.at(shape, vector)
    normal = normal_equations(shape, point, records)
    base = simulate(shape, point, records[0])
    assert np.allclose(records[0].y - base, normal.residuals[0], atol=1e-10)
    bends = shape.parts()["terms"].start + np.flatnonzero([not p.amplitude for p in shape.terms[0].free])
    for i in range(shape.n):
        step = np.zeros(shape.n)
        step[i] = APART if i in bends else 1e-6  # what a play keeps out changes by whole samples
        ends = [simulate(shape, point.at(shape, vector + by), records[0]) for by in (step, -step)]
        moved = (ends[0] - ends[1]) / (2.0 * step[i])
        assert float(moved @ normal.residuals[0]) == pytest.approx(normal.right[i], rel=2e-3, abs=1e-3)
        assert float(moved @ moved) == pytest.approx(normal.matrix[i, i], rel=2e-3, abs=1e-6)


def test_the_artifact_is_the_regression_within_a_tenth_of_the_noise():
    d, _, y = mount(friction_n=80.0)
    found = found_of(friction_n=80.0)
    spec = fitted_from(found, [segment(d, y)]).spec
    began = begun_at(segment(d, np.zeros_like(y)), Beginning(0.0))
    flown = -residuals(spec, began)[1:]
    model = simulate(found.shape, found.point, Record(d, y, DT_S, 0.0)) * found.shape.output_scale
    assert np.abs(flown - model).max() < 0.25 * NOISE_N
    assert float(np.sqrt(np.mean((flown - model) ** 2))) < 0.1 * NOISE_N


def test_friction_that_turns_over_within_little_more_than_the_noise_of_the_reading_is_found():
    """A bristle a five-hundredth of the travel long, and what its artifact makes of it."""
    rng = np.random.default_rng(4)
    d = 1.0 + np.cumsum(np.repeat(rng.choice([-1.0, 1.0], 40) * rng.uniform(0.5, 1.0, 40), 100)) * 2e-3
    d = 1e-4 * np.round(d / 1e-4)
    slider, force = 0.0, np.zeros(len(d))
    for k in range(1, len(d)):
        slider = min(max(slider + (d[k] - d[k - 1]) / (2e-3 * np.ptp(d)), -1.0), 1.0)
        force[k] = 2000.0 * d[k] + 500.0 * slider
    data = [segment(d, force + NOISE_N * rng.standard_normal(len(d)))]
    found = regress(data)
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 3.0 * NOISE_N
    [friction] = [e for e in fitted_from(found, data).spec.effects if e.name == "hysteresis_stops"]
    assert any(value > 0.0 for name, value in friction.parameters.items() if name > "friction_16_n" and name[-1] == "n")
    assert np.allclose(shape_of(kept(found)).radii, found.shape.radii)


def test_the_posterior_comes_back():
    d, _, y = mount(5000)
    found = regress([segment(d, y)])
    stored = kept(found)
    shape = shape_of(stored)
    n = shape.n  # friction that yields flies as an effect, with a sigma of its own
    assert np.allclose(point_of(stored).vector(shape), found.point.vector(found.shape)[:n])
    across = found.information[:n, n:] @ np.linalg.solve(found.information[n:, n:], found.information[n:, :n])
    assert np.allclose(information_of(stored), found.information[:n, :n] - across)


def test_the_posterior_knows_what_its_record_would_lose():
    """Also where friction grows by more and is less, and friction yields that did not."""
    d, plain, _ = mount(10_000)
    friction = mount(10_000, friction_n=150.0)[1] - plain
    y = plain + (1 + 3.0 * np.abs(d)) * friction + NOISE_N * np.random.default_rng(3).standard_normal(len(d))
    placed = regress([segment(d, y)])
    [record] = records_for(placed, [segment(d, y)])
    held = replace(placed.shape, move=False, taus_s=np.exp(placed.point.log_tau))  # where lags may lie is no part of it
    found = solve(held, placed.point, [record], placed.precisions)
    stored = kept(found, [law_of(found.shape).name])
    shape, point = shape_of(stored), point_of(stored)
    assert np.allclose(information_of(stored), found.information)
    told, groups = Known.of(shape, point.vector(shape), information_of(stored)), prior_of(shape, stored.strengths)

    def cost(point):
        """Of the record and of the priors of the groups."""
        vector = point.vector(shape)
        squares = normal_equations(shape, point, [record]).squares
        return squares / found.noise_variance + float(vector @ groups @ vector)

    for far in (
        replace(point, stops=0.8 * point.stops, growth=1.4 * point.growth),
        replace(point, f=0.97 * point.f),
        replace(point, terms=point.terms + np.array([0.5, 0.0, 0.0])),
    ):
        vector = far.vector(shape)
        assert told.cost(vector) == pytest.approx(cost(far) - cost(point), rel=0.01)
        nudge = 1e-6 * np.random.default_rng(1).standard_normal(shape.n)
        assert told.cost(vector - nudge) - told.cost(vector + nudge) == pytest.approx(
            4.0 * told.downhill(vector) @ nudge, rel=1e-3
        )


def test_the_posterior_of_a_model_of_few_modes_is_the_same_model():
    d, _, y = mount(5000)
    found = explained([segment(d, y)], replace(MOUNT, order=2))
    stored, record = kept(found), Record(d, y, DT_S, 0.0)
    bare = replace(found.shape, terms=()), replace(found.point, terms=np.zeros(0))
    assert np.allclose(simulate(shape_of(stored), point_of(stored), record), simulate(*bare, record))
    eigenvalues = np.linalg.eigvalsh(information_of(stored))
    assert eigenvalues.min() > -1e-12 * eigenvalues.max()


@given(st.integers(0, 10_000))
def test_bounded_solution_meets_its_optimality_conditions(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(12, 6))
    matrix, right = root.T @ root + 0.1 * np.eye(6), 5 * rng.normal(size=6)
    positive = np.array([False, False, True, True, True, True])
    t, free = bounded(matrix, right, positive)
    slope = matrix @ t - right
    assert (t[positive] >= 0).all()
    assert np.abs(slope[free]).max() < 1e-5 * max(1.0, np.abs(right).max())
    assert (slope[~free] > -1e-5).all()


def test_slow_errors_raise_the_noise_level():
    rng = np.random.default_rng(0)
    white = rng.normal(size=50_000)
    slow = lfilter([0.02], [1.0, -0.98], rng.normal(size=50_000))
    assert noise_level([white]) < 1.8
    assert noise_level([slow]) > 20 * float(np.var(slow))


@pytest.mark.parametrize("unit", [1e-3, 1e3, 1e5])
def test_friction_that_yields_is_found_in_any_unit_of_the_deformation(unit):
    d, _, y = mount(n=8_000, friction_n=80.0)
    in_mm, other = (regress([segment(k * d, y)]) for k in (1.0, unit))
    assert other.mean_square == pytest.approx(in_mm.mean_square, rel=0.01)
    spec = fitted_from(other, [segment(unit * d, y)]).spec
    model = compile_model(spec, 1 / DT_S)  # refuses parameters out of their bounds
    assert np.isfinite(model.simulate(model.inputs({"deformation_mm": unit * d[:100]}))).all()


@pytest.mark.parametrize(
    "names",
    [
        (),
        ("hysteresis_stops", "thermal_stiffness"),
        ("thermal_expansion",),
        ("relaxation", "thermal_stiffness"),
        ("relaxation_maxwell", "thermal_stiffness"),
        ("relaxation_power", "thermal_stiffness"),
    ],
)
def test_columns_that_a_record_keeps_are_those_of_a_run(names):
    """Of few samples that count: core, friction and effects that add, multiply or act on the deformation."""
    d, _, y = mount(n=3000)
    few = np.where(np.arange(len(y)) % 7 == 0, y, np.nan)
    warmth = {"temperature_degC": 20.0 + 5.0 * np.sin(np.arange(len(y)) / 300.0)}
    shape, [record] = prepared([segment(d, few)])
    effects = [effect_named(name) for name in names]
    more = tuple(
        at_start(effect, {p.name: 0.1 * p.starts[0] for p in effect.parameters if p.amplitude}, {})
        for effect in effects
    )
    shape = replace(shape, terms=(*shape.terms, *more))
    rng = np.random.default_rng(1)
    point = replace(first_point(shape, [record]), gain=rng.uniform(0, 0.1, 20), stops=rng.uniform(0, 0.1, 16))
    runs, keeps = replace(record, channels=warmth), replace(record, channels=warmth, kept={})
    for _ in range(2):  # made, then read
        for own, other in zip(columns(shape, point, runs), columns(shape, point, keeps), strict=True):
            for one, same in zip(own, other, strict=True):
                assert same == pytest.approx(one, abs=1e-7)
    plain = simulate(shape, point, keeps)
    assert plain == pytest.approx(simulate(shape, point, runs), abs=1e-9)
    shapes = [term.effect.site in ("force", "linear") and not p.amplitude for term in shape.terms for p in term.free]
    for i, by in enumerate(np.where(shapes, APART, NUDGE)):
        step = by * np.eye(len(point.terms))[i]
        ends = [step, -step if shapes[i] else 0.0 * step]
        up, down = (simulate(shape, replace(point, terms=point.terms + d), runs, runs.known) for d in ends)
        column = (up - down) / (2.0 * by if shapes[i] else by)
        rows = np.concatenate([rows.copy() for _, rows, _ in columns(shape, point, keeps)])
        assert rows[:, shape.parts()["terms"].start + i] == pytest.approx(column, abs=1e-4)
