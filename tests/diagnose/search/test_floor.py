"""What nothing could go below: noise or the bench's rest of a load cell, what no deck holds better of a brochure."""

from types import SimpleNamespace

from thrustd.diagnose.search.ranking import EXACT, at_floor, floor_of


def test_against_a_brochure_the_floor_is_the_decks_and_not_the_benchs():
    fit = SimpleNamespace(plateau=0.001, mse=(1.02 * EXACT) ** 2, terms=("law",))
    cell, deck = (SimpleNamespace(promised=0.004, by_brochure=way) for way in (False, True))
    assert floor_of(fit, cell) == 0.001 and not at_floor(fit, cell)
    assert floor_of(fit, deck) == EXACT and at_floor(fit, deck)
    assert not at_floor(SimpleNamespace(plateau=0.001, mse=(2 * EXACT) ** 2, terms=("law",)), deck)
