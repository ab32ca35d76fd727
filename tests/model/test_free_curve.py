"""A free curve of a channel as an effect: what it adds, what it is called, and the same in flight and in C."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import interp1d

from thrustd.core.errors import ModelError
from thrustd.diagnose.search.candidates import combined
from thrustd.model.effects import effect_named
from thrustd.model.free_curve import KNOTS, at_places, column_of, free_curve, nameable, places

RNG = np.random.default_rng(3)
WAY = np.linspace(-2.0, 5.0, KNOTS)
HEIGHTS = RNG.normal(0.0, 30.0, KNOTS)
NUMBERS = at_places(WAY) | {f"height_{i:02d}": float(height) for i, height in enumerate(HEIGHTS)}


def added(name, force_n, **channels):
    """What the effect makes of a force (n,)."""
    return effect_named(name).stage(NUMBERS, 0.05).from_rest(channels, force_n)


def line(q):
    """Straight on beyond its ends, for as far again."""
    way = WAY[-1] - WAY[0]
    return interp1d(WAY, HEIGHTS, fill_value="extrapolate")(np.clip(q, WAY[0] - way, WAY[-1] + way))


@pytest.mark.parametrize("kind", ["", "bias "])
def test_it_adds_a_broken_line_of_the_channel_straight_beyond_for_as_far_again(kind):
    mach = RNG.uniform(-20.0, 30.0, 1000)
    assert added(f"{kind}curve of mach", np.ones(1000), mach=mach) == pytest.approx(1.0 + line(mach))


def test_a_gain_multiplies():
    mach = RNG.uniform(-4.0, 8.0, 500)
    found = added("gain curve of mach", np.full(500, 2.0), mach=mach)
    assert found == pytest.approx(2.0 * (1.0 + line(mach)))


def test_of_two_channels_it_follows_the_difference_or_the_product():
    a, b = RNG.uniform(-1.0, 2.0, (2, 300))
    for name, q in (("curve of b - a", b - a), ("curve of a * b", a * b)):
        assert added(name, np.zeros(300), a=a, b=b) == pytest.approx(line(q))


def test_as_it_begins_it_does_nothing():
    effect = effect_named("curve of mach")
    assert effect.does_nothing(effect.neutral())
    found = effect.stage(effect.neutral(), 0.05).from_rest({"mach": np.array([-1.0, 0.0, 0.3, 9.0])}, np.arange(4.0))
    assert found == pytest.approx(np.arange(4.0))


COLUMN = st.text(st.sampled_from("ab -*'\"."), min_size=1, max_size=8)  # what a name of two is made of


@given(COLUMN, COLUMN)
def test_whatever_columns_are_called_a_curve_of_them_reads_these(one, other):
    if one == other:
        return
    columns = {one: np.linspace(1.0, 2.0, 50), other: np.linspace(3.0, 7.0, 50) ** 2}
    assert len(combined(columns)) >= 2 or not nameable(one) or not nameable(other)
    for channel, parts in combined(columns).items():
        effect = effect_named(f"curve of {channel}")
        assert effect.channels == parts and effect == free_curve(channel)
        first, *rest = (columns[part] for part in parts)
        wanted = [first] if not rest else [rest[0] - first, first * rest[0]]
        assert any(np.array_equal(column_of(channel, columns), each) for each in wanted)


def test_places_increase_and_are_quantiles_where_there_are_enough_values():
    column = RNG.exponential(1.0, 5000)
    assert places(column) == pytest.approx(np.quantile(column, np.linspace(0.005, 0.995, KNOTS)))
    levels = places(RNG.choice([0.0, 1.0, 5.0], 1000))
    assert levels is not None and len(levels) == KNOTS and np.all(np.diff(levels) > 0.0)
    assert places(RNG.choice([0.0, 1.0], 1000)) is None


@pytest.mark.parametrize("name", ["curve of ", "curve of 'mach", 'curve of "', "curve of ''"])
def test_a_name_that_says_nothing_is_one_line(name):
    with pytest.raises(ModelError, match="expected"):
        effect_named(name)


def test_places_that_do_not_increase_are_refused():
    effect = effect_named("curve of mach")
    for wrong in ({"at_14": WAY[-1]}, {"at_00": 9.0}, {"at_03": np.nan}):
        with pytest.raises(ModelError, match="do not increase"):
            effect.constants(NUMBERS | wrong, 0.05)
