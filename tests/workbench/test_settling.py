"""How long a start at rest is remembered."""

import pytest

from thrustd.model.artifact import LinearBlock, RealMode
from thrustd.workbench.settling import SHARE, settling_s


def test_one_mode_forgets_when_its_share_has_decayed():
    block = LinearBlock(1.05, [RealMode(100.0, -0.05)])
    assert settling_s(block) == pytest.approx(100.0 * 3.218875, rel=0.07)  # ln(0.05 / SHARE)
    assert SHARE == 0.002


def test_the_slowest_mode_that_counts_decides():
    fast, slow, weak = RealMode(1.0, -0.1), RealMode(500.0, -0.02), RealMode(1e5, -1e-4)
    assert settling_s(LinearBlock(1.0, [fast, slow, weak])) > 1000
    assert settling_s(LinearBlock(1.0, [fast, weak])) < 10


def test_no_memory_no_time():
    assert settling_s(LinearBlock(1.0)) == 0.0
