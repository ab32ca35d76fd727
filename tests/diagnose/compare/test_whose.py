"""What is said of PH-LAB's mounts stands beside records of such mounts only; what is said of a model is true of it."""

import numpy as np
from msgspec.structs import replace
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, inertia, mount, record
from thrustd.core.measures import usual_load
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.question import Given
from thrustd.diagnose.search.rig import RigPriors
from thrustd.diagnose.search.told import ParameterEstimate
from thrustd.model.artifact import EffectSpec, LinearBlock, ValidRange
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording
from thrustd.records.shown import as_text

TIMES = 15.0  # as strong as a mount of PH-LAB's: 80 kN


def strong():
    """A mount of 80 kN, and a record of it with hidden inertia; the columns have our names."""
    spec = replace(
        mount(k1=5000.0 * TIMES, k3=1000.0 * TIMES, own_n=NOISE_N * TIMES),
        valid=ValidRange((0.0, 1.3), (0.0, 6500.0 * TIMES)),
    )
    data = record()
    hidden = replace(spec, effects=[inertia(900.0)])
    model = compile_model(hidden, 1 / DT_S)
    force_n = model.simulate(model.inputs({"time_s": data.time_s, **data.channels}))
    force_n += TIMES * np.random.default_rng(7).normal(0, NOISE_N, len(data))
    return spec, data.with_channels(force_N=force_n)


def test_somebody_elses_80_kn_has_no_figures_of_ph_lab():
    spec, data = strong()
    report = compare({"mount": spec}, [data])
    assert report.comparisons[0].mae_pct_above_2kn is None
    assert "2 kN" not in as_text(report.print).split("Where")[0]
    said = as_text(diagnose(spec, [data]).print)
    assert "axial_inertia" in said and "PH-LAB" not in said


def test_a_mount_of_ph_lab_has_them():
    data = record([inertia(150.0)])
    report = compare({"mount": mount()}, [data])
    assert report.comparisons[0].mae_pct_above_2kn > 0
    assert "expected on PH-LAB" in as_text(diagnose(mount(), [data]).print)


def test_another_rig_is_another_rig():
    other = Given(rig=RigPriors(name="somebody else's"))
    assert "PH-LAB" not in as_text(diagnose(mount(), [record([inertia(150.0)])], given=other).print)


def test_a_record_at_low_load_is_told_by_the_range_of_its_model():
    assert usual_load(np.full(10, 300.0), 0.0, 6500.0)
    assert not usual_load(np.full(10, 80_000.0))
    assert not usual_load(np.full(10, 300.0), 0.0, 111_000.0)


def relaxing():
    """A model that is elastic alone, and a record of rubber that relaxes with three time constants."""
    step_s, time_s, rng = 0.2, np.arange(0.0, 400.0, 0.2), np.random.default_rng(2)
    mm = np.interp(time_s % 40.0, [0, 5, 18, 23, 40], [0, 1, 1, 0, 0]) * np.repeat(rng.uniform(0.5, 1.2, 10), 200)
    branches = [lfilter([g, -g], [1.0, -np.exp(-step_s / tau)], mm) for g, tau in ((6e3, 1.0), (4e3, 8.0), (5e3, 60.0))]
    force_n = 10e3 * mm + 2e3 * mm**3 + sum(branches) + np.random.default_rng(1).normal(0, 5, len(mm))
    elastic = replace(mount(k1=15e3, k3=2e3, own_n=2000.0), linear=LinearBlock(1.0, []))
    return elastic, make_recording("record", {"time_s": time_s, "deformation_mm": mm, "force_N": force_n})


def test_a_model_that_was_just_extended_is_not_said_to_take_no_effect():
    spec, data = relaxing()
    wider = extend(spec, [data], ["relaxation"], name="wider").spec
    advice = " ".join(diagnose(wider, [data]).advice)
    assert "the model as it is leaves" in advice and "is added when it leaves less" in advice
    assert "none can be added" not in advice and "of another kind" not in advice


def test_a_spectrum_is_one_entry_of_a_table_and_not_its_first_element():
    spec, data = relaxing()
    said = as_text(diagnose(spec, [data]).print)
    rows = [line for line in said.splitlines() if line.startswith("│ relaxation")]
    assert rows and "elements of" in " ".join(rows)


def test_a_negative_gap_says_what_it_is():
    gap = ParameterEstimate("free_play", "gap_mm", -0.02, 0.001, "mm", "", negative="lost motion of the LVDT")
    assert gap.sentence.endswith("(95 %); negative: lost motion of the LVDT")
    assert gap.interval.endswith("mm (negative: lost motion of the LVDT)")
    assert gap.to_json()["negative"] == "lost motion of the LVDT"


def test_lost_motion_is_said_where_it_is_found():
    data = record([EffectSpec("free_play", {"gap_mm": -0.03, "travel_mm": 0.01})])
    (gap,) = [p for p in extend(mount(), [data], ["free_play"], name="wider").parameters if p.name == "gap_mm"]
    assert gap.value < 0.0
    assert "negative: lost motion of the LVDT" in gap.sentence
