"""The error map's lookup: every region its own sigma, the outer ones extend outwards, none is the thesis' figure."""

import numpy as np

from thrustd.model.artifact import ErrorMap
from thrustd.model.region_error import THESIS_STD_N, cells, region_std_n, region_stds_n

ERROR = ErrorMap([0.0, 1000.0, 2000.0, 3000.0], [0.0, 50.0, 500.0], [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])


def test_edges_belong_to_the_region_above_and_outer_regions_extend():
    force_n = np.array([-500.0, 0.0, 999.0, 1000.0, 2500.0, 9000.0])
    rate_n_s = np.array([0.0, 49.0, 50.0, 900.0, 0.0, 1e9])
    assert region_stds_n(ERROR, force_n, rate_n_s).tolist() == [1.0, 1.0, 2.0, 4.0, 5.0, 6.0]


def test_one_at_a_time_is_the_same():
    assert region_std_n(*cells(ERROR), 1500.0, 60.0) == 4.0
    assert region_std_n(*cells(None), 1500.0, 60.0) == THESIS_STD_N
