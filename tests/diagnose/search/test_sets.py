"""Which sets of effects are grown further, and which can be the verdict."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.diagnose.search.test_ranking import _fit, known
from thrustd.diagnose.search import sets
from thrustd.diagnose.search.better import gained, stands
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.floor import at_floor
from thrustd.diagnose.search.sets import adds, advanced, carried, room, taken
from thrustd.identify.identify import identify
from thrustd.twin.hide import hidden_case


def test_a_set_with_an_effect_that_its_errors_do_not_tell_from_nothing_is_no_verdict():
    """Blocks that follow one another share a drift, and agree on whatever follows it."""
    nothing, drifted, more = _fit("", 1.0, 0.0), _fit("m", 0.9, 0.01), _fit("mr", 0.8, 0.01)
    drifted.shown = more.shown = False
    assert gained(nothing, drifted) and not stands(nothing, drifted)
    cell = known(promised=0.5)
    for fit in (nothing, drifted, more):
        fit.words, fit.plateau = fit.terms, np.inf
    assert advanced(cell, nothing, nothing, [drifted, more])[0] is nothing


@given(st.floats(0.01, 0.99), st.floats(0.001, 0.9), st.floats(0.0, 1.0))
def test_where_there_is_no_room_nothing_that_leaves_the_floor_or_more_is_added(found, floor, share):
    """Else sets would be left out that could be the verdict."""
    base = known(promised=np.sqrt(floor))
    nothing, best = _fit("", 1.0, 0.0), _fit("m", max(found, floor), 0.0)
    more = _fit("mr", floor + share * (best.mse - floor), 0.0)
    nothing.plateau = best.plateau = more.plateau = np.inf
    assume(not at_floor(best, base))  # nothing is looked for there
    assert room(base, nothing, best) or not adds(base, nothing, best, more)


def test_of_the_sets_that_are_grown_further_one_is_of_other_effects():
    """Two laws of friction filled the beam, and inertia, beside which friction has another law, was not grown from."""
    stops, skewed, inertia, play = (
        _fit(word, mse, 0.0) for word, mse in zip("hhmp", (1.0, 1.1, 1.2, 1.3), strict=True)
    )
    for fit in (stops, skewed, inertia, play):
        fit.words = fit.terms
    assert carried(stops, [inertia, play, skewed, stops]) == [stops, skewed, inertia]
    assert carried(stops, [inertia, play, stops]) == [stops, inertia]
    assert carried(skewed, [stops, skewed]) == [skewed, stops]
    assert carried(_fit("", 2.0, 0.0), [inertia, skewed, stops]) == [stops, skewed, inertia]  # none stands yet


def test_what_stands_only_beside_the_others_is_grown_further_and_named_where_it_explains_everything(monkeypatch):
    """A drift and a scale: each alone helps, by an amplitude that what is missing beside it does not tell."""
    nothing, drift, both = _fit("", 1.0, 0.0), _fit("d", 0.7, 0.0), _fit("ds", 0.1, 0.0)
    drift.shown = False
    cell = known(promised=0.31)
    for fit in (nothing, drift, both):
        fit.words, fit.plateau = fit.terms, np.inf
    monkeypatch.setattr(sets, "simplest", lambda fits: fits[0])
    assert gained(nothing, drift) and not stands(nothing, drift)
    assert advanced(cell, nothing, nothing, [drift]) == (nothing, [drift])
    assert advanced(cell, nothing, nothing, [both]) == (both, [both])
    cell.promised = 0.1  # some of it many laws take, and any two take more
    assert advanced(cell, nothing, nothing, [both]) == (nothing, [both])


def test_three_plain_effects_of_which_none_stands_alone_are_found_together(monkeypatch):
    """Said to be unknown, along the acceleration times dynamic pressure."""
    hidden = "nacelle_drag", "sensor_drift", "axial_inertia"
    monkeypatch.setattr("thrustd.twin.hide.SAMPLE_HZ", 4.0)
    case = hidden_case(hidden, 921, 4.0, 3600.0)
    found = diagnose(identify([case.bench]).spec, [case.measured])
    assert set(found.verdict) == set(hidden)


@given(st.floats(0.01, 0.99), st.floats(0.001, 0.9), st.floats(0.001, 1.0), st.sampled_from(["mr", "mrp"]))
def test_a_set_that_leaves_more_than_may_be_taken_is_never_taken(found, floor, share, words):
    base = known(promised=np.sqrt(floor))
    nothing, best = _fit("", 1.0, 0.0), _fit("m", max(found, floor), 0.0)
    nothing.plateau = best.plateau = np.inf
    least = taken(base, nothing, best, len(words))
    more = _fit(words, least + share * (best.mse - least), 0.0)
    more.plateau = np.inf
    assert not adds(base, nothing, best, more) or (len(words) > 2 and not at_floor(more, base))
