"""What the monitor is told of an engine's brochure."""

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.brochure.deck import Deck
from thrustd.brochure.source import BrochureSource

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
