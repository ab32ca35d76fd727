"""Readings of a mount and of the brochure, in rows as the bank of sensors keeps them."""

from math import log, sqrt

import numpy as np
import pytest

from thrustd.brochure.deck import total_ratios
from thrustd.core.aircraft import MountPlace
from thrustd.diagnose.search.brochure_sources import _table
from thrustd.identify.segments import Segment
from thrustd.installation.shipped import read_deck
from thrustd.sensors.past import LOG_FLOW, PER_FUEL_N

PLACE = MountPlace("left_upper", "left", 0, 0.46)
FUEL = 0.08


def test_a_rows_place_on_the_deck_is_the_fuel_flow_and_its_slope_is_that_of_the_thrust_over_it():
    """The slope stood for the place once: rows of one fuel flow were as far from each other as thrusts in newtons."""
    n = 40
    air = {"mach": 0.35, "pressure_altitude_m": 2000.0, "sat_degC": 3.0}
    inputs = {name: np.full(n, value) for name, value in air.items()}
    inputs |= {"fuel_flow_kg_s": np.full(n, FUEL), "n1_pct": np.full(n, 80.0)}
    deck, force_n = read_deck(), np.full(n, 1000.0)
    segment = Segment("flight", 0.0, 0.5, inputs, force_n)
    (row, *_) = table = _table(segment, [force_n], 4, [10.0], deck, PLACE)
    delta_t, theta_t = total_ratios(*air.values())
    corrected = FUEL / (delta_t * sqrt(theta_t))
    assert len(table) == n // 4
    assert row[LOG_FLOW] == pytest.approx(log(corrected), abs=0.1)  # the median's, of fuel flow and N1
    more, less = (deck.along(np.array([[x * FUEL, np.nan, np.nan, *air.values(), 0.0]]), 0) for x in (1.01, 1 / 1.01))
    assert row[PER_FUEL_N] == pytest.approx(((more.thrust_n - less.thrust_n) / (2 * log(1.01))).item(), rel=0.02)
