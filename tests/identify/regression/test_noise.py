import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.identify.regression.noise import Lasting, Whitener, likeliest, whitened
from thrustd.identify.regression.regress import in_its_noise, regress
from thrustd.identify.segments import DEFORMATION, Segment

RNG = np.random.default_rng(53)


def covariance(places, lasting, dt_s):
    away_s = np.abs(np.subtract.outer(places, places)) * dt_s
    return np.eye(len(places)) + lasting.ratio * np.exp(-away_s / lasting.tau_s)


@given(
    ratio=st.floats(1e-3, 30.0),
    tau_s=st.floats(0.05, 100.0),
    gaps=st.lists(st.integers(1, 40), min_size=3, max_size=12),
)
def test_white_rows_are_those_of_the_inverse_covariance(ratio, tau_s, gaps):
    lasting, dt_s, places = Lasting(ratio, tau_s), 0.05, np.cumsum(gaps)
    rows = RNG.normal(size=(len(places), 2))
    white = rows.copy()
    runs, half = Whitener(lasting, dt_s), len(places) // 2
    runs.whiten(white[:half], places[:half])  # block by block, as the regression reads them
    runs.whiten(white[half:], places[half:])
    inverse = np.linalg.inv(covariance(places, lasting, dt_s))
    assert white.T @ white == pytest.approx(rows.T @ inverse @ rows, rel=1e-6, abs=1e-9)


def walked(n, dt_s, lasting, unit):
    """White noise and what lasts."""
    keeps, steps = np.exp(-dt_s / lasting.tau_s), RNG.normal(size=n)
    slow = np.empty(n)
    slow[0] = steps[0]
    for k in range(1, n):
        slow[k] = keeps * slow[k - 1] + np.sqrt(1.0 - keeps**2) * steps[k]
    return unit * (RNG.normal(size=n) + np.sqrt(lasting.ratio) * slow)


def test_what_lasts_is_told_from_its_residual():
    true = Lasting(0.1, 20.0)
    residuals = [walked(40_000, 0.05, true, 8.6) for _ in range(2)]
    residuals[0][1000:3000] = np.nan
    found = likeliest(residuals, [0.05, 0.05])
    assert found.ratio == pytest.approx(true.ratio, rel=0.3)
    assert found.tau_s == pytest.approx(true.tau_s, rel=0.5)
    left = whitened(residuals[0], found, 0.05)
    assert np.array_equal(np.isnan(left), np.isnan(residuals[0]))
    slow = left[3000:].reshape(-1, 500).mean(axis=1)  # of white noise: its variance over 500
    assert 500 * np.var(slow) < 2.0 * np.nanvar(left)


def test_white_noise_has_nothing_that_lasts():
    found = likeliest([RNG.normal(size=20_000)], [0.05])
    assert found.ratio * min(found.tau_s / 0.05, 100.0) < 0.1  # of its level over 100 samples


def test_a_cell_that_wanders_leaves_the_mount_as_well_known_as_it_is():
    """Noise of 5 N and a cell that wanders by 1.6 N count as 5 N, in place of 28 to 39 N at their slow end."""
    dt_s, n = 0.1, 36_000
    at_s = np.arange(n) * dt_s
    d = 0.5 + 0.4 * np.sin(at_s / 30.0) + 0.05 * np.sin(at_s)
    noise = walked(n, dt_s, Lasting(0.1, 100.0), 5.0)
    segment = Segment("bench", 0.0, dt_s, {DEFORMATION: d}, 5000.0 * d + noise)
    white = regress([segment], laws=(), settled=True)
    found = in_its_noise(white, [segment])

    def slope(solution):
        shape = solution.shape
        at = np.array([0.2, 0.8])
        ends = np.zeros(shape.n)
        ends[shape.parts()["f"]] = np.diff(shape.f_grid.values(at), axis=0)[0]
        value = shape.output_scale * float(ends @ solution.point.vector(shape)) / 0.6
        covariance = np.linalg.inv(solution.information + 1e-9 * np.eye(shape.n))
        return value, shape.output_scale * float(np.sqrt(ends @ covariance @ ends)) / 0.6

    def noise_n(solution):
        return solution.shape.output_scale * np.sqrt(solution.noise_variance)

    (value, sigma), (_, before) = slope(found), slope(white)
    assert abs(value - 5000.0) < 3.0 * sigma < 3.0 * before
    assert noise_n(found) < 6.0 and noise_n(white) > 20.0
