"""A real flight with the brochure as its reference; only the mount is simulated. Left out where the data are not."""

from pathlib import Path

import numpy as np
import pytest

from thrustd.brochure.deck import Deck
from thrustd.cli.files import read_models
from thrustd.core.aircraft import MountPlace
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.reference import as_mount, with_reference
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.question import Given
from thrustd.identify.regression.friction import GROWS
from thrustd.installation.shipped import read_deck
from thrustd.model.effects import effect_named
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.twin.mount import UPPER, advance, at_rest

ROOT = Path(__file__).parents[3]
FLIGHT = ROOT.parent / "shared" / "data" / "ph_lab" / "ftis_20180312_ref.npz"
PLACE = MountPlace("right_upper", "right", 1, 0.46)
CARRIED_KG = 0.46 * 373.0


@pytest.fixture(scope="module")
def deck() -> Deck:
    return read_deck(ROOT / "models" / "brochure" / "jt15d-4.json")


@pytest.fixture(scope="module")
def flight(deck: Deck) -> Recording:
    """Half an hour in the air; each mount carries 46 % of the brochure thrust less what accelerates the engine."""
    if not FLIGHT.exists():
        pytest.skip("the recorded flight is not beside the repository")
    whole = read_recording(FLIGHT)
    record = whole.window(whole.time_s[0] + 1500.0, whole.time_s[0] + 3300.0)
    stand_in = record.with_channels(deformation_mm_right_upper=np.zeros(len(record)))
    share_n = with_reference(as_mount(stand_in, PLACE), "brochure", PLACE, deck)
    carried_n = share_n["force_N"] - CARRIED_KG * STANDARD_GRAVITY_M_S2 * record["accel_x_g"]
    mm = advance(UPPER, at_rest(UPPER), np.ascontiguousarray(carried_n), 1 / record.sample_hz)
    return record.with_channels(deformation_mm_right_upper=mm)


def test_compare_and_diagnose_against_the_brochure(flight: Recording, deck: Deck) -> None:
    (spec,) = read_models([ROOT / "models" / "right-upper.json"]).values()
    found = compare({"right": spec}, [flight], against="brochure", mount=PLACE, deck=deck)
    assert 0 < found.comparisons[0].rmse_n < 500.0
    report = diagnose(spec, [flight], given=Given(against="brochure", mount=PLACE, deck=deck))
    assert report.rmse_after_n <= report.rmse_before_n
    assert report.verdict == ("none",) and report.grade == "cannot be told"  # a deck's own errors hide as much
    present = {effect_named(effect.name).word for effect in spec.effects if effect.name not in GROWS}
    assert "axial_inertia" in present
    assert report.candidates
    assert not present & {candidate.effect for candidate in report.candidates}  # what is there is not offered again
