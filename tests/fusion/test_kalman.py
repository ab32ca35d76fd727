"""filterpy's filter comes without scipy.stats and scipy.linalg, and both packages stay what they are for others."""

import subprocess
import sys

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
assert filterpy.kalman.KalmanFilter is KalmanFilter
assert abs(one.log_likelihood - filterpy.stats.logpdf(one.y, cov=one.S)) < 1e-12
import scipy.linalg
assert scipy.linalg.norm([3.0, 4.0]) == 5.0
"""
AFTER = """
import filterpy.kalman
from thrustd.fusion.kalman import KalmanFilter
assert filterpy.kalman.KalmanFilter is KalmanFilter
"""


def test_alone_before_and_after_filterpy():
    for script in (SCRIPT, AFTER):
        answer = subprocess.run([sys.executable, "-W", "ignore", "-c", script], capture_output=True, text=True)
        assert answer.returncode == 0, answer.stderr
