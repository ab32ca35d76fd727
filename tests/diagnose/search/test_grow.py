"""Who is estimated: nobody loses by a place in the linear look that says nothing."""

from types import SimpleNamespace

from thrustd.diagnose.search.grow import unheard


def _look(word: str, removes: float) -> SimpleNamespace:
    return SimpleNamespace(term=SimpleNamespace(effect=SimpleNamespace(word=word)), removes=removes)


def test_an_effect_that_looks_as_good_as_the_best_estimated_is_heard_once():
    member, tried = SimpleNamespace(mse=1.0), [SimpleNamespace(mse=0.04, words=("ageing",))]
    drift, worse, other = _look("sensor_drift", 0.97), _look("sensor_drift", 0.965), _look("payne", 0.9)
    assert unheard([_look("ageing", 0.98), drift, worse, other], member, tried) == [drift]
