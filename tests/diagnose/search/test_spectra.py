"""What is many of a kind is one line."""

from thrustd.diagnose.extend.effect_card import card_text, parameters_of
from thrustd.diagnose.search.spectra import folded, together
from thrustd.diagnose.search.told import ParameterEstimate, sentences
from thrustd.model.effects import effect_named
from thrustd.model.free_curve import KNOTS


def test_only_many_of_a_kind_are_one():
    stops = [f"friction_{i:02d}_n" for i in range(1, 9)]
    assert together(["travel_mm", *stops, "stiffness_1_k"]) == [["travel_mm"], stops, ["stiffness_1_k"]]
    assert together(stops[:3]) == [[name] for name in stops[:3]]


def test_a_spectrum_is_told_in_one_line_whatever_stands_before_it():
    found = [ParameterEstimate("hysteresis", "growth", 0.5, 0.1, "", "")]
    found += [ParameterEstimate("hysteresis", f"friction_{i:02d}_n", float(i), 0.1, "N", "") for i in range(1, 9)]
    first, many = sentences(found)
    assert first.startswith("hysteresis: growth = 0.5")
    assert many == "hysteresis: 8 elements of 1 to 8 N, 36 N together"


def test_a_model_tells_places_and_heights_of_a_curve():
    numbers = {f"at_{i:02d}": 80.0 + i for i in range(KNOTS)} | {f"height_{i:02d}": -10.0 * i for i in range(KNOTS)}
    assert folded("curve of oil_bar", numbers) == {
        "at_..": "16 places of 80 to 95",
        "height_..": "16 heights of -150 to 0",
    }


def test_the_card_of_an_effect_has_one_line_for_what_is_many():
    names = {name: [p.name for p in parameters_of(effect_named(name))] for name in ("curve of x", "hysteresis_stops")}
    assert names == {"curve of x": ["at_..", "height_.."], "hysteresis_stops": ["travel_mm", "growth", "friction_.._n"]}
    assert "26 of them: force of the element that slips after 0.00013 to 0.7 of the" in card_text(
        effect_named("hysteresis_stops")
    )
