"""When an effect may join the model: enough of the own squared error, surely, and worth it."""

import numpy as np
import pytest

from thrustd.diagnose.search.candidates import Candidate
from thrustd.diagnose.search.gram import Fit
from thrustd.diagnose.search.selection import Scored, acceptable
from thrustd.model.effects import effect_named

OWN_N2 = 100.0


def scored(gain_n2, t, before_n2=150.0):
    before, after = (Fit(np.ones(1), np.full(4, error), np.ones(4)) for error in (before_n2, before_n2 - gain_n2))
    candidate = Candidate(effect_named("creep"), {}, ("x",), np.ones((4, 1)))
    return Scored(candidate, after, None, before, t)


@pytest.mark.parametrize(
    ("gain_n2", "t", "first", "taken"),
    [
        (31.0, 3.0, False, True),
        (29.0, 3.0, False, False),  # not enough
        (31.0, 2.0, False, False),  # not sure
        (20.0, 5.0, True, True),  # the first, when very sure: half as much
        (20.0, 3.0, True, False),  # sure, but not very
        (20.0, 5.0, False, False),  # a later one may live on what the law of the first one missed
        (14.0, 9.0, True, False),  # so little no record with nothing hidden is allowed to show, however sure
    ],
)
def test_how_much_an_effect_must_gain(gain_n2, t, first, taken):
    assert acceptable(scored(gain_n2, t), OWN_N2**0.5, first) is taken


def test_an_effect_must_be_worth_it_where_much_is_left():
    assert acceptable(scored(31.0, 5.0, before_n2=200.0), OWN_N2**0.5)
    assert not acceptable(scored(31.0, 5.0, before_n2=1000.0), OWN_N2**0.5)
