"""Which regression data speak for, its exact columns, and fewer modes for the same relaxation."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.identify.regression import hypotheses
from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.hypotheses import Asked, explained
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.reduce import fewer
from thrustd.identify.regression.regress import first_point
from thrustd.identify.regression.shape import Shape
from thrustd.identify.regression.sweep import columns
from thrustd.identify.report import errors_of
from thrustd.identify.segments import segments_of
from thrustd.identify.structures import structure_named
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import of_spec
from thrustd.model.artifact import LinearBlock, RealMode
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording
from thrustd.twin.bench import sine_bench

from ..hw_truth import OSCILLATING, record, truth


@pytest.mark.parametrize("move", [False, True])
def test_columns_are_the_derivatives_of_the_free_run(move):
    rng = np.random.default_rng(0)
    u = np.cumsum(rng.normal(size=600)) * 0.05
    poles = np.log(np.array([[2.0, 9.0], [1.0, 30.0]]))
    grid, h_grid = Grid(float(u.min()), float(u.max()), 8), Grid(-4.0, 4.0, 7)
    shape = Shape(grid, 0.3, np.array([0.05, 0.5, 3.0]), np.array([0.1, 0.3]), 1.0, h_grid, poles, passive=False,
                  move=move, grows=True, begun=1)  # fmt: skip
    data = Record(u, rng.normal(size=600), 0.05, float(u[0]), place=0)
    start = first_point(shape, [data])
    vector = start.vector(shape) + 0.2 * rng.normal(size=shape.n)
    point = start.at(shape, vector)
    rows = np.concatenate([rows.copy() for _, rows, _ in columns(shape, point, data)])
    for j in range(shape.n):
        step = 1e-6 * np.eye(shape.n)[j]
        change = simulate(shape, point.at(shape, vector + step), data) - simulate(
            shape, point.at(shape, vector - step), data
        )
        np.testing.assert_allclose(rows[:, j], change / 2e-6, atol=2e-5 * max(1.0, float(np.abs(rows[:, j]).max())))


def test_samples_that_do_not_count_have_no_part_in_the_columns_of_others():
    """A basis function behind a lag fades in between exactly as if every row were written."""
    rng = np.random.default_rng(1)
    u = rng.uniform(size=3000)
    shape = Shape(Grid(0.0, 1.0, 8), 0.0, np.array([0.01, 50.0]), np.zeros(0), 1.0, passive=False)
    all_of_it = Record(u, np.zeros(3000), 1.0, 0.0)
    few = Record(u, np.where(np.arange(3000) % 700 == 0, 0.0, np.nan), 1.0, 0.0)
    point = first_point(shape, [all_of_it]).at(shape, rng.normal(size=shape.n))
    every, some = (next(rows.copy() for _, rows, _ in columns(shape, point, r)) for r in (all_of_it, few))
    np.testing.assert_allclose(some, every[::700], rtol=1e-9, atol=1e-12)


def test_a_resonance_gets_its_pair():
    data, sigma = record(truth(OSCILLATING), 4000, hold=150)
    found = explained(segments_of([data]), Asked())
    assert len(found.point.pair_gain) >= 1
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.3 * sigma


def test_a_curve_behind_is_found():
    data, sigma = record(truth(LinearBlock(1.45, [RealMode(0.05, -0.3), RealMode(2.0, -0.15)])), 12_000)
    found = explained(segments_of([data]), Asked())
    assert np.abs(np.diff(found.point.h, 2)).max() > 1e-3
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.3 * sigma


def test_what_only_the_rest_of_a_long_record_shows_counts_too():
    """Its first third hardly moves: there a mount does as well as a system of gains of either sign and two curves."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(0.0, 1.2, 300), 200)
    u[:20_000] = 0.6 + 0.05 * (u[:20_000] - 0.6)
    system = truth(LinearBlock(1.2, [RealMode(0.5, -0.3), RealMode(3.0, 0.1)]))
    noise = 20.0 * rng.normal(size=len(u))
    y = compile_model(system, 100.0).simulate(u[:, None]) + noise
    data = make_recording("bench", {"time_s": np.arange(len(u)) / 100.0, "deformation_mm": u, "force_N": y})
    found = explained(segments_of([data]))
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.05 * 20.0


def test_signs_that_an_even_curve_loses_are_found_again():
    """A swing of 3 Hz and a lag behind a two-level input, 300 samples of the absolute value."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.3], 60), 5)
    p, a = np.exp(complex(-2.0, 20.0) * 0.02), np.exp(-0.02 / 0.3)
    x = lfilter([0.0, 1 - a], [1.0, -a], u) + lfilter([0.0, 1 - p], [1.0, -p], u.astype(complex)).real
    y = np.abs(x) + 0.02 * rng.standard_normal(len(x))
    data = make_recording("even", {"time_s": 0.02 * np.arange(len(u)), "deformation_mm": u, "force_N": y})
    found = explained(segments_of([data]), Asked())
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 0.2 * np.std(y)


def test_modes_faster_than_the_means_of_a_long_record_are_found(monkeypatch):
    monkeypatch.setattr(hypotheses, "MANY", 10_000)
    monkeypatch.setattr(hypotheses, "THINNED", 1_000)
    data, sigma = record(truth(LinearBlock(1.3, [RealMode(0.04, -0.3)])), 20_000)
    found = explained(segments_of([data]), Asked())
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.25 * sigma


def test_modes_close_to_each_other_are_told_apart_in_a_long_record(monkeypatch):
    """Gains of either sign: the relaxation of one mode is within a hundredth of them, the data are not."""
    monkeypatch.setattr(hypotheses, "MANY", 10_000)
    monkeypatch.setattr(hypotheses, "THINNED", 6_000)
    modes = [RealMode(0.55, -0.3), RealMode(1.1, 0.3), RealMode(3.0, -0.3)]
    data, sigma = record(truth(LinearBlock(1.3, modes)), 60_000, noise=0.003)
    found = explained(segments_of([data]), Asked())
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.01 * sigma


def test_a_record_that_begins_loaded_teaches_no_state_that_a_flight_does_not_know():
    """A slow sine about a load, without friction in the model: modes that swing at first would close its loop."""
    data = segments_of([sine_bench(0.5, 12).resample(2.0)])
    fits = BlockFits()
    found = fits.of(data, Asked(), None).found
    known_n = np.sqrt(found.mean_square) * found.shape.output_scale
    flown = structure_named("hw-pwl").fit(data, fits, None)
    assert errors_of(flown, data).rmse_n < 1.2 * known_n


def test_an_output_that_follows_late_at_any_speed_is_found_and_flies():
    """A stack of play operators, as a piezo's elongation behind its voltage: no passive friction does so."""
    rng = np.random.default_rng(7)
    turns = np.cumsum(rng.integers(40, 200, 60))
    u = np.interp(np.arange(turns[-1]), np.concatenate(([0], turns)), np.concatenate(([0.0], rng.uniform(0, 150, 60))))
    y = 0.05 * u
    for radius, weight in ((2.0, 0.02), (8.0, 0.03), (25.0, 0.03)):
        play = 0.0
        late = [play := max(v - radius, min(v + radius, play)) for v in u]
        y = y + weight * np.array(late)
    sigma = 0.02
    columns = {"deformation_mm": u, "force_N": y + sigma * rng.standard_normal(len(u))}
    data = segments_of([make_recording("stack", {"time_s": 0.01 * np.arange(len(u)), **columns})])
    flown = structure_named("hw-pwl+prandtl-ishlinskii").fit(data, BlockFits(), None)
    assert errors_of(flown, data).rmse_n < 1.5 * sigma
    assert any("exchanged" in said for said in flown.warnings)


def test_few_modes_follow_what_many_do():
    tau_s = np.geomspace(0.01, 1000.0, 16)
    gain = np.exp(-(np.log(tau_s / 3.0) ** 2))
    few, weights = fewer(tau_s, gain, 4)
    times = np.geomspace(0.01, 1000.0, 50)[:, None]
    many = np.exp(-times / tau_s) @ gain
    assert np.abs(np.exp(-times / few) @ weights - many).max() < 0.03 * gain.sum()


@pytest.mark.parametrize("name", ["arx", "armax"])
def test_equation_error_models_fly_as_they_were_fitted(name):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0.2, 1.0, 200), 20)
    y = np.empty(4000)
    x = v = u[0]
    for k in range(4000):
        x, v = 0.9 * x + 0.1 * u[k], 0.6 * v + 0.4 * x
        y[k] = 5000 * v
    data = {"time_s": np.arange(4000) / 20.0, "deformation_mm": u, "force_N": y + rng.normal(0, 5.0, 4000)}
    (segment,) = segments_of([make_recording("bench", data)])
    fitted = structure_named(name).fit([segment], BlockFits(), None)
    if fitted.spec is None:
        assert "no artifact" in fitted.note
        return
    flown = of_spec(fitted.spec, 0).simulate(segment)
    np.testing.assert_allclose(flown, fitted.simulate(segment), rtol=1e-6, atol=1e-3)
