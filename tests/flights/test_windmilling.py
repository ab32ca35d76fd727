"""An engine that is shut down in flight windmills: its thrust is below nothing, and inside the band."""

import dataclasses

import numpy as np
import pytest

from benchmarks.fusion_flights import follow
from tests.conftest import ROOT
from thrustd.brochure.windmilling import assumed
from thrustd.core.aircraft import DATA, Windmilling
from thrustd.core.types import Estimate, Status
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import read_deck
from thrustd.twin.engine import windmilling_n
from thrustd.twin.flight import Truth, fly, scripted_flight

CUT_S, SECONDS, SEED = 200.0, 260.0, 22


def undescribed(place):
    """The same aircraft, whose file has no [windmilling]."""
    name = place.config.aircraft.data or DATA
    before, _, after = place.files[name].decode().partition("[windmilling]")
    return dataclasses.replace(place, files={**place.files, name: (before + after[after.index("[wing]") :]).encode()})


@pytest.fixture(scope="module", params=[(3.0, True), (14.0, True), (14.0, False)])
def estimates(request):
    """Of the left engine, by time: (seconds, estimate, truth); N1 ends at so many per cent, its file says what then."""
    n1_pct, described = request.param
    profile, airframe = scripted_flight(SECONDS, SEED)
    time_s, n1 = profile.time_s, profile["n1_pct_left"]
    cut = np.clip(time_s - CUT_S, 0.0, None)
    fades = np.where(cut > 0.0, np.exp(-cut / 5.0), 1.0)
    air = profile["mach"], profile["pressure_altitude_m"]
    drag_n = windmilling_n(*air)
    stopped = profile.with_channels(
        n1_pct_left=n1_pct + (n1 - n1_pct) * fades,
        n2_pct_left=profile["n2_pct_left"] * fades,
        fuel_flow_kg_s_left=np.where(cut > 0.0, 0.0, profile["fuel_flow_kg_s_left"]),
        thrust_N_left=np.where(
            cut > 0.0, drag_n + (profile["thrust_N_left"] - drag_n) * fades**2, profile["thrust_N_left"]
        ),
    )
    place = read_installation(ROOT / "deploy" / "hil.toml")
    place = place if described else undescribed(place)
    items = list(fly(stopped, airframe, place.parts().can_table, SEED))
    truths = [item for item in items if isinstance(item, Truth) and item.name == "left"]
    outputs = follow(place.pipeline(), (item for item in items if not isinstance(item, Truth)))
    found = [one for one in outputs if isinstance(one, Estimate) and one.engine == 0]
    at = np.searchsorted([item.t_ns for item in truths], [one.t_ns for one in found], "right") - 1
    return [(one.t_ns * 1e-9, one, truths[max(i, 0)].value_n) for one, i in zip(found, at.tolist(), strict=True)]


def test_its_drag_is_told_by_the_brochure_and_inside_the_band(estimates):
    late = [(one, truth) for t_s, one, truth in estimates if t_s > CUT_S + 40.0]
    assert len(late) > 100 and all(truth < -100.0 for _, truth in late)
    assert all(Status.ENGINE_OFF & one.status and one.thrust_n < -50.0 for one, _ in late)
    assert all(abs(one.thrust_n - truth) < 1.96 * one.thrust_std_n < 500.0 for one, truth in late)


def test_on_the_ground_an_engine_that_is_off_has_no_thrust(estimates):
    first = [one for t_s, one, _ in estimates if 5.0 < t_s < 10.0]
    assert all(abs(one.thrust_n) < 0.1 and one.thrust_std_n < 15.0 for one in first if Status.ENGINE_OFF & one.status)
    assert any(Status.ENGINE_OFF & one.status for one in first)


def test_the_formula_gives_half_of_the_dynamic_pressure_at_most():
    """What flows through the nozzles at half the speed loses most: 2 r (1 - r) is 1/2 there."""
    assert Windmilling(nozzles_m2=1.0, speed_ratio=0.5, std=0.0).area_m2 == 0.5
    assert Windmilling(nozzles_m2=0.14, speed_ratio=0.8, std=0.4).area_m2 == pytest.approx(0.0448)


def test_engines_that_nobody_described_are_as_large_as_their_deck_and_less_sure():
    """By hand: 11.8 kN over 80 kPa are 0.148 m2; 30 and 40 % together are 50 %."""
    of_deck = assumed(read_deck().data.thrust)
    assert of_deck.nozzles_m2 == pytest.approx(0.148, abs=5e-4) and of_deck.std == 0.5
    assert of_deck.area_m2 == pytest.approx(0.0473, abs=2e-4)
