"""NIS and whiteness: what a filter with the right, too small and too large noises shows."""

from math import isnan

import numpy as np
import pytest

from thrustd.core.types import Status
from thrustd.fusion.consistency import Innovations, consistency, whiteness

N = 20_000
EVERY = 5  # the engine is read once in so many steps


def flight(mount_sigma=1.0, brochure_sigma=1.0, status=0, rho=0.0):
    """Innovations of a filter that holds both sigmas for 1; the mounts' with lag-1 correlation `rho`."""
    rng = np.random.default_rng(1)
    mount = np.empty(N)
    mount[0] = rng.normal()
    for k, noise in enumerate(rng.normal(size=N - 1)):
        mount[k + 1] = rho * mount[k] + np.sqrt(1.0 - rho * rho) * noise
    mount *= mount_sigma
    brochure = np.where(np.arange(N) % EVERY == 0, brochure_sigma * rng.normal(size=N), np.nan)
    nis = np.nanmean([mount**2, brochure**2], axis=0)
    return Innovations(nis, brochure**2, mount, brochure, np.full(N, status, dtype=np.int64))


def test_right_noises_have_an_nis_of_one_and_nothing_left():
    found = consistency(flight())
    for source, measured in (("mount", N), ("brochure", N // EVERY)):
        assert found[source].nis == pytest.approx(1.0, abs=0.06)
        assert abs(found[source].whiteness) < 0.05
        assert found[source].measurements == measured


@pytest.mark.parametrize(("sigma", "nis"), [(2.0, 4.0), (0.5, 0.25)])
def test_each_source_has_its_own_nis(sigma, nis):
    found = consistency(flight(brochure_sigma=sigma))
    assert found["brochure"].nis == pytest.approx(nis, rel=0.06)
    assert found["mount"].nis == pytest.approx(1.0, abs=0.06)
    found = consistency(flight(mount_sigma=sigma))
    assert found["mount"].nis == pytest.approx(nis, rel=0.06)
    assert found["brochure"].nis == pytest.approx(1.0, abs=0.06)


def test_what_lasts_shows_in_the_whiteness_of_its_source_only():
    found = consistency(flight(rho=0.8))
    assert found["mount"].whiteness == pytest.approx(0.8, abs=0.03)
    assert abs(found["brochure"].whiteness) < 0.05


@pytest.mark.parametrize("bit", [Status.CONVERGING, Status.ENGINE_OFF, Status.TRANSIENT, Status.MOUNT_REJECTED])
def test_unsettled_steps_do_not_count(bit):
    found = consistency(flight(status=int(bit)))
    assert all(figures.measurements == 0 and isnan(figures.nis) for figures in found.values())


def test_bits_about_the_installation_do_not_matter():
    assert consistency(flight(status=int(Status.NOT_RECORDING))) == consistency(flight())


def test_too_few_or_constant_measurements_say_nothing():
    assert isnan(whiteness(np.array([1.0, 2.0])))
    assert isnan(whiteness(np.full(50, 3.0)))
