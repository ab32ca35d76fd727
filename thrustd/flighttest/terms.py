"""The terms of a flight's band, second by second, as its log holds them (`core.types.Terms`)."""

from pathlib import Path

import numpy as np

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.errors import ThrustdError
from thrustd.core.types import Status
from thrustd.records.flight_log import open_flight_log
from thrustd.records.recording import Recording
from thrustd.replay.budget import AIR, ALONG, INSTALLATION, LOAD, TERMS, Band, Budget, Told, band_of, budget_of
from thrustd.replay.replay import open_installation

TOLD = "thrust_N", "thrust_std_N", "estimate_mount_std_n", "brochure_std_N"


def band_in(path: Path) -> Band | None:
    """What the files in a log say of its band; None: it is no log, or holds none."""
    log = open_flight_log(path)
    if log is None:
        return None
    try:
        return band_of(open_installation(log, None))
    except ThrustdError:  # of an older version: its estimates are as good without
        return None


def budget_in(part: Recording, engine: str, band: Band) -> Budget | None:
    """Over a part of a flight that is once a second; None where nothing told the terms."""
    names = [f"terms_{name}_{engine}" for name in TERMS]
    told = f"terms_{INSTALLATION}_{engine}"
    if not (all(name in part for name in names) and np.isfinite(part[told]).any()):
        return None
    off = np.nan_to_num(part[f"status_{engine}"]).astype(np.int64) & int(Status.ENGINE_OFF) != 0
    pressure_pa = [dynamic_pressure_pa(*row) for row in zip(*(part[name].tolist() for name in AIR), strict=True)]
    stds = [part[f"{name}_{engine}"] for name in TOLD]
    terms_n = np.column_stack([part[name] for name in names])
    more_g, along_g = part.channels.get(LOAD, np.ones(len(part))) - 1.0, part.channels.get(ALONG, np.zeros(len(part)))
    return budget_of(
        engine, Told._make((*stds, off.astype(float), np.array(pressure_pa), more_g, along_g, terms_n)), band
    )
