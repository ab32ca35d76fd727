"""What has crept is taken out of the reading, however much it is: the elastic deformation comes back exactly."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from thrustd.model.effects import creep_spectrum, effect_named

DT_S = 0.5
ELASTIC = np.cumsum(np.random.default_rng(5).normal(size=400)) * 0.05


def _lagged(v, tau_s):
    keep = np.exp(-DT_S / tau_s)
    return lfilter([1 - keep], [1, -keep], v)


def _back(effect, parameters, reading):
    c = effect.prepare(parameters, DT_S)
    x, u = np.zeros(effect.n_state), np.zeros(len(effect.channels))
    effect.initial(x, c, u, reading[0])
    return np.array([effect.step(x, c, u, v) for v in reading])


@given(st.floats(0.0, 0.3), st.floats(0.5, 600.0))
def test_log_time(share, start_s):
    creep = effect_named("creep")
    tau_s = start_s * 10.0 ** (np.arange(14) / 2 - 0.75)
    weights = share / 2 * np.exp(-start_s / tau_s)
    reading = ELASTIC + sum(w * _lagged(ELASTIC, tau) for w, tau in zip(weights, tau_s, strict=True))
    parameters = {"creep_per_decade": share, "start_s": start_s, "settled": 0.0}
    np.testing.assert_allclose(_back(creep, parameters, reading), ELASTIC, atol=1e-9)


@given(st.floats(0.0, 0.5), st.floats(10.0, 5000.0))
def test_kelvin_voigt(share, tau_s):
    creep = effect_named("creep_kelvin_voigt")
    reading = ELASTIC + share * _lagged(ELASTIC, tau_s)
    parameters = {"retarded_share": share, "tau_s": tau_s, "settled": 0.0}
    np.testing.assert_allclose(_back(creep, parameters, reading), ELASTIC, atol=1e-9)


def test_under_a_load_for_ever_all_of_it_has_crept():
    for name, said in (
        ("creep", {"creep_per_decade": 0.02, "start_s": 60.0}),
        ("creep_kelvin_voigt", {"retarded_share": 0.1, "tau_s": 900.0}),
    ):
        held = _back(effect_named(name), said | {"settled": 1.0}, np.ones(50))
        np.testing.assert_allclose(held, held[0], rtol=1e-12)
        assert held[0] < 0.95


@given(st.floats(0.001, 0.1), st.floats(0.1, 0.7))
def test_a_power_of_time(share, power):
    """A deformation of 1 that comes at once reads 1 + s (t / 1 min)^n, to the coarseness of two lags a decade."""
    creep = effect_named("creep_power")
    time_s = np.arange(1, 7201) * DT_S
    reading = 1.0 + share * (time_s / 60.0) ** power
    elastic = _back(creep, {"creep_at_minute": share, "power": power, "settled": 0.0}, reading)
    np.testing.assert_allclose(elastic[60:] - 1.0, 0.0, atol=0.04 * (reading.max() - 1.0))


@given(st.lists(st.floats(0.0, 0.2), min_size=8, max_size=8))
def test_a_ladder_of_times(shares):
    creep = effect_named("creep_spectrum")
    lags = [_lagged(ELASTIC, tau_s) for tau_s in creep_spectrum.TAUS_S]
    reading = ELASTIC + sum(share * lag for share, lag in zip(shares, lags, strict=True))
    parameters = creep.neutral() | dict(zip(creep_spectrum.SHARES, shares, strict=True)) | {"settled": 0.0}
    np.testing.assert_allclose(_back(creep, parameters, reading), ELASTIC, atol=1e-9)
    held = _back(creep, parameters | {"settled": 1.0}, np.ones(50))
    np.testing.assert_allclose(held, 1.0 / (1.0 + sum(shares)), rtol=1e-12)


@given(st.floats(0.0, 0.05), st.floats(-0.3, 2.0))
def test_many_times_follow_the_load_of_a_spring_that_hardens(share, hardening):
    spectrum, parameters = effect_named("creep_spectrum"), {"hardening": hardening, "range_mm": 2.0}
    load = ELASTIC * (1.0 + hardening * (ELASTIC / 2.0) ** 2)
    reading = ELASTIC + share * sum(_lagged(load, tau) for tau in creep_spectrum.TAUS_S[1:4:2])
    two = dict.fromkeys(creep_spectrum.SHARES[1:4:2], share)
    values = spectrum.neutral() | two | parameters | {"settled": 0.0}
    np.testing.assert_allclose(_back(spectrum, values, reading), ELASTIC, atol=1e-7)
    held = _back(spectrum, values | {"settled": 1.0}, np.ones(50))
    np.testing.assert_allclose(held, held[0], rtol=1e-6)
