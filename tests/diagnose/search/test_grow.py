"""Who is estimated: nobody loses by a place in the linear look that says nothing."""

from types import SimpleNamespace

from thrustd.diagnose.search.grow import begun_elsewhere, hopeful, unheard
from thrustd.diagnose.search.screen import Looked


def _look(word: str, mse: float, averaged: float = 0.0) -> Looked:
    return Looked(SimpleNamespace(effect=SimpleNamespace(word=word)), mse, 1.0, averaged)


def test_an_effect_that_looks_as_good_as_the_best_estimated_is_heard_once():
    tried = [SimpleNamespace(mse=0.04, words=("ageing",))]
    drift, worse, other = _look("sensor_drift", 0.03), _look("sensor_drift", 0.035), _look("payne", 0.1)
    assert unheard([_look("ageing", 0.02), drift, worse, other], tried) == [drift]


def test_the_noise_that_a_look_averages_out_is_no_merit_of_an_effect():
    tried = [SimpleNamespace(mse=0.1, words=("ageing",))]
    hopeless, hopeful = _look("sensor_drift", 0.05, averaged=0.07), _look("payne", 0.02, averaged=0.07)
    assert unheard([hopeless, hopeful], tried) == [hopeful]


def test_where_a_bench_knows_the_core_who_is_far_from_what_is_wanted_is_not_estimated():
    """A look shows three quarters of what a law removes at least; effects still to come may remove as much each."""
    near, far = _look("payne", 0.5), _look("ageing", 0.9)
    benched, free = SimpleNamespace(benched=True), SimpleNamespace(benched=False)
    assert hopeful(benched, [near, far], None, [], 0.4) == [near]
    assert hopeful(benched, [near, far], None, [], 0.9, 2) == [near, far]
    assert hopeful(free, [near, far], None, [], 0.4) == [near, far]
    assert hopeful(benched, [near, far], None, []) == [near, far]


def test_a_law_that_is_grown_further_is_begun_from_its_next_best_starts_once():
    """Mullins softening of a bearing left 0.77 tonf from the start that looked best, 0.73 from the next one."""
    law, other = SimpleNamespace(name="mullins_softening_cycles"), SimpleNamespace(name="payne_own")
    looked = [Looked(SimpleNamespace(effect=law), mse, 6.0, 0.0) for mse in (0.9, 1.0, 1.5, 1.6)]
    looked.append(Looked(SimpleNamespace(effect=other), 1.3, 6.0, 0.0))
    fits = [
        SimpleNamespace(terms=(SimpleNamespace(effect=other), looked[0].term)),
        SimpleNamespace(terms=(looked[4].term,)),
    ]
    assert begun_elsewhere(looked, fits) == looked[1:3]
