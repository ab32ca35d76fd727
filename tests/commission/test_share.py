"""How sure a tethered run is of the share that each mount carries, and of the gain that an engine's mounts have in
common, on aircraft whose transducers are all off.
"""

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.commission.tether import fit_tether
from thrustd.commission.tether_file import with_tether
from thrustd.core.calibration import Calibration, write_calibration
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.model.compile import compile_model
from thrustd.records.files import read_recording
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths
from thrustd.twin.airframe import ENGINES, carried_n, draw_airframe, rigged_mm, settled
from thrustd.twin.installation import hostile, seen_mm
from thrustd.twin.mount import REFERENCE_DEG_C, advance

SEEDS = 77, 78, 79, 80
HZ, STEPS, STEP_S, FULL_N = 20.0, 45, 20.0, 9000.0
BEGUN_S = 150.0  # the first steps: full load, then idle


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """(seed, installation, what its run has told) of every aircraft."""
    found, folder = [], tmp_path_factory.mktemp("hostile")
    for seed in SEEDS:
        log = folder / f"s{seed}.mcap"
        assert main(["simulate", "--tethered", "--seed", str(seed), "--installation", "hostile", "-o", str(log)]) == 0
        run = LogRun(run_paths(log))
        installation = open_installation(run, None)
        cell = read_recording(log.with_name(f"s{seed}-cell.csv"))
        found.append((seed, installation, fit_tether(flight_columns(run, installation), cell, installation)))
    return found


def test_the_share_is_as_unsure_as_it_is_wrong(fits):
    """Over eight engines: 2.5 to 5 times as wrong while the transducers' lines were taken for exact."""
    found = []
    for seed, _, fit in fits:
        told = {one.what: one for one in fit.numbers}
        for number, engine in enumerate(ENGINES):
            one = told[f"share of {engine}_upper"]
            true = draw_airframe(seed).upper_share[number] + hostile(seed).share
            found.append((one.value - true, one.half_width / SIGMAS_95))
    error, std = np.array(found).T
    print(np.round(found, 4))
    assert rms(error / std) < 1.5
    assert np.sum(np.abs(error) < SIGMAS_95 * std) >= 7
    assert std.max() < 0.006  # and no wider than that takes


def slopes_off(seed, installation, fit):
    """By engine: by how much of the load its calibrated mounts err together, on steps that the run did not have."""
    file = write_calibration(with_tether(Calibration(on="2026-01-01"), fit, "2026-01-02", ""))
    place, airframe = installation.calibrated_by(file), draw_airframe(seed, hostile(seed))
    levels_n = FULL_N * np.random.default_rng(seed).uniform(0.0, 1.0, STEPS)
    levels_n[:3] = 0.0, FULL_N, 0.05 * FULL_N
    thrust_n = np.repeat(levels_n, round(STEP_S * HZ))
    still, time_s = np.zeros(len(thrust_n)), np.arange(len(thrust_n)) / HZ
    loads_n = carried_n(airframe, np.stack((thrust_n, thrust_n)), np.stack((still, still, still + 1.0)), still)
    states, rigged_at, errors_n = settled(airframe, loads_n[:, 0]), rigged_mm(airframe), []
    for i, mount in enumerate(place.config.mount):
        model = compile_model(place.model(mount), HZ)
        warm = still + REFERENCE_DEG_C
        true_mm = advance(airframe.mounts[i], states[i], loads_n[i], 1.0 / HZ, warm, still + 1.0)
        seen = seen_mm(i, true_mm - rigged_at[i], warm, airframe.knobs)
        rest = {name: still for name in model.channels}
        told = {"deformation_mm": seen - seen[0], "temperature_degC": warm, "accel_z_g": still + 1.0, "time_s": time_s}
        errors_n.append(model.simulate(model.inputs(rest | told)) - (loads_n[i] - loads_n[i, 0]))
    later = time_s > BEGUN_S
    return [np.polyfit(thrust_n[later], both_n[later], 1)[0] for both_n in np.reshape(errors_n, (2, 2, -1)).sum(axis=1)]


def test_what_both_mounts_share_is_as_unsure_as_it_is_wrong_and_surer_than_one_alone(fits):
    """The cell tells the sum of an engine's mounts: over eight engines their slope is off by about its sigma."""
    found = []
    for seed, installation, fit in fits:
        alone = max(std for _, std in fit.gains.values())
        for off, std in zip(slopes_off(seed, installation, fit), fit.engine_stds.values(), strict=True):
            found.append((off, std, alone))
    error, std, alone = np.array(found).T
    print(np.round(found, 5))
    assert 0.3 < rms(error / std) < 1.5
    assert np.all(np.abs(error) < SIGMAS_95 * std)
    assert np.all(std < 0.8 * alone)
