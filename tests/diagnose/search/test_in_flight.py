"""A mount against the brochure: what was hidden is named with its size, a right model stays, by evidence alone."""

import re
from dataclasses import replace
from functools import partial

import msgspec
import numpy as np
import pytest

from thrustd.brochure.deck import Deck
from thrustd.cli.files import read_models
from thrustd.core.aircraft import MountPlace
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.errors import ModelError, RecordingError
from thrustd.core.measures import SIGMAS_95
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.reference import deck_says
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.aboard import Placed, with_effects
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.library import terms_in_flight
from thrustd.diagnose.search.question import Given, asked
from thrustd.diagnose.search.weigh import flown, weigh
from thrustd.installation.shipped import read_deck, shipped
from thrustd.model.artifact import EffectSpec, LedgerEntry, ModelSpec
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.mount import LOWER, UPPER, advance, at_rest

PLACE = MountPlace("left_upper", "left", 0, 0.46)
HZ, SECONDS = 1.0, 3000
MASS_KG, DRAG_M2, EXPANSION_MM_K = 171.7, 0.03, 0.002


@pytest.fixture(scope="module")
def deck() -> Deck:
    return read_deck()


@pytest.fixture(scope="module")
def spec() -> ModelSpec:
    (found,) = read_models([shipped("models/left-upper.json", "model")]).values()
    return found


def a_flight(
    deck: Deck,
    seed: int = 0,
    bias: float = 1.02,
    drag_m2: float = 0.0,
    mm_k: float = 0.0,
    couple_n_g: float = 0.0,
    lower_mm_k: float = 0.0,
    name: str = "flight",
) -> Recording:
    """Levels of thrust and speed that do not follow each other; an engine whose thrust is `bias` of its deck's."""
    rng = np.random.default_rng(seed)
    count = int(HZ * SECONDS)
    time_s = np.arange(count) / HZ

    def levels(low: float, high: float, held_s: float) -> np.ndarray:
        knots = np.arange(0.0, SECONDS + held_s, held_s)
        return np.interp(time_s, knots, rng.uniform(low, high, len(knots)))

    mach, altitude_m, n1 = levels(0.2, 0.42, 200.0), levels(1500.0, 3000.0, 500.0), levels(45.0, 88.0, 120.0)
    fuel = np.interp(n1, [40.0, 60.0, 80.0, 95.0], [0.026, 0.045, 0.082, 0.125])
    columns = {"mach": mach, "pressure_altitude_m": altitude_m, "sat_degC": 5.0 + 0 * mach}
    columns |= {"fuel_flow_kg_s_left": fuel, "accel_x_g": levels(-0.1, 0.15, 40.0), "accel_z_g": levels(0.8, 1.3, 30.0)}
    plain = {k.removesuffix("_left"): column for k, column in columns.items()}
    thrust_n = bias * deck_says(plain, time_s, deck, 0).thrust_n
    pressure_pa = np.array([dynamic_pressure_pa(*each) for each in zip(mach, altitude_m, strict=True)])
    inertia_n = MASS_KG * STANDARD_GRAVITY_M_S2 * columns["accel_x_g"]
    warm_degc = levels(20.0, 55.0, 900.0)
    upper_n = 0.46 * thrust_n - drag_m2 * pressure_pa - inertia_n
    couple_n = couple_n_g * (columns["accel_z_g"] - 1.0)
    for mount, physics, loaded_n, grows in (
        ("left_upper", UPPER, upper_n + couple_n, mm_k),
        ("left_lower", LOWER, 0.54 / 0.46 * upper_n - couple_n, lower_mm_k),
    ):
        mm = advance(physics, at_rest(physics), loaded_n, 1 / HZ, warm_degc, columns["accel_z_g"])
        columns |= {f"deformation_mm_{mount}": mm + grows * (warm_degc - 20.0), f"temperature_degC_{mount}": warm_degc}
    return make_recording(name, {"time_s": time_s, **columns})


def without_inertia(spec: ModelSpec) -> ModelSpec:
    return msgspec.structs.replace(spec, effects=[e for e in spec.effects if e.name != "axial_inertia"], witness=None)


def given(deck: Deck) -> Given:
    return Given(against="brochure", mount=PLACE, deck=deck)


def both(deck: Deck) -> Given:
    """With the engine's other mount."""
    (lower,) = read_models([shipped("models/left-lower.json", "model")]).values()
    return replace(given(deck), others=((MountPlace("left_lower", "left", 0, 0.54), lower),))


def test_a_right_model_of_an_engine_off_its_deck_stays(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck)
    report = diagnose(spec, [flight], given=given(deck))
    assert report.verdict == ("none",) and report.grade == "cannot be told"
    assert any("no proof" in line for line in report.advice)
    with pytest.raises(ModelError, match="no model written"):
        extend(spec, [flight], ["nacelle_drag"], given=given(deck))


@pytest.mark.parametrize("begins_s", [600, 1300, 2300])
def test_a_log_of_eight_minutes_begun_in_mid_flight_says_what_it_can(
    deck: Deck, spec: ModelSpec, begins_s: int
) -> None:
    short = a_flight(deck).rows(slice(int(HZ * begins_s), int(HZ * (begins_s + 480))))
    report = diagnose(spec, [short], given=given(deck))
    assert report.verdict == ("none",) and report.grade == "cannot be told"
    bare = without_inertia(spec)
    (mass,) = extend(bare, [short], ["axial_inertia"], given=given(deck)).parameters
    assert abs(mass.value - MASS_KG) < mass.half_width < MASS_KG / 2


def test_a_log_that_began_before_its_wires_spoke_and_lost_them_for_a_while(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck)
    silent = np.isin(np.arange(len(flight)), np.r_[0:150, 1400:1460, 2950:3000])
    holes = flight.with_channels(**{n: np.where(silent, np.nan, column) for n, column in flight.channels.items()})
    report = diagnose(without_inertia(spec), [holes], given=given(deck))
    assert report.verdict == ("axial_inertia",) and not any("missing" in one.reason for one in report.not_judged)


def test_what_the_rubber_remembers_is_the_benchs_to_tell(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck).rows(slice(0, 500))
    with pytest.raises(ModelError, match="creep remembers the deformation alone: a bench tells it"):
        extend(spec, [flight], ["creep"], given=given(deck))
    said = {one.effect: one.reason for one in diagnose(spec, [flight], given=given(deck)).not_judged}
    assert {"relaxation", "hysteresis", "mullins_softening"} <= set(said)


def test_drag_is_named_with_its_size_and_two_flights_say_it_better(deck: Deck, spec: ModelSpec) -> None:
    flights = [a_flight(deck, seed, drag_m2=DRAG_M2, name=f"flight {seed}") for seed in (1, 2)]
    report = diagnose(spec, flights, given=given(deck))
    assert report.verdict == ("nacelle_drag",)
    assert any("from 2 recordings; alone they say" in line for line in report.advice)
    (one,), (two,) = (extend(spec, flights[:n], ["nacelle_drag"], given=given(deck)).parameters for n in (1, 2))
    assert abs(two.value - DRAG_M2) < two.half_width < one.half_width


def test_a_sensor_that_speaks_late_is_used_and_one_with_gaps_is_not_judged(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck).rows(slice(0, 500))
    late = np.where(np.arange(500) < 4, np.nan, 10.0 + np.arange(500) % 7)
    gaps = np.where(np.arange(500) // 50 % 2 == 0, np.nan, late)
    report = diagnose(spec, [flight.with_channels(vibration_mm_s_left_upper=gaps)], given=given(deck))
    assert "channel vibration_mm_s has values missing" in {one.reason for one in report.not_judged}
    with pytest.raises(RecordingError, match="vibration_mm_s, which effect payne reads, has values missing"):
        extend(spec, [flight.with_channels(vibration_mm_s_left_upper=gaps)], ["payne"], given=given(deck))
    report = diagnose(spec, [flight.with_channels(vibration_mm_s_left_upper=late)], given=given(deck))
    assert "payne" not in {one.effect for one in report.not_judged}


def test_a_fuel_flow_with_holes_is_read_between_them_and_none_is_refused(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck)
    fuel = np.where(np.arange(len(flight)) // 300 % 5 == 2, np.nan, flight["fuel_flow_kg_s_left"])
    holes = flight.with_channels(fuel_flow_kg_s_left=fuel)
    report = diagnose(spec, [holes], given=given(deck))
    assert report.verdict == ("none",) and 0.0 < report.rmse_before_n < 60.0
    assert report.own_error_n < 300.0  # of the rows that the brochure speaks in
    with pytest.raises(RecordingError, match="against brochure needs fuel_flow_kg_s, which is not in the data"):
        diagnose(spec, [flight.with_channels(fuel_flow_kg_s_left=np.nan * fuel)], given=given(deck))


def test_a_drag_that_another_flight_contradicts_is_not_added(deck: Deck, spec: ModelSpec) -> None:
    flights = [a_flight(deck, seed, drag_m2=m2, name=f"flight {seed}") for seed, m2 in ((1, 0.06), (2, -0.01))]
    with pytest.raises(ModelError, match=r"nacelle_drag fits these flights, but a part held back .* no model written"):
        extend(spec, flights, ["nacelle_drag"], given=given(deck))
    report = diagnose(spec, flights, given=given(deck))
    assert "nacelle_drag" not in report.verdict
    assert extend(spec, flights[:1], ["nacelle_drag"], given=given(deck)).rmse_after_n < 60.0


def test_sizes_are_as_sure_as_flights_agree(deck: Deck, spec: ModelSpec) -> None:
    same, apart = (
        extend(
            spec,
            [a_flight(deck, seed, drag_m2=m2, name=f"flight {seed}") for seed, m2 in enumerate(sizes, 1)],
            ["nacelle_drag"],
            given=given(deck),
        ).parameters[0]
        for sizes in ((0.04, 0.04), (0.05, 0.03))
    )
    assert 0.03 < apart.value < 0.05 and apart.half_width > max(0.01, 2.0 * same.half_width)


def test_none_says_what_may_hide(deck: Deck, spec: ModelSpec) -> None:
    (line,) = (line for line in diagnose(spec, [a_flight(deck)], given=given(deck)).advice if "what may hide" in line)
    assert "nacelle_drag" in line and "thermal_expansion" in line and " N)" in line
    assert not re.search(r"\de[+-]", line)


def test_none_of_several_flights_says_by_how_much_they_help(deck: Deck, spec: ModelSpec) -> None:
    flights = [a_flight(deck, seed, name=f"flight {seed}") for seed in (1, 2)]
    report = diagnose(spec, flights, given=given(deck))
    assert report.verdict == ("none",)
    lines = [line for line in report.advice if "from 2 recordings; alone they say" in line]
    assert len(lines) > 1 and any(line.startswith("nacelle_drag: ") for line in lines)
    for line in lines:
        together, *alone = (float(number) for number in re.findall(r"\+- ([\d.]+)", line))
        assert len(alone) == 2 and together < 1.05 * min(alone), line


@pytest.mark.parametrize("own", ["estimate_thrust_n_left", "estimate_mount_n_left", "mount_force_n_left_upper"])
def test_an_estimate_made_with_this_mount_is_no_reference(deck: Deck, spec: ModelSpec, own: str) -> None:
    flight = a_flight(deck).with_channels(**{own: np.full(len(a_flight(deck)), 1000.0)})
    asked = replace(given(deck), against=own)
    for verb in (diagnose, partial(extend, effects=["nacelle_drag"])):
        with pytest.raises(RecordingError, match=f"{own} is made with the mounts themselves .*; expected another"):
            verb(spec, [flight], given=asked)


def test_an_effect_that_the_model_has_gets_another_size(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck, mm_k=EXPANSION_MM_K)
    report = extend(spec, [flight], ["thermal_expansion"], given=given(deck))
    assert [e.name for e in report.spec.effects] == [e.name for e in spec.effects]
    (number,) = report.parameters
    there = EXPANSION_MM_K + UPPER.expansion_mm_k
    assert abs(number.value - there) < max(number.half_width, 3e-4)
    assert report.spec.posterior == spec.posterior and report.spec.input_curve == spec.input_curve
    assert report.rmse_after_n < report.rmse_before_n
    assert report.spec.ledger[-1].added == "thermal_expansion"


def test_the_couple_of_the_weight_is_a_law_beside_the_stiffening_that_the_model_has(
    deck: Deck, spec: ModelSpec
) -> None:
    flight = a_flight(deck, couple_n_g=-1420.0)
    report = diagnose(spec, [flight], given=given(deck))
    assert report.verdict == ("engine_weight",) and report.candidates[0].name == "engine_weight_couple"
    longer = extend(spec, [flight], ["engine_weight"], given=given(deck))
    assert longer.rmse_after_n < 0.3 * longer.rmse_before_n


def test_sources_are_white_when_all_is_well(deck: Deck, spec: ModelSpec) -> None:
    seen = flown(spec, asked(spec, [a_flight(deck)], given(deck)), given(deck))
    nothing = weigh(seen, ())
    assert nothing.squares / nothing.rows < 2.0


@pytest.mark.parametrize("appetite", [-0.02, 0.02])  # 0.048 sqrt(2 - 2 exp(-0.06 / 0.6)): as recorded flights have it
def test_an_engine_that_burns_more_the_faster_it_flies_is_no_drag(deck: Deck, spec: ModelSpec, appetite: float) -> None:
    flight = a_flight(deck)
    speed = (flight["mach"] - np.mean(flight["mach"])) / np.std(flight["mach"])
    flight = flight.with_channels(fuel_flow_kg_s_left=flight["fuel_flow_kg_s_left"] * (1.0 + appetite * speed))
    question = asked(spec, [flight], given(deck))
    seen = flown(spec, question, given(deck))
    (term,) = terms_in_flight(spec, [effect_named("nacelle_drag")], question.rig)
    found = weigh(seen, (Placed(term),))
    assert abs(found.numbers[0]) < SIGMAS_95 * found.std[0]


def test_an_effect_replaces_what_is_there_or_is_appended(spec: ModelSpec) -> None:
    known, new = EffectSpec("axial_inertia", {"mass_kg": 5.0}), EffectSpec("nacelle_drag", {"drag_area_m2": 0.02})
    found = with_effects(spec, [known, new])
    sizes = {effect.name: effect.parameters for effect in found.effects}
    assert len(found.effects) == len(spec.effects) + 1
    assert sizes["axial_inertia"]["mass_kg"] == 5.0 and sizes["nacelle_drag"]["drag_area_m2"] == pytest.approx(0.02)
    assert msgspec.json.encode(found)


def test_what_one_mount_hides_the_other_one_tells(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck, mm_k=-0.0007)
    assert diagnose(spec, [flight], given=given(deck)).verdict == ("none",)
    report = diagnose(spec, [flight], given=both(deck))
    assert report.verdict == ("thermal_expansion",)
    assert any("left_lower does not show it" in one.evidence for one in report.candidates)
    (number,) = extend(spec, [flight], ["thermal_expansion"], given=both(deck)).parameters
    assert abs(number.value - (UPPER.expansion_mm_k - 0.0007)) < number.half_width < 0.0004


def test_what_the_other_mount_hides_is_not_looked_for_in_this_one(deck: Deck, spec: ModelSpec) -> None:
    report = diagnose(spec, [a_flight(deck, lower_mm_k=-0.001)], given=both(deck))
    assert report.verdict == ("none",)
    assert any("left_lower is not as its model says, alone: thermal_expansion" in line for line in report.advice)


def test_a_drag_that_both_mounts_carry_is_no_less_there(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck, 1, drag_m2=DRAG_M2)
    report = diagnose(spec, [flight], given=both(deck))
    assert report.verdict == ("nacelle_drag",)
    assert any("left_lower shows it too" in one.evidence for one in report.candidates)
    (one,) = extend(spec, [flight], ["nacelle_drag"], given=both(deck)).parameters
    assert abs(one.value - DRAG_M2) < one.half_width


def test_a_model_is_judged_as_it_flies_and_written_as_its_bench_left_it(deck: Deck, spec: ModelSpec) -> None:
    """Else what a calibration has found is found again, in the mount that is judged alone."""
    flight = a_flight(deck, 1, drag_m2=DRAG_M2)
    known = both(deck)
    assert known.mount is not None
    (lower, other), drag_m2 = known.others[0], {PLACE: DRAG_M2, known.others[0][0]: 0.54 / 0.46 * DRAG_M2}
    known = replace(
        known,
        mount=PLACE._replace(drag_m2=drag_m2[PLACE]),
        others=((lower._replace(drag_m2=drag_m2[lower]), other),),
    )
    assert diagnose(spec, [flight], given=known).verdict == ("none",)
    bare = without_inertia(spec)
    longer = extend(bare, [flight], ["axial_inertia"], given=known)
    assert abs(longer.parameters[0].value - MASS_KG) < longer.parameters[0].half_width
    assert "nacelle_drag" not in [effect.name for effect in longer.spec.effects]


def test_compare_takes_a_model_as_it_flies_and_no_brochure_for_a_load_cell(deck: Deck, spec: ModelSpec) -> None:
    promised = msgspec.structs.replace(spec, ledger=[LedgerEntry("creep", 50.0, 1.0, "measured", "")])
    places, flight = (PLACE, PLACE._replace(drag_m2=DRAG_M2)), a_flight(deck, 1, drag_m2=DRAG_M2)
    plain, flown_n = (
        compare({"left": promised}, [flight], against="brochure", mount=place, deck=deck) for place in places
    )
    assert flown_n.comparisons[0].rmse_n < 0.5 * plain.comparisons[0].rmse_n
    assert not any("contradicts" in line for line in plain.remarks)
    assert any("diagnose --against brochure" in line for line in plain.remarks)


def test_a_log_that_was_silent_at_its_end_has_the_other_mount_too(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck).rows(slice(600, 1200))
    late = {n: np.where(np.arange(600) < 560, flight[n], np.nan) for n in flight.channels if n.startswith("deform")}
    question = asked(spec, [flight.with_channels(**late)], both(deck))
    mounts = flown(spec, question, both(deck)).mounts
    assert [one.place.mount for one in mounts] == ["left_upper", "left_lower"]
    for one in mounts:
        read_mm = flight[f"deformation_mm_{one.place.mount}"][:560]
        np.testing.assert_array_equal(one.segments[0].inputs["deformation_mm"][:560], read_mm)


def test_a_log_without_the_other_mount_is_judged_by_the_brochure_alone(deck: Deck, spec: ModelSpec) -> None:
    flight = a_flight(deck)
    alone = make_recording(
        "flight", {"time_s": flight.time_s} | {n: c for n, c in flight.channels.items() if "lower" not in n}
    )
    assert diagnose(spec, [alone], given=both(deck)).to_json() == diagnose(spec, [alone], given=given(deck)).to_json()
