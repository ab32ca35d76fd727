"""Thermal effects by another temperature: the same law, another column, and no law that reads none."""

import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.core.errors import ModelError
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.extend.variants import variants
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.model.effects import effect_named
from thrustd.records.recording import make_recording


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


def test_it_may_be_in_proportion_to_a_channel() -> None:
    law = effect_named("thermal_expansion at sat_degC by mach")
    assert law.channels == ("mach", "sat_degC")


def test_friction_has_no_temperature() -> None:
    with pytest.raises(ModelError, match="reads no temperature_degC"):
        effect_named("hysteresis at sat_degC")


def test_a_rod_in_the_open_air_is_found_and_added() -> None:
    """Its temperature is not the mount's, and follows nothing that the mount's does."""
    quiet = record()
    t = quiet["time_s"]
    sat = 10.0 - 25.0 * np.clip((t - 300.0) / 200.0, 0.0, 1.0)
    told = {"sat_degC": sat, "deformation_mm": quiet["deformation_mm"] + 0.001 * (sat - 10.0)}
    measured = make_recording("air", {"time_s": t, **quiet.channels, **told})
    report = diagnose(mount(), [measured])
    assert report.verdict == ("thermal_expansion",) and report.candidates[0].name.endswith(" at sat_degC")
    better = extend(mount(), [measured], report.verdict)
    assert [effect.name for effect in better.spec.effects] == [report.candidates[0].name]
    assert better.rmse_after_n < 0.5 * better.rmse_before_n
