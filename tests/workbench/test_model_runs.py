"""A model's run as a column beside the recording: what was not measured is not drawn."""

import numpy as np

from tests.diagnose.scene import mount, record
from thrustd.workbench.model_runs import model_force


def test_a_hole_in_the_deformation_stays_a_hole_in_the_run():
    data = record(n=3000)
    deformation = data["deformation_mm"].copy()
    deformation[500:503] = np.nan  # a few values are bridged
    deformation[1000:1100] = np.nan
    force_n = model_force(mount(), data.with_channels(deformation_mm=deformation))
    assert np.flatnonzero(np.isnan(force_n)).tolist() == list(range(1000, 1100))
