"""A core that is eliminated once, against the whole solved at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.diagnose.search.absorbed import Absorbed, Columns
from thrustd.identify.regression.bounds import bounded

ROWS, CORE = 200, 9


def scene(seed: int, extra: int):
    """Rows of a core and of columns beside it, what is missed, and which numbers cannot be negative."""
    rng = np.random.default_rng(seed)
    rows, beside = (
        rng.standard_normal((ROWS, CORE)) * 10.0 ** rng.uniform(-3, 3, CORE),
        rng.standard_normal((ROWS, extra)),
    )
    missed = 0.1 * rng.standard_normal(ROWS) + beside @ rng.standard_normal(extra) + rows[:, 0]
    return rng, rows, beside, missed, np.arange(CORE) % 3 == 0, rng.random(extra) < 0.5


def found(rows, beside, missed, vector, core_positive, positive, prior=1e-6):
    core = Absorbed.of(rows.T @ rows + prior * np.eye(len(vector)), rows.T @ missed, vector, core_positive)
    return core.steps(Columns(rows.T @ beside, beside.T @ beside, beside.T @ missed), positive)


@given(st.integers(0, 10_000), st.integers(0, 6))
def test_step_and_numbers_are_those_of_the_whole(seed, extra):
    rng, rows, beside, missed, core_positive, positive = scene(seed, extra)
    vector = np.abs(rng.standard_normal(CORE)) / np.linalg.norm(rows, axis=0)
    whole = np.column_stack((rows, beside))
    prior = np.diag(np.r_[np.full(CORE, 1e-6), np.ones(extra)])
    start = np.r_[vector, np.zeros(extra)]
    information = whole.T @ whole + prior
    right = whole.T @ missed + information @ start
    expected, _ = bounded(information, right, np.r_[core_positive, positive])
    step, numbers = found(rows, beside, missed, vector, core_positive, positive)
    size = np.linalg.norm(rows, axis=0)
    assert (vector + step) * size == pytest.approx(expected[:CORE] * size, abs=1e-6 * np.linalg.norm(missed))
    assert numbers == pytest.approx(expected[CORE:], abs=1e-6)


@given(st.integers(0, 10_000))
def test_a_combination_that_only_rounding_tells_explains_no_column_better_than_it_is(seed):
    """Else what is left of the column is less than nothing, and a look at it ends the diagnosis."""
    rng, rows, _, missed, _, _ = scene(seed, 0)
    rows, way = rows / np.linalg.norm(rows, axis=0), rng.standard_normal(ROWS)
    rows[:, 8] = rows[:, 1] + rows[:, 2] + 1e-7 * way
    along = 100.0 * (way[:, None] + 1e-3 * rng.standard_normal((ROWS, 6)))
    either, never_negative = np.zeros(CORE, bool), np.ones(6, bool)
    _, numbers = found(rows, along, missed, np.zeros(CORE), either, never_negative, 0.0)
    assert np.all(np.isfinite(numbers)) and np.all(numbers >= 0.0)
