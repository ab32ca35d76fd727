"""The compiled filter is filterpy's, to rounding."""

import numpy as np
from filterpy.kalman import KalmanFilter
from hypothesis import given
from hypothesis import strategies as st

from thrustd.fusion.kalman import predict, update


@given(st.integers(0, 10_000), st.integers(2, 7))
def test_it_is_filterpys(seed, n):
    rng = np.random.default_rng(seed)
    theirs = KalmanFilter(n, 1)
    scale = 10.0 ** rng.uniform(-3, 3, n)
    start = rng.normal(size=(n, n)) * scale[:, None]
    theirs.x, theirs.P = rng.normal(size=(n, 1)) * scale[:, None], start @ start.T + np.diag(scale**2)
    x, p, gain, work = theirs.x.copy(), theirs.P.copy(), np.zeros(n), np.zeros((2, n, n))
    for _ in range(20):
        f, q = np.eye(n) + 0.2 * rng.normal(size=(n, n)), np.diag(rng.uniform(0.0, 0.1, n) * scale**2)
        h, z, r = rng.normal(size=(1, n)) / scale, rng.normal(), rng.uniform(0.1, 2.0)
        f *= scale[:, None] / scale
        theirs.predict(F=f, Q=q)
        theirs.update(z, R=np.array([[r]]), H=h)
        predict(x, p, f, q, work[0])
        update(x, p, z, h, r, gain, work)
        np.testing.assert_allclose(x / scale[:, None], theirs.x / scale[:, None], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(p / np.outer(scale, scale), theirs.P / np.outer(scale, scale), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(gain / scale, theirs.K[:, 0] / scale, rtol=1e-8, atol=1e-9)
        assert np.linalg.eigvalsh(p / np.outer(scale, scale)).min() > 0.0


def test_a_measurement_without_noise_is_met():
    x, p, gain = np.zeros((2, 1)), np.diag([4.0, 1.0]), np.zeros(2)
    update(x, p, 3.0, np.array([[1.0, 0.0]]), 1e-12, gain, np.zeros((2, 2, 2)))
    assert abs(x[0, 0] - 3.0) < 1e-9
    assert p[0, 0] < 1e-9
    assert (x[1, 0], p[1, 1]) == (0.0, 1.0)
