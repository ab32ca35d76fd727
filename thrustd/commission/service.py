"""Hours in service: how long each engine ran in these logs, added to its mounts, each run counted once."""

import msgspec
import numpy as np

from thrustd.core.calibration import Calibration, MountCalibration
from thrustd.core.config import Config
from thrustd.core.errors import RecordingError
from thrustd.core.signals import RUNS_PCT
from thrustd.records.recording import Recording


def with_hours(calibration: Calibration, flight: Recording, config: Config) -> Calibration:
    """Hours of `flight` added; RecordingError when its run is counted already."""
    run = flight.metadata.get("run", "") or flight.name
    if run in calibration.runs:
        raise RecordingError(f"{flight.name}: run {run} is counted already; expected one that is not")
    mounts = dict(calibration.mount)
    step_s = np.diff(flight.time_s, prepend=flight.time_s[0])
    for mount in config.mount:
        hours = float(np.sum(step_s[flight[f"n1_pct_{mount.engine}"] > RUNS_PCT])) / 3600
        old = mounts.get(mount.name, MountCalibration())
        mounts[mount.name] = msgspec.structs.replace(old, service_h=round(old.service_h + hours, 4))
    return msgspec.structs.replace(calibration, mount=mounts, runs=(*calibration.runs, run))
