"""Thermal effects by another temperature: the same law, another column, and no law that reads none."""

import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.core.errors import ModelError
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.extend.variants import variants
from thrustd.diagnose.search.candidates import by_other_temperatures
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.question import Given
from thrustd.model.effects import effect_named, laws_like
from thrustd.records.recording import Recording, make_recording


def test_the_same_law_reads_another_column() -> None:
    own, other = (effect_named(f"thermal_expansion{at}") for at in ("", " at sat_degC"))
    degc = np.linspace(20.0, 60.0, 9)
    law = {"expansion_mm_k": 0.01, "reference_degc": 20.0}
    moved = [one.stage(law, 0.05).from_rest({one.channels[0]: degc}, np.ones(9)) for one in (own, other)]
    assert np.array_equal(*moved) and np.ptp(moved[0]) > 0.3
    assert (other.word, other.channels) == ("thermal_expansion", ("sat_degC",))


def test_laws_that_go_by_its_word_all_read_it() -> None:
    laws = variants(effect_named("thermal_stiffness at sat_degC"))
    assert len(laws) == len(variants(effect_named("thermal_stiffness"))) > 1
    assert all("sat_degC" in law.channels and "temperature_degC" not in law.channels for law in laws)
    assert {law.word for law in laws} == {"thermal_stiffness"}


def test_a_law_of_its_word_that_reads_no_temperature_is_the_same_by_any() -> None:
    """`ageing at sat_degC` was the simpler law beside an Arrhenius one: diagnosed, and nobody could add it."""
    laws = laws_like(effect_named("ageing_arrhenius at sat_degC"))
    assert effect_named("ageing") in laws and effect_named("ageing_arrhenius at sat_degC") in laws
    assert [effect_named(law.name) for law in laws] == laws


def test_it_may_be_in_proportion_to_a_channel() -> None:
    law = effect_named("thermal_expansion at sat_degC by mach")
    assert law.channels == ("mach", "sat_degC")


def test_friction_has_no_temperature() -> None:
    with pytest.raises(ModelError, match="reads no temperature_degC"):
        effect_named("hysteresis at sat_degC")


def _in_the_open_air(**more: np.ndarray) -> Recording:
    """A rod whose temperature is not the mount's, and follows nothing that the mount's does."""
    quiet = record()
    t = quiet["time_s"]
    sat = 10.0 - 25.0 * np.clip((t - 300.0) / 200.0, 0.0, 1.0)
    told = {"sat_degC": sat, "deformation_mm": quiet["deformation_mm"] + 0.001 * (sat - 10.0)} | more
    return make_recording("air", {"time_s": t, **quiet.channels, **told})


def test_a_rod_in_the_open_air_is_found_and_added() -> None:
    measured = _in_the_open_air()
    report = diagnose(mount(), [measured])
    assert report.verdict == ("thermal_expansion",) and report.candidates[0].name.endswith(" at sat_degC")
    better = extend(mount(), [measured], report.verdict)
    assert [effect.name for effect in better.spec.effects] == [report.candidates[0].name]
    assert better.rmse_after_n < 0.5 * better.rmse_before_n


def test_it_needs_no_temperature_of_the_mount() -> None:
    measured = _in_the_open_air()
    told = {name: measured[name] for name in ("time_s", *measured.channels) if name != "temperature_degC"}
    bare = make_recording("air", told)
    better = extend(mount(), [bare], ["thermal_expansion"])
    assert better.spec.effects[0].name.endswith(" at sat_degC")
    assert not any("thermal_expansion" in line for line in diagnose(mount(), [bare]).advice)


def test_what_has_to_fly_reads_the_mounts_own() -> None:
    measured = _in_the_open_air(temperature_degC=_in_the_open_air()["sat_degC"] + 3.0)
    better = extend(mount(), [measured], ["thermal_expansion"], given=Given(flies=True))
    assert not any(" at " in effect.name for effect in better.spec.effects)


def test_a_column_that_says_the_same_is_not_another_temperature() -> None:
    same = _in_the_open_air()["temperature_degC"]
    measured = _in_the_open_air(copy_degC=same, chamber_degC=same + 2.0)
    assert {law.channels for law in by_other_temperatures(variants(effect_named("thermal_expansion")), [measured])} == {
        ("sat_degC",)
    }


@pytest.mark.parametrize("column", ["mach", "", '"sat_degC"', "oil by pump_degC"])
def test_only_a_temperature_stands_there(column: str) -> None:
    with pytest.raises(ModelError):
        effect_named(f"thermal_expansion at {column}")


def test_the_mounts_own_is_the_law_itself() -> None:
    assert effect_named("thermal_expansion at temperature_degC") is effect_named("thermal_expansion")


def test_a_column_of_any_name_does_not_stop_the_search() -> None:
    odd = {name: record()["cabin_psi"] for name in ("oil by pump_degC", "air at inlet", "gas at hot_degC")}
    measured = record().with_channels(**odd)
    assert diagnose(mount(), [measured]).verdict == ("none",)
    with pytest.raises(ModelError, match="held-back"):
        extend(mount(), [measured], ['k * "air at inlet"'])


def test_two_laws_of_one_word_are_both_tried() -> None:
    measured = _in_the_open_air(oil_degC=40.0 + np.sin(record()["time_s"] / 90.0))
    asked = ["thermal_expansion at oil_degC", "thermal_expansion at sat_degC"]
    for order in (asked, asked[::-1]):
        better = extend(mount(), [measured], order)
        assert [effect.name.partition(" at ")[2] for effect in better.spec.effects] == ["sat_degC"]
