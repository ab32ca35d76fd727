"""What `zero` takes for an engine that is off, and what a report says of pieces that were not brought."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from thrustd.commission.commission import _missing
from thrustd.commission.pieces import Pieces
from thrustd.commission.report import Commissioned, report_page
from thrustd.commission.zero import zeros
from thrustd.core.errors import RecordingError
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths


def test_an_engine_is_off_below_the_speed_that_the_configuration_says(static_run):
    """Wind turns it at 7 %."""
    log = LogRun(run_paths(static_run))
    installation = open_installation(log, None)
    flight = flight_columns(log, installation)
    turned = {name: np.maximum(flight[name], 7.0) for name in ("n1_pct_left", "n1_pct_right")}
    with pytest.raises(RecordingError, match="begins with an engine running"):
        zeros(flight.with_channels(**turned), installation)
    settings = msgspec.structs.replace(installation.config, fusion={"engine_off_n1_pct": 10.0})
    known = type(installation)(settings, installation.files, installation.where)
    found, still = zeros(flight.with_channels(**turned), known), zeros(flight, installation)
    assert [one.zero_mm for one in found] == pytest.approx([one.zero_mm for one in still], abs=1e-4)


def test_one_flight_is_said_to_be_unused_and_the_band_is_said_in_newtons():
    missing = _missing(Pieces({}, [], [], [Path("f1.npz")]))
    assert missing[-1].costs.endswith("; the one given is not used")
    assert not _missing(Pieces({}, [], [], []))[-1].costs.endswith("used")
    page = report_page(Commissioned(Path("a"), Path("a/hil.toml"), {}, [], (), missing, 0.0084, ""))
    assert "25 N of 3000 N on a mount, 36 N of 6000 N on an engine" in page
