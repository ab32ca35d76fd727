"""filterpy's filter comes without scipy.stats and scipy.linalg, and both packages stay what they are for others."""

import subprocess
import sys

import numpy as np

from thrustd.fusion.kalman import KalmanFilter

SCRIPT = """
import sys
from thrustd.fusion.kalman import KalmanFilter
assert not {"scipy.stats", "scipy.linalg"} & set(sys.modules)
assert "filterpy" not in sys.modules
one = KalmanFilter(2, 1)
one.predict()
one.update([1.0])
import filterpy.kalman
import filterpy.stats
assert issubclass(KalmanFilter, filterpy.kalman.KalmanFilter)
assert abs(one.log_likelihood - filterpy.stats.logpdf(one.y, cov=one.S)) < 1e-12
import scipy.linalg
assert scipy.linalg.norm([3.0, 4.0]) == 5.0
"""
AFTER = """
import filterpy.kalman
from thrustd.fusion.kalman import KalmanFilter
assert issubclass(KalmanFilter, filterpy.kalman.KalmanFilter)
"""


def test_alone_before_and_after_filterpy():
    for script in (SCRIPT, AFTER):
        answer = subprocess.run([sys.executable, "-W", "ignore", "-c", script], capture_output=True, text=True)
        assert answer.returncode == 0, answer.stderr


def test_the_same_bits_as_filterpy():
    rng = np.random.default_rng(3)
    filters = KalmanFilter(4, 1), KalmanFilter.__base__(4, 1)
    for _ in range(20):
        f, h = rng.normal(size=(4, 4)) / 2.0, rng.normal(size=(1, 4))
        z, r = rng.normal(), np.array([[rng.uniform(0.1, 2.0)]])
        for one in filters:
            one.predict(F=f)
            one.update(z, R=r, H=h)
        assert (filters[0].x == filters[1].x).all() and (filters[0].P == filters[1].P).all()
