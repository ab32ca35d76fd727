"""Laws and free curves: which of them the verdict is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.diagnose.search.test_ranking import _fit, known
from thrustd.diagnose.search import verdict
from thrustd.diagnose.search.curves import Followed


def judged(monkeypatch, scale_leaves, curves):
    """What is said of a scale that leaves so much of 20, and of curves beside it; the floor is 1."""
    base = known(as_is_mse=20.0, promised=1.0)
    nothing, scale = _fit("", 20.0, 0.0), _fit("s", scale_leaves, 0.0)
    for fit in (nothing, scale):
        fit.plateau, fit.moved, fit.walked, fit.words = np.inf, 0.0, 0.0, tuple(fit.terms)
        fit.solution, fit.block_size = SimpleNamespace(noise_variance=1.0), np.ones(48)
    scale.terms = tuple(SimpleNamespace(effect=SimpleNamespace(name=word, channels=())) for word in scale.terms)
    ranked = SimpleNamespace(best=scale, nothing=nothing, curves=curves)
    monkeypatch.setattr(verdict, "table_of", lambda *_: None)
    monkeypatch.setattr(verdict, "followed", lambda *_: [])
    monkeypatch.setattr(verdict, "curve_sigma", lambda *_: 1.0)
    return verdict.judge(base, [], ranked).words


@pytest.mark.parametrize(("leaves", "words"), [(1.09, ("s",)), (0.98, ("unknown",))])
def test_a_curve_outdoes_a_law_by_more_than_the_numbers_that_it_takes(leaves, words, monkeypatch):
    """A scale that left 9.85 of 9.38 N was unknown: a curve of N1, by which every thrust goes, left 9.75 N."""
    curve = Followed("n1_pct", ("n1_pct",), leaves, leaves, 0.1, moved=0.0)
    assert judged(monkeypatch, 1.12, (curve, replace(curve, channel="n2_pct", mse=2.0, white=2.0))) == words


@pytest.mark.parametrize(
    ("leaves", "other", "words"),
    [(1.22, "cabin_dp_kPa", ("s",)), (1.22, "sat_degC", ("unknown",)), (1.62, "cabin_dp_kPa", ("unknown",))],
)
def test_what_curves_of_any_channel_do_beside_a_law_is_no_unknown_where_nothing_shows(
    leaves, other, words, monkeypatch
):
    """A scale of 1.1 % left 9.4 of 8.4 N; curves of the air's temperature and of cabin pressure 8.5 and 8.6 N."""
    curves = [Followed(name, (name,), mse, mse, 0.1, moved=0.0) for name, mse in (("sat_degC", 1.0), (other, 1.01))]
    assert judged(monkeypatch, leaves, tuple(curves)) == words
