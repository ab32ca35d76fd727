"""A linear block with nonlinear feedback: one implementation, any rate, never running away."""

import msgspec
import numpy as np
import pytest

from thrustd.core.errors import ModelError
from thrustd.model.artifact import (
    ComplexMode,
    Feedback,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
    read_model,
    write_model,
)
from thrustd.model.compile import compile_model
from thrustd.model.feedback import beyond, feedback, products

LINE = PiecewiseLinear([-1.0, 1.0], [-1.0, 1.0])
MODES = ([RealMode(0.5, 0.2)], [ComplexMode(1.0, 12.0, 0.6, 0.3)])


def spec(into=None, degree=3, modes=MODES):
    n = len(modes[0]) + 2 * len(modes[1])
    rows = np.zeros((n, len(products(n + 1, degree)))) if into is None else into
    ball = np.eye(n + 1) / np.sqrt(n + 1)
    fed = Feedback(degree, [0.0] * (n + 1), [2.0] * (n + 1), ball.tolist(), rows.tolist())
    linear = LinearBlock(0.2, *modes, feedback=fed)
    return ModelSpec("thrustd-model/1", "fed", "feedback", LINE, linear, LINE, ValidRange((-1, 1), (-1, 1)))


def hardening(strength):
    """A spring that hardens with the cube of the real part of the oscillating mode."""
    rows = np.zeros((3, len(products(4, 3))))
    rows[1, products(4, 3).index((1, 1, 1))] = -strength
    return rows


def wander(n, seed=0):
    return np.interp(np.arange(n), np.arange(0, n + 50, 50), np.random.default_rng(seed).uniform(-1, 1, n // 50 + 1))


def test_without_feedback_it_is_the_linear_block():
    plain = msgspec.structs.replace(spec(), linear=LinearBlock(0.2, *MODES))
    u = wander(2000)[:, None]
    assert compile_model(spec(), 50.0).simulate(u) == pytest.approx(compile_model(plain, 50.0).simulate(u), abs=1e-12)


def test_it_solves_its_differential_equation():
    """Against small steps of the equation in the module's docstring, by hand for one real mode."""
    rows = np.zeros((1, len(products(2, 2))))
    rows[0, products(2, 2).index((0, 0))] = 0.8
    model = compile_model(spec(rows, 2, ([RealMode(0.5, 1.0)], [])), 50.0)
    u, s, fine, out = wander(500), 0.0, 400, []
    for k in range(499):
        for i in range(fine):
            v = u[k] + (u[k + 1] - u[k]) * (i + 0.5) / fine
            s += 0.02 / fine * -2.0 * (s - v - 0.8 * (s / 2.0) ** 2)
        out.append(0.2 * u[k + 1] + s)
    difference = np.abs(model.simulate(u[:, None])[1:] - out)
    assert difference[300:].max() < 1e-3 * np.ptp(out)


def test_one_artifact_serves_every_rate():
    model = spec(hardening(1.5))
    slow, fast = wander(1500), np.interp(np.arange(14_991) / 10, np.arange(1500), wander(1500))
    one, ten = compile_model(model, 50.0).simulate(slow[:, None]), compile_model(model, 500.0).simulate(fast[:, None])
    linear = compile_model(spec(), 50.0).simulate(slow[:, None])
    assert np.std(one - linear) > 0.02
    assert np.std(one - ten[::10]) < 0.02 * np.std(one - linear)


def test_it_starts_at_rest_and_stays_there():
    model = compile_model(spec(hardening(1.0)), 50.0)
    out = model.simulate(np.full((300, 1), 0.7))
    assert out == pytest.approx(np.full(300, out[0]), abs=1e-9)


def test_a_mode_that_never_settles_starts_somewhere():
    endless = spec(np.zeros((1, len(products(2, 3)))), modes=([RealMode(1e20, 1.0)], []))
    assert np.isfinite(compile_model(endless, 50.0).simulate(np.full((10, 1), 0.7))).all()


def test_no_input_makes_it_run_away():
    rows = np.random.default_rng(1).normal(size=(3, len(products(4, 3))))
    out = compile_model(spec(rows), 50.0).simulate(1e3 * np.random.default_rng(2).normal(size=(5000, 1)))
    assert np.isfinite(out).all()
    assert np.abs(out).max() < 1e5


def test_no_more_is_fed_back_where_no_data_were():
    """Two modes that went up together: to be at opposite ends is nothing that the products were learnt from."""
    together = np.linalg.inv(np.linalg.cholesky(np.array([[1.0, 0.99, 0.0], [0.99, 1.0, 0.0], [0.0, 0.0, 1.0]])))
    seen, unseen = np.array([0.9, 0.9, 0.0]), np.array([0.9, -0.9, 0.0])
    reach, modes = (np.zeros(3), np.ones(3), together), [(-1.0 + 0j, 0.5 + 0j), (-9.0 + 0j, 0.5 + 0j)]
    stage = feedback("fed", 0.0, modes, 2, reach, np.zeros((2, 6)), 0.02)
    assert beyond(seen, 0, stage.c) < 1.0
    assert beyond(unseen, 0, stage.c) > 10.0


def test_the_artifact_comes_back_and_is_checked():
    model = spec(hardening(1.0))
    assert read_model(write_model(model), "fed.json") == model
    assert "feedback" not in write_model(msgspec.structs.replace(model, linear=LinearBlock(1.0), structure="line"))
    short = msgspec.structs.replace(model.linear.feedback, into=[[0.0]] * 3)
    bad = msgspec.structs.replace(model, linear=msgspec.structs.replace(model.linear, feedback=short))
    flat = msgspec.structs.replace(model.linear.feedback, within=[[1.0]])
    worse = msgspec.structs.replace(model, linear=msgspec.structs.replace(model.linear, feedback=flat))
    with pytest.raises(ModelError, match=r"linear\.feedback\.within: expected 4 rows of 4 values"):
        read_model(write_model(worse), "fed.json")
    with pytest.raises(ModelError, match=r"linear\.feedback\.into: expected 3 rows \(states\) of 30 values"):
        read_model(write_model(bad), "fed.json")
