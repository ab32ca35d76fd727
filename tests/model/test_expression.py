"""Expressions are parsed, never run; they compute what they say."""

import ast
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.core.errors import ModelError
from thrustd.model.effects import effect_named
from thrustd.model.expression import along, expression_effect, is_expression


def value(text, columns=(), **given):
    effect = expression_effect(text, columns)
    parameters = {p.name: given[p.name] for p in effect.parameters}
    stage = effect.stage(parameters, 0.01)
    u = np.array([[given[name] for name in effect.channels]])
    return float(stage.run(stage.start(u[0], 0.0), u, np.zeros(1))[0])


@settings(max_examples=40, deadline=None)
@given(k=st.floats(-5, 5), q=st.floats(0.1, 5), m=st.floats(0.1, 1))
def test_it_computes_what_python_computes(k, q, m):
    text = "k * (sqrt(dynamic_pressure_Pa) - 2 * mach ** 2 / (1 + abs(-mach)) + tanh(mach) * exp(-mach) - log(mach))"
    expected = k * (math.sqrt(q) - 2 * m**2 / (1 + m) + math.tanh(m) * math.exp(-m) - math.log(m))
    assert value(text, k=k, dynamic_pressure_Pa=q, mach=m) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_along_a_record_it_and_its_parts_are_what_the_model_adds():
    """To the bit; without a channel, too."""
    text, values = "k * (tanh(mach / w) - exp(-3 * mach) / 7) ** 3", {"k": 1.7, "w": 0.3}
    effect, columns = expression_effect(text), {"time_s": np.arange(50.0), "mach": np.linspace(0.0, 0.7, 50)}
    tree = ast.parse(text, mode="eval").body
    flown = effect.stage(values, 0.01).from_rest(columns, np.zeros(50))
    assert np.array_equal(along(tree, columns, values), flown)
    assert np.array_equal(along(tree.left, columns, values), np.full(50, 1.7))
    assert np.array_equal(along(ast.parse("1 / mach", mode="eval").body, columns, {})[:1], [np.inf])


def test_columns_that_are_not_in_the_catalogue_are_quoted_in_the_name():
    effect = expression_effect("k * cabin_psi * mach", ["cabin_psi"])
    assert effect.name == "expression: k * 'cabin_psi' * mach"
    assert effect.channels == ("cabin_psi", "mach")
    assert effect_named(effect.name) == effect


def test_a_column_of_any_name_is_quoted_and_artifacts_of_before_are_read():
    effect = expression_effect('k * ("Temp [degC]" - p0)')
    assert effect.channels == ("Temp [degC]",) and effect_named(effect.name) == effect
    assert effect_named("expression: k * [cabin_psi] * mach").channels == ("cabin_psi", "mach")
    assert value('k * "Temp [degC]"', k=2.0, **{"Temp [degC]": 3.0}) == 6.0
    assert effect_named('k * "driven by hand"').channels == ("driven by hand",)


def test_amplitude_and_shape_are_told_apart():
    kinds = {p.name: p.amplitude for p in expression_effect("k * exp(b * mach)").parameters}
    assert kinds == {"k": True, "b": False}
    assert all(p.amplitude for p in expression_effect("a * mach + b * mach ** 2").parameters)


def test_neutral_does_nothing():
    effect = expression_effect("k * exp(b * mach)")
    stage = effect.stage(effect.neutral(), 0.01)
    u, v = np.linspace(0, 1, 20)[:, None], np.linspace(-5, 5, 20)
    assert np.array_equal(stage.run(stage.start(u[0], 0.0), u, v), v)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "k *",
        "k * 2",
        "3 * mach",
        "k * mach.real",
        "k * mach[0]",
        'k * ""',
        "k * 'a\\nb'",
        "k * f'{mach}'",
        "k * b'mach'",
        "__import__('os')",
        "k * open('x')",
        "lambda: mach",
        "k if mach else 2",
        "[k for k in mach]",
        "k * max(mach, 1)",
        "k * mach; mach",
        "k" * 500,
        "(" * 200 + "k * mach" + ")" * 200,
        "+".join(["mach"] * 40 + ["k"]),
    ],
)
def test_what_is_not_allowed_is_refused_in_one_line(text):
    with pytest.raises(ModelError, match="expected") as raised:
        expression_effect(text)
    assert "\n" not in str(raised.value)


def test_names_are_not_expressions():
    assert not is_expression("axial_inertia")
    assert is_expression("k * mach")
    assert is_expression("expression: k*mach")
