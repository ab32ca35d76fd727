"""Columns of numbers that act in front of the relaxation, against whole free runs with each of them moved."""

from dataclasses import replace

import numpy as np
import pytest

from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.free_run import gain_of, simulate
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.sweep import columns
from thrustd.identify.regression.terms import NUDGE, at_start, deformed, split
from thrustd.identify.regression.touched import touched
from thrustd.model.effects import effect_named
from thrustd.model.free_curve import at_places, free_curve

DT_S = 0.05
SITES = {"thermal_expansion": "deformation", "mullins_softening_spring": "spring", "engine_weight": "deformation"}
BESIDE = "axial_inertia", "hysteresis", "thermal_stiffness", "relaxation_maxwell"  # some of these read the deformation


def record(n=3000):
    rng = np.random.default_rng(3)
    d = np.convolve(np.repeat(rng.uniform(0.1, 1.1, n // 100), 100), np.ones(30) / 30, "same")
    wave = np.sin(0.01 * np.arange(n))
    channels = {"time_s": np.arange(n) * DT_S, "temperature_degC": 20.0 + 15.0 * wave, "force_lag_N": 3e3 * d}
    channels |= {"accel_x_g": 0.1 * wave, "accel_z_g": 1.0 + 0.1 * wave[::-1], "aux": np.cumsum(rng.normal(size=n))}
    y = np.where(np.arange(n) % 7 < 2, 0.5, np.nan)  # few count
    return Record(d, y, DT_S, 0.05, channels)


def curve(site, channels):
    effect = free_curve("aux", site)
    at = at_places(np.linspace(channels["aux"].min() + 0.1, channels["aux"].max() - 0.1, 16))
    return at_start(effect, {p.name: 0.05 for p in effect.parameters if p.amplitude}, at)


def term(name):
    effect = effect_named(name)
    shapes = {p.name: p.starts[0] for p in effect.parameters if not p.amplitude}
    return at_start(effect, {p.name: abs(p.starts[0]) or 1.0 for p in effect.parameters if p.amplitude}, shapes)


def built(terms, bent=False, pairs=False, rubs=False):
    rng = np.random.default_rng(1)
    grid, h_grid = Grid(-0.2, 1.4, 12), Grid(-0.5, 2.0, 9) if bent else None
    poles = np.log([[0.3, 2.0]]) if pairs else np.zeros((0, 2))
    radii = np.array([0.1, 0.3]) if rubs else np.zeros(0)
    shape = Shape(grid, 0.0, np.array([0.4, 30.0]), radii, 1000.0, h_grid, poles, terms=terms)
    f, h = grid.centres() + 0.2 * grid.centres() ** 3, 0.1 * rng.normal(size=9) if bent else np.zeros(0)
    numbers = 0.3 * np.abs(rng.normal(size=sum(len(one.free) for one in terms)))
    pair = np.array([[0.05, 0.02]]) if pairs else np.zeros((0, 2))
    return shape, Point(f, np.array([0.1, 0.2]), np.log([0.4, 30.0]), pair, poles, h, 0.1, 0.02 * (radii > 0), numbers)


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("rubs", [False, True])
def test_columns_are_those_of_whole_runs(bent, rubs):
    seen = record()
    fronts = [term("thermal_expansion"), curve("deformation", seen.channels), term("mullins_softening_spring")]
    terms = (*fronts, term("thermal_stiffness"), curve("gain", seen.channels), *map(term, ("hysteresis", "relaxation")))
    shape, point = built(terms, bent, bent, rubs)
    view = deformed(terms, point.terms, seen.seen)
    gain = gain_of(list(zip(terms, split(terms, point.terms), strict=True)), view, seen.known)
    out, plain = np.full((len(seen.known), len(point.terms)), np.nan), simulate(shape, point, seen, seen.known)
    touched(shape, point, seen, view, gain, out)
    sites = [one.effect.site for one in terms for _ in one.free]
    for i, site in enumerate(sites):
        if site in ("deformation", "spring"):
            unit = np.eye(len(sites))[i]
            moved = Point(**{**{n: getattr(point, n) for n in point.__slots__}, "terms": point.terms + NUDGE * unit})
            whole = (simulate(shape, moved, seen, seen.known) - plain) / NUDGE
            assert out[:, i] == pytest.approx(whole, abs=1e-8 * max(1.0, np.abs(whole).max()))
        else:
            assert np.all(np.isnan(out[:, i]))


@pytest.mark.parametrize(("name", "shape"), [("vibration_rectification", "exponent"), ("thermal_stiffness", "bend")])
def test_a_shape_that_begins_at_its_upper_wall_has_a_slope(name, shape):
    """A step beyond the wall changes nothing: such a shape stayed where it began, whatever the data said."""
    effect = effect_named(name)
    own = record()
    own = replace(own, channels={**own.channels, "vibration_mm_s": 50.0 + 40.0 * own.channels["accel_x_g"]})
    [wall] = [p.high for p in effect.parameters if p.name == shape]
    shapes = {p.name: wall if p.name == shape else p.starts[0] for p in effect.parameters if not p.amplitude}
    std = {p.name: abs(p.starts[0]) or 1.0 for p in effect.parameters if p.amplitude}
    term = at_start(effect, std, shapes)
    numbers = np.array([1.0 if p.amplitude else 0.0 for p in term.free])
    where = [p.name for p in term.free].index(shape)
    shaped, point = built((term,))
    point = replace(point, terms=numbers)
    inside = replace(point, terms=numbers - NUDGE * np.eye(len(numbers))[where])
    quotient = (simulate(shaped, point, own, own.known) - simulate(shaped, inside, own, own.known)) / NUDGE
    columns_of = np.concatenate([rows for _, rows, _ in columns(shaped, point, own)])[:, shaped.parts()["terms"]]
    assert np.abs(quotient).max() > 0.0
    assert columns_of[:, where] == pytest.approx(quotient, rel=1e-3, abs=1e-3 * np.abs(quotient).max())
