"""An effect in no library may be imitated by several that are: the one channel that explains it all gives it away."""

import numpy as np
import pytest
from msgspec.structs import replace

from tests.diagnose.scene import DT_S, NOISE_N, mount, record
from thrustd.core.errors import ModelError, RecordingError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.candidates import combined
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.model.artifact import ComplexMode, EffectSpec, LinearBlock
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named
from thrustd.model.free_curve import nameable


@pytest.fixture(scope="module")
def incidence_deg():
    """A column thrustd does not know, for the greater part the load factor."""
    data = record()
    t = np.arange(len(data)) * DT_S
    own = sum(np.sin(2 * np.pi * t / period_s + phase) for period_s, phase in ((53.0, 1.0), (31.0, 2.0), (17.0, 4.0)))
    return 10.0 * (data["accel_z_g"] - 1.0) + 0.25 * own


def test_one_unknown_channel_is_not_the_sum_of_two_known_effects(incidence_deg):
    """Engine weight and sensor scale take most of it and leave a trace of the channel, which alone leaves nothing."""
    stiffer_n_mm = 100.0 * np.tanh((incidence_deg - 1.0) / 2.0)
    hidden = record(added=lambda columns: stiffer_n_mm * columns["deformation_mm"])
    report = diagnose(mount(), [hidden.with_channels(incidence_deg=incidence_deg)])
    assert report.verdict == ("unknown",)
    assert report.depends_on[0].channel == "incidence_deg"
    assert report.depends_on[0].rmse_after_n < 1.15 * NOISE_N


def test_a_bump_over_a_tenth_of_a_channels_way_is_along_that_channel(incidence_deg):
    """A stranger's resonance at one N1: six knots followed N1 times N2 as well as N1."""
    other = incidence_deg + 2.0 * np.sin(np.arange(len(incidence_deg)) * DT_S / 29.0)
    bump_n = 150.0 / (1.0 + ((incidence_deg - 0.4) / 0.25) ** 2)
    hidden = record(added=lambda columns: bump_n).with_channels(incidence_deg=incidence_deg, trim_deg=other)
    report = diagnose(mount(), [hidden])
    assert report.verdict == ("unknown",)
    assert report.depends_on[0].channel == "incidence_deg"
    assert report.depends_on[0].rmse_after_n < 1.25 * NOISE_N


@pytest.mark.parametrize(
    "hidden, kind",
    [
        (lambda columns, q: 150.0 / (1.0 + ((q - 0.4) / 0.5) ** 2), "curve of"),
        (lambda columns, q: 100.0 * np.tanh((q - 1.0) / 2.0) * columns["deformation_mm"], "gain curve of"),
    ],
)
def test_what_has_no_law_is_added_as_its_free_curve_and_holds_on_another_record(incidence_deg, hidden, kind):
    def made(seed):
        data = record(seed=seed, added=lambda columns: hidden(columns, incidence_deg))
        return data.with_channels(incidence_deg=incidence_deg)

    report = diagnose(mount(), [made(0)])
    assert report.verdict == ("unknown",) and report.depends_on[0].name == "curve of incidence_deg"
    extended = extend(mount(), [made(0)], [report.depends_on[0].name])
    assert extended.spec.effects[-1].name == f"{kind} incidence_deg"
    (found,) = compare({"better": extended.spec}, [made(1)]).comparisons
    assert found.rmse_n < 1.1 * NOISE_N
    assert diagnose(extended.spec, [made(1)]).verdict == ("none",)


def test_a_force_along_a_channel_is_no_bias_of_a_reading(incidence_deg):
    """The same at every load: as a bias it would go with the slope of the spring."""
    hidden = record(added=lambda columns: 150.0 * np.tanh(incidence_deg / 2.0))
    report = diagnose(mount(k3=3000.0), [_stiffer(hidden).with_channels(incidence_deg=incidence_deg)])
    assert report.verdict == ("unknown",)
    assert report.depends_on[0].channel == "incidence_deg"
    assert report.depends_on[0].rmse_after_n < 1.05 * NOISE_N


def _stiffer(hidden):
    """The same on a spring that hardens more."""
    plain, more = (compile_model(mount(k3=k3), 1 / DT_S) for k3 in (1000.0, 3000.0))
    change = [model.simulate(model.inputs(hidden.channels)) for model in (more, plain)]
    return hidden.with_channels(force_N=hidden["force_N"] + change[0] - change[1])


def test_two_known_effects_are_not_one_unknown_channel(incidence_deg):
    hidden = record(added=lambda c: (100.0 * (c["accel_z_g"] - 1.0) - 60.0) * c["deformation_mm"]).with_channels(
        incidence_deg=incidence_deg
    )
    verdict = diagnose(mount(), [hidden]).verdict
    assert "engine_weight" in verdict
    assert "unknown" not in verdict


def test_a_damper_whose_strength_follows_a_channel_is_named_and_added():
    numbers = {"damping_n_s_mm": 800.0, "filter_s": 0.1, "absent_at": 13.2, "full_at": 14.8}
    measured = record([EffectSpec("viscous_damping by cabin_psi", numbers)])
    verdict = diagnose(mount(), [measured]).verdict
    assert "viscous_damping by cabin_psi" in verdict
    report = extend(mount(), [measured], verdict)
    assert report.rmse_after_n < 1.1 * NOISE_N
    assert compile_model(report.spec, 1 / DT_S).channels.count("cabin_psi") == 1


def test_a_channel_that_acts_late_is_told_with_its_lateness():
    """The current of a coil follows its voltage: a law in proportion to the voltage as it is leaves half of it."""
    data = record()
    t = np.arange(len(data)) * DT_S
    steps = np.random.default_rng(8).uniform(0.0, 2.0, 200)[(t / 30.0).astype(int)]
    numbers = {"damping_n_s_mm": 800.0, "filter_s": 0.1, "full_at": 2.0, "channel_late_s": 6.0}
    effect = effect_named("viscous_damping by voltage_V")
    late = effect.stage(effect.neutral() | numbers, DT_S)
    columns = {"deformation_mm": data["deformation_mm"], "voltage_V": steps}
    data = data.with_channels(force_N=late.from_rest(columns, data["force_N"]), voltage_V=steps)
    report = extend(mount(), [data], ["viscous_damping by voltage_V"])
    assert report.rmse_after_n < 1.05 * NOISE_N
    assert report.spec.effects[-1].parameters["channel_late_s"] == pytest.approx(6.0, rel=0.15)


def _with_a_spool():
    """A record, its time (s), and a spool that follows the load, nearly."""
    data = record()
    t = np.arange(len(data)) * DT_S
    return data, t, 30.0 + 60.0 * np.sqrt(data["deformation_mm"] / 1.1) + 0.5 * np.sin(2 * np.pi * t / 47.0)


def test_a_large_bias_that_follows_two_channels_is_not_free_play():
    """Both spools follow the load, and so nearly does their difference: only a curve fitted whole tells them apart."""
    data, t, n1_pct = _with_a_spool()
    n2_pct = 50.0 + 45.0 * np.sqrt(data["deformation_mm"] / 1.1) + 0.8 * np.sin(2 * np.pi * t / 29.0)
    reading = data["deformation_mm"] + 0.03 * np.tanh((n2_pct - n1_pct - 12.0) / 4.0)
    report = diagnose(mount(), [data.with_channels(deformation_mm=reading, n1_pct=n1_pct, n2_pct=n2_pct)])
    assert report.verdict == ("unknown",)
    assert report.depends_on[0].channel == "n2_pct - n1_pct"
    assert report.depends_on[0].rmse_after_n < 1.1 * NOISE_N


@pytest.mark.parametrize("column", ["oil by pass_bar", "both\"' - kinds"])
def test_a_column_of_any_name_is_added_or_left_alone(incidence_deg, column):
    data = record(n=6000, added=lambda columns: 150.0 * np.tanh(incidence_deg[:6000] / 2.0))
    data = data.with_channels(**{column: incidence_deg[:6000]})
    followed = diagnose(mount(), [data]).depends_on
    assert bool(followed) is nameable(column)
    if followed:
        assert extend(mount(), [data], [followed[0].name]).rmse_after_n < 1.1 * NOISE_N


@pytest.mark.parametrize(
    ("channel", "why"),
    [
        ("force_N", "what is to be explained"),
        ("deformation_mm", "what the model's own curve reads"),
        ("time_s", "says when, which no other record repeats"),
        ("estimate_thrust_n", "thrustd's own output"),
    ],
)
@pytest.mark.parametrize("asked", ["curve of {}", "gain curve of mach - {}", "bias curve of {} * mach"])
def test_what_explains_nothing_is_no_curves_channel(channel, why, asked):
    data = record(n=6000).with_channels(mach=np.linspace(0.2, 0.5, 6000), estimate_thrust_n=np.linspace(0.0, 5.0, 6000))
    with pytest.raises(RecordingError, match=f"measured: effect curve of .*{channel} .*{why}; expected another column"):
        extend(mount(), [data], [asked.format(channel)])
    assert channel not in str(combined(data.channels))  # nor does diagnose offer it


def test_the_force_explains_no_force():
    with pytest.raises(RecordingError, match="force_N is what is to be explained"):
        extend(mount(), [record(n=6000)], ["k * force_N"])


def test_of_a_curve_that_was_asked_for_diagnose_says_why_it_is_not_judged():
    report = diagnose(mount(), [record(n=6000)], extra=[effect_named("curve of time_s")])
    assert ("curve of time_s", "time_s says when, which no other record repeats") in [
        (one.effect, one.reason) for one in report.not_judged
    ]


def test_channels_that_say_the_same_are_all_listed_the_simplest_first():
    data, t, n1_pct = _with_a_spool()
    n2_pct = 60.0 + 0.6 * n1_pct + 0.02 * np.sin(2 * np.pi * t / 29.0)
    reading = data["deformation_mm"] + 0.03 * np.tanh((n2_pct - n1_pct - 28.0) / 4.0)
    report = diagnose(mount(), [data.with_channels(deformation_mm=reading, n1_pct=n1_pct, n2_pct=n2_pct)])
    assert report.verdict == ("unknown",)
    assert [one.channel for one in report.depends_on] == ["n1_pct", "n2_pct", "n2_pct - n1_pct"]
    assert "n1_pct or n2_pct or n2_pct - n1_pct" in report.advice[0]


def test_a_model_of_another_kind_is_judged_by_its_own_error():
    """A resonance is no mount: beside a mount's core every effect would seem to help, and the model would be lost."""
    ringing = replace(mount(), linear=LinearBlock(1.0, [], [ComplexMode(2.0, 6.0, -0.4, 0.2)]))
    data = record()
    model = compile_model(ringing, 1 / DT_S)
    noise = np.random.default_rng(4).normal(0, NOISE_N, len(data))
    data = data.with_channels(force_N=model.simulate(model.inputs(data.channels)) + noise)
    report = diagnose(ringing, [data])
    assert report.verdict == ("none",)
    assert report.rmse_before_n == pytest.approx(NOISE_N, rel=0.05)
    assert report.grade == "strong"
    with pytest.raises(ModelError, match="not added"):
        extend(ringing, [data], ["hysteresis_coulomb"])


def test_a_bias_along_a_product_is_not_several_laws_that_read_one_of_its_channels():
    data, t, n1_pct = _with_a_spool()
    vibration_mm_s = 9.0 + 4.0 * np.sin(2 * np.pi * t / 110.0) + 2.0 * np.sin(2 * np.pi * t / 37.0)
    reading = data["deformation_mm"] + 0.04 * np.tanh((n1_pct * vibration_mm_s / 1000.0 - 0.7) / 0.15)
    channels = {"deformation_mm": reading, "n1_pct": n1_pct, "vibration_mm_s": vibration_mm_s}
    report = diagnose(mount(), [data.with_channels(**channels)])
    assert report.verdict == ("unknown",)
    assert sorted(report.depends_on[0].channel.split(" * ")) == ["n1_pct", "vibration_mm_s"]
