"""The accelerometer's place from the twin's aircraft, through its file, to the force of a mount that turns."""

import msgspec
import numpy as np
import pytest

from benchmarks.commission import based
from thrustd.commission.mount_models import Made, _hang
from thrustd.core.measures import rms
from thrustd.identify.artifact import witness_rows
from thrustd.installation.installation import read_installation
from thrustd.model.compile import compile_model
from thrustd.twin.installation import PLAIN, felt_g, hostile

SEED, RATE_HZ, SECONDS = 143, 20.0, 60.0
ACCEL = "accel_x_g", "accel_y_g", "accel_z_g"
RATES = "pitch_rate_deg_s", "roll_rate_deg_s", "yaw_rate_deg_s"


@pytest.fixture
def errors_n(tmp_path):
    """Of the left upper mount's force because its accelerometer is elsewhere, (model without, with lever arm)."""
    found = []
    for arm in (False, True):
        installation = read_installation(based(tmp_path, SEED, {"kinds": ["hostile"], "arm": arm}))
        mount = installation.config.mount[0]
        bare = msgspec.structs.replace(installation.bench_model(mount), effects=[], witness=None)
        made = Made(msgspec.structs.replace(bare, witness=witness_rows(bare, 10.0)), 0.0, 0.0, [])
        _hang(made, mount.name, installation)
        model = compile_model(made.spec, RATE_HZ)
        time_s = np.arange(0.0, SECONDS, 1.0 / RATE_HZ)
        accel_g = np.stack([0.05 * np.sin(0.2 * time_s), 0.0 * time_s, 1.0 + 0.2 * np.sin(0.3 * time_s)])
        turns = np.stack([size * np.sin(rate * time_s) for size, rate in ((6.0, 0.9), (15.0, 0.7), (4.0, 0.5))])
        felt = felt_g(accel_g, turns, time_s, PLAIN._replace(arm_m=hostile(SEED).arm_m))
        columns = dict(zip(RATES, turns, strict=True)) | {"deformation_mm": 0.5 + 0.0 * time_s}
        said_n = model.simulate(model.inputs(columns | dict(zip(ACCEL, felt, strict=True))))
        at_centre = compile_model(_without_arm(made.spec), RATE_HZ)
        true_n = at_centre.simulate(at_centre.inputs(columns | dict(zip(ACCEL, accel_g, strict=True))))
        found.append(rms(said_n - true_n))
    return found


def _without_arm(spec):
    effects = [each for each in spec.effects if each.name != "lever_arm"]
    return msgspec.structs.replace(spec, effects=effects, witness=None)


def test_where_the_twins_accelerometer_is_takes_off_what_it_feels_of_the_turns(errors_n):
    """The signs of the file's forward, right and down are those of the aircraft."""
    without_n, with_n = errors_n
    assert without_n > 3.0
    assert with_n < 0.15 * without_n
