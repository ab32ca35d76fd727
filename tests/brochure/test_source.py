"""What the monitor is told of an engine's brochure."""

from math import nan

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.brochure.deck import Deck
from thrustd.brochure.source import BrochureSource
from thrustd.fusion.fusion_inputs import FusionInputs

DECK = Deck.from_json((ROOT / "models" / "brochure" / "jt15d-4.json").read_text(), "jt15d-4.json")
SIGNALS = ("fuel_flow_kg_s", "n1_pct", "n2_pct", "mach", "pressure_altitude_m", "sat_degC")
IDLE = (0.0242, 29.5, 48.5, 0.0, 0.0, 15.0)
STD = 3


@pytest.mark.parametrize(("trusted", "opens"), [(True, True), (False, False)])
def test_an_n1_that_is_not_trusted_does_not_open_the_tolerance_of_the_others(trusted, opens):
    """The deck's sigma has a lag of N1's own rate in it."""
    source = BrochureSource(DECK, 0, lambda signal, _: SIGNALS.index(signal))
    deck_n, rng, most_n = np.zeros(6), np.random.default_rng(0), 0.0
    for _ in range(100):
        readings = np.array(IDLE)
        readings[1] = rng.uniform(20.0, 100.0)
        source.look(0.1, readings, trusted, deck_n)
        most_n = max(most_n, deck_n[STD])
    assert (most_n > 1000.0) == opens
    assert opens or most_n < 100.0


@pytest.mark.parametrize(("fuel_kg_s", "n1_pct", "n2_pct", "unlit", "burns"), [
    (0.0, 0.0, 0.0, True, False), (0.024, 0.0, 48.5, False, True), (0.0, 0.0, 48.5, False, True),
    (0.024, 0.0, 0.0, False, True), (0.0, 29.5, 0.0, False, True), (0.0, 17.0, 12.0, True, False),
    (0.0, nan, 0.0, True, False), (nan, nan, nan, False, False), (nan, nan, 0.0, True, False),
])  # fmt: skip
def test_an_engine_burns_nothing_when_somebody_says_so_and_nobody_says_that_it_does(
    fuel_kg_s, n1_pct, n2_pct, unlit, burns
):
    """Who is not trusted is NaN."""
    source = BrochureSource(DECK, 0, lambda signal, _: SIGNALS.index(signal))
    told = FusionInputs(0, nan, nan, nan, nan, nan, nan).row()
    source.tell(0.1, np.array((fuel_kg_s, n1_pct, n2_pct, *IDLE[3:])), np.zeros(len(SIGNALS)), False, told)
    assert (told["unlit"].item(), told["burns"].item()) == (unlit, burns)
