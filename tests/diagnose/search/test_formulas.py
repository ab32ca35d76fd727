"""Free names of a formula begin at the size that the records give them; a formula that is no number is refused."""

import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.core.errors import ModelError
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.formulas import formula_terms
from thrustd.identify.regression.record import Record
from thrustd.model.expression import expression_effect
from thrustd.records.recording import make_recording


def line_bar(data):
    """Moves by a few bar around 100."""
    return 100.0 + 4.0 * (data["cabin_psi"] - 14.0)


@pytest.fixture(scope="module")
def pressed():
    """30 N/bar times what a line has above 100 bar."""
    data = record(added=lambda d: 30.0 * (line_bar(d) - 100.0))
    return make_recording("measured", {**data.channels, "time_s": data.time_s, "line_bar": line_bar(data)})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("k * (line_bar - p0)", {"k": 30.0, "p0": 100.0}),
        ("k * (p0 - line_bar)", {"k": -30.0, "p0": 100.0}),
        ("k * (1 + g * line_bar)", {"k": -3000.0, "g": -0.01}),
        ("k * (1e5 * line_bar - p0)", {"k": 3e-4, "p0": 1e7}),
    ],
)
def test_a_channel_whose_level_is_many_times_its_spread_tells_both_names(pressed, text, expected):
    guess = expression_effect(text, pressed.channels)
    found = {p.name: p for p in extend(mount(), [pressed], [guess]).parameters}
    for name, value in expected.items():
        assert abs(found[name].value - value) < 1.5 * found[name].half_width, name
        assert found[name].value == pytest.approx(value, rel=0.1), name


def test_a_verdict_with_a_formula_of_two_names_has_the_numbers_of_the_truth(pressed):
    guess = expression_effect("k * (line_bar - p0)", pressed.channels)
    report = diagnose(mount(), [pressed], extra=[guess])
    assert report.verdict == (guess.name,)
    values = {p.name: p.value for p in report.candidates[0].parameters}
    assert values == pytest.approx({"k": 30.0, "p0": 100.0}, rel=0.05)


def seen(**channels):
    n = len(next(iter(channels.values())))
    return Record(np.zeros(n), np.zeros(n), 1.0, 0.0, {"time_s": np.arange(float(n)), **channels})


@pytest.mark.parametrize(
    ("text", "begins"),
    [
        ("k * (mach - m0)", {0.4, 0.0, 0.8}),  # in the middle, below all, above all
        ("k * (mach + m0)", {-0.4, 0.0, -0.8}),
        ("k * (3 * mach - 0.6 - m0)", {0.6, -0.6, 1.8}),
        ("k * tanh(mach / m0)", {0.6, 1.0}),
        ("k * exp(m0 * mach)", {1.67, -1.67}),
        ("k * mach ** m0", {1.0}),
        ("k * (1e15 * mach - m0)", {4e11, 0.0, 8e11}),  # as it flies: no constant is larger than 1e12
    ],
)
def test_a_name_begins_at_what_stands_beside_it(text, begins):
    terms = formula_terms(expression_effect(text), [seen(mach=np.linspace(0.2, 0.6, 2001))], 10)
    assert sorted(term.fixed["m0"] for term in terms) == pytest.approx(sorted(begins), rel=0.01, abs=1e-9)


def test_an_amplitude_is_of_the_size_that_the_force_has():
    few = seen(mach=np.array([0.2, 0.4, 0.6]))
    [term] = formula_terms(expression_effect("k * mach"), [few], 80.0)
    assert term.std["k"] == pytest.approx(10.0 * 80.0 / np.std([0.2, 0.4, 0.6]))


@pytest.mark.parametrize("text", ["k * log(accel_x_g)", "k * sqrt(accel_x_g)", "k * accel_x_g ** p", "k / accel_x_g"])
def test_a_formula_without_a_value_on_some_rows_is_refused_in_one_line(text):
    there = seen(accel_x_g=np.array([0.3, 0.2, -0.03 if "/" not in text else 0.0, 0.1]))
    at = r"no value on 1 of 4 rows, e\.g\. where accel_x_g is (-0\.03|0) at 2\.0 s; expected a formula that is a number"
    with pytest.raises(ModelError, match=at):
        formula_terms(expression_effect(text), [there], 10.0)


@pytest.mark.parametrize(
    "ask", [lambda data, law: extend(mount(), [data], [law]), lambda data, law: diagnose(mount(), [data], extra=[law])]
)
def test_extend_and_diagnose_refuse_it(ask):
    with pytest.raises(ModelError, match="expected a formula that is a number everywhere"):
        ask(record(), expression_effect("k * log(accel_x_g)"))


def test_a_formula_that_is_undefined_for_some_values_of_its_names_alone_is_estimated():
    data = record(added=lambda d: 200.0 * np.sqrt(d["accel_x_g"] + 0.3))
    found = extend(mount(), [data], [expression_effect("k * sqrt(accel_x_g - a)")])
    assert {p.name: p.value for p in found.parameters} == pytest.approx({"k": 200.0, "a": -0.3}, rel=0.2)
