"""One contract over every effect on the shelf: neutral is identity, finite at bounds, step = block, starts at rest."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from thrustd.core.signals import CATALOGUE
from thrustd.model.effects import effect_named, shelf

ICD_WORDS = [
    "axial_inertia",
    "engine_weight",
    "hysteresis",
    "creep",
    "viscous_damping",
    "thermal_expansion",
    "thermal_stiffness",
    "free_play",
    "mullins_softening",
    "payne",
    "ageing",
    "sensor_drift",
    "sensor_scale",
    "nacelle_drag",
    "time_delay",
    "vibration_rectification",
]
TYPICAL = {
    "accel_x_g": (0.0, 0.1),
    "accel_z_g": (1.0, 0.3),
    "temperature_degC": (30.0, 10.0),
    "vibration_mm_s": (10.0, 8.0),
    "dynamic_pressure_Pa": (8000.0, 3000.0),
    "pitch_rate_deg_s": (0.0, 3.0),
    "roll_rate_deg_s": (0.0, 5.0),
    "yaw_rate_deg_s": (0.0, 2.0),
}
DT_S = 0.05
EFFECTS = sorted(shelf())


def record(n=600, seed=0):
    rng = np.random.default_rng(seed)
    deformation_mm = 0.6 + 0.3 * np.sin(np.arange(n) * 0.02) + np.cumsum(rng.normal(0, 0.002, n))
    columns = {name: centre + spread * np.tanh(rng.normal(size=n)) for name, (centre, spread) in TYPICAL.items()}
    return columns | {"deformation_mm": deformation_mm, "time_s": np.arange(n) * DT_S}


def inputs_of(effect, columns):
    n = len(columns["deformation_mm"])
    u = np.column_stack([columns[name] for name in effect.channels]) if effect.channels else np.empty((n, 0))
    v = columns["deformation_mm"] if effect.site == "deformation" else 5500.0 * columns["deformation_mm"]
    return u, np.ascontiguousarray(v)


def run(effect, parameters, columns):
    stage = effect.stage(parameters, DT_S)
    u, v = inputs_of(effect, columns)
    return stage.run(stage.start(u[0], v[0]), u, v), u, v


def test_every_word_of_the_interface_document_is_there():
    assert set(ICD_WORDS) <= {effect.word for effect in shelf().values()}


@pytest.mark.parametrize("name", EFFECTS)
def test_the_card_is_complete(name):
    effect = effect_named(name)
    assert all((effect.title, effect.equation, effect.source, effect.separating_test, effect.parameters))
    assert set(effect.channels) <= set(CATALOGUE)
    assert any(p.amplitude for p in effect.parameters)
    for p in effect.parameters:
        assert p.low < p.high
        assert all(p.low <= value <= p.high for value in (p.neutral, *p.starts))
        assert p.meaning


@pytest.mark.parametrize("name", EFFECTS)
def test_neutral_is_identity_to_the_bit(name):
    effect = effect_named(name)
    out, _, v = run(effect, effect.neutral(), record())
    assert np.array_equal(out, v)


@pytest.mark.parametrize("name", EFFECTS)
def test_a_typical_value_does_something(name):
    effect = effect_named(name)
    out, _, v = run(effect, effect.neutral() | {p.name: p.starts[0] for p in effect.parameters}, record())
    assert np.abs(out - v).max() > 1e-5  # mm or N: a drift needs hours


def corners(effect):
    """All of them, or a few hundred of many."""
    ends = [(p.low, p.high) for p in effect.parameters]
    if len(ends) <= 8:
        return itertools.product(*ends)
    picks = np.random.default_rng(1).integers(0, 2, (300, len(ends)))
    return [tuple(end[i] for end, i in zip(ends, pick, strict=True)) for pick in picks]


@pytest.mark.parametrize("name", EFFECTS)
def test_finite_at_every_corner_of_the_bounds(name):
    effect = effect_named(name)
    for corner in corners(effect):
        out, _, _ = run(effect, dict(zip([p.name for p in effect.parameters], corner, strict=True)), record(200))
        assert np.isfinite(out).all(), corner


@pytest.mark.parametrize("name", EFFECTS)
def test_sample_by_sample_equals_block(name):
    effect = effect_named(name)
    parameters = effect.neutral() | {p.name: p.starts[-1] for p in effect.parameters}
    out, u, v = run(effect, parameters, record())
    stage = effect.stage(parameters, DT_S)
    x = stage.start(u[0], v[0])
    assert np.array_equal([stage.step(x, stage.c, u[k], v[k]) for k in range(len(v))], out)


@pytest.mark.parametrize("name", EFFECTS)
def test_a_gain_multiplies_whatever_the_force_is(name):
    """So its factor is found without the force."""
    effect = effect_named(name)
    if effect.site != "gain":
        return
    out, u, v = run(effect, effect.neutral() | {p.name: p.starts[-1] for p in effect.parameters}, record())
    stage = effect.stage(effect.neutral() | {p.name: p.starts[-1] for p in effect.parameters}, DT_S)
    assert stage.run(stage.start(u[0], 1.0), u, np.ones(len(v))) * v == pytest.approx(out, rel=1e-12)


@pytest.mark.parametrize("name", EFFECTS)
def test_what_is_added_goes_in_proportion_to_its_amplitudes(name):
    """Together they add what each adds alone, also where one pass tells all of them."""
    effect = effect_named(name)
    if effect.site != "force":
        return
    u, v = inputs_of(effect, record())
    nothing = np.zeros_like(v)

    def alone(sizes):
        stage = effect.stage(effect.neutral() | sizes, DT_S)
        return stage.run(stage.start(u[0], 0.0), u, nothing)

    amplitudes = [p for p in effect.parameters if p.amplitude]
    each = np.column_stack([alone({p.name: p.starts[0]}) for p in amplitudes])
    assert alone({p.name: 2.0 * p.starts[0] for p in amplitudes}) == pytest.approx(2.0 * each.sum(axis=1), abs=1e-9)
    if effect.elements is not None:
        stage = effect.stage(effect.neutral() | {p.name: 1.0 for p in amplitudes}, DT_S)
        out = np.empty_like(each)
        effect.elements(stage.start(u[0], 0.0), stage.c, u, np.ones(len(v), bool), out)
        assert out * [p.starts[0] for p in amplitudes] == pytest.approx(each, abs=1e-9)


@pytest.mark.parametrize("name", EFFECTS)
def test_starts_at_rest(name):
    """Where nothing moves and no time passes, nothing drifts."""
    effect = effect_named(name)
    still = {channel: np.full(50, column[7]) for channel, column in record().items()}
    out, _, _ = run(effect, effect.neutral() | {p.name: p.starts[0] for p in effect.parameters}, still)
    assert out == pytest.approx(np.full(50, out[0]), rel=1e-12)


def test_the_page_of_effects_lists_every_one_with_its_equation():
    page = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
    for effect in shelf().values():
        word = f"`{effect.word}` (variant `{effect.name}`)" if effect.variant_of else f"`{effect.name}`"
        channels = ", ".join(f"`{name}`" for name in effect.channels) or "-"
        equation = effect.equation.replace("|", "\\|")
        assert f"| {word} | {effect.site} | {channels} | {equation} |" in page
