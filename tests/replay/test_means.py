"""What a flight says of itself without a truth."""

from math import nan

import numpy as np
import pytest

from thrustd.core.types import Estimate, Status
from thrustd.replay.means import TOGETHER, FlightMeans


def estimate(thrust_n, std_n=50.0, mount_n=nan, status=0):
    return Estimate(0, 0, thrust_n, std_n, 0, mount_n, 60.0, 5000.0, 90.0, nan, nan, nan, 0, 0, 0.5, status)


def means_of(estimates):
    means = FlightMeans()
    for e in estimates:
        means.take(e)
    return means.means()


def test_means_and_shares_are_of_all_estimates():
    n = 4 * TOGETHER + 4  # more than are counted at once
    stds = np.random.default_rng(1).lognormal(4.0, 1.0, n)
    mounts = np.where(np.arange(n) % 4, 5100.0, nan)
    flags = np.where(np.arange(n) % 2, int(Status.TRANSIENT | Status.ONE_MOUNT), 0)
    found = means_of(estimate(5000.0 + i % 2, *row) for i, row in enumerate(zip(stds, mounts, flags, strict=True)))
    assert found.status_pct == {"transient": 50.0, "one_mount": 50.0}
    fused, mount = found.sources["fused"], found.sources["mount"]
    assert (fused.mean_n, fused.known_pct, fused.farthest_n) == (5000.5, 100.0, 0.0)
    assert fused.std_n == pytest.approx(np.median(stds), rel=0.012)
    assert (mount.mean_n, mount.known_pct, mount.farthest_n) == (5100.0, 75.0, 100.0)


def test_a_source_that_never_spoke_is_left_out():
    assert set(means_of([estimate(1.0)] * 3).sources) == {"fused", "brochure"}


def test_nothing_is_no_engine():
    assert means_of([]).sources == {}


def test_the_trend_is_of_steady_thrust_and_both_sources():
    """Mounts 2 % above the brochure; what is idle, moves or lacks a source does not count."""
    steady = [estimate(5050.0, mount_n=5100.0)] * 300
    unfit = [
        estimate(5050.0, mount_n=9000.0, status=int(Status.TRANSIENT)),
        estimate(5050.0, mount_n=9000.0, status=int(Status.ONE_MOUNT)),
        estimate(5050.0),
        estimate(900.0, mount_n=9000.0)._replace(brochure_n=900.0),
    ]
    found = means_of([*steady, *unfit])
    assert found.residual_pct == pytest.approx(2.0)
    assert found.load_share == pytest.approx(0.5)
    assert np.isnan(means_of(unfit).residual_pct)
