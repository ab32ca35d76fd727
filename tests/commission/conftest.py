"""A tethered static run of one twin aircraft, as a log and a load cell's record, made once."""

import pytest

from thrustd.__main__ import main

KNOBS = ("stiffness=0.02", "zero_mm=0.012")
SEED = 9


@pytest.fixture(scope="session")
def static_run(tmp_path_factory):
    """Log of the run; beside it run-cell.csv. Mounts 2 % stiffer than their bench, transducers 12 um off."""
    log = tmp_path_factory.mktemp("static") / "run.mcap"
    knobs = [word for knob in KNOBS for word in ("--knob", knob)]
    assert main(["simulate", "--tethered", "--seed", str(SEED), *knobs, "-o", str(log)]) == 0
    return log
