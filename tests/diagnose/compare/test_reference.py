"""What a quiet bench does not record is at rest there, and said; a flight must bring its channels."""

import numpy as np
import pytest

from tests.diagnose.scene import columns, inertia, mount, record
from thrustd.core.aircraft import MountPlace
from thrustd.core.errors import RecordingError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.reference import rest_remarks
from thrustd.model.artifact import EffectSpec
from thrustd.records.recording import make_recording

RAW_LOG = {"source": "thrustd flight log"}
BENCH = ("time_s", "deformation_mm", "force_N")


def bench(**more):
    full = record()
    kept = {"time_s": full.time_s, **{name: full[name] for name in BENCH[1:]}, **more}
    return make_recording("bench", kept)


def test_a_flight_model_is_compared_with_a_bench_without_accelerations():
    flying = mount(effects=[inertia(100.0)])
    (with_inertia,) = compare({"m": flying}, [bench()]).comparisons
    (without,) = compare({"m": mount()}, [bench()]).comparisons
    assert with_inertia.rmse_n == pytest.approx(without.rmse_n)
    assert rest_remarks([bench()], None, [flying]) == ["bench: accel_x_g is not recorded, 0 g taken for it"]
    assert rest_remarks([bench()], None, [mount()]) == []


def test_a_model_that_goes_with_time_is_compared_with_a_bench():
    """Every recording has its time, though it is no channel of it."""
    drifting = mount(effects=[EffectSpec("sensor_drift", {"drift_mm_h": 0.01}), EffectSpec("ageing", {})])
    (found,) = compare({"m": drifting}, [bench()]).comparisons
    assert found.bias_n > 5.0  # 0.17 h
    assert rest_remarks([bench()], None, [drifting]) == []


def test_in_flight_nothing_rests():
    flown = bench(mach=np.full(len(columns()["time_s"]), 0.4))
    with pytest.raises(RecordingError, match="no column 'accel_x_g'"):
        compare({"m": mount(effects=[inertia(100.0)])}, [flown])


def test_a_log_that_was_not_replayed_says_how_its_mounts_become_columns():
    log = make_recording("flight.mcap", {"time_s": bench().time_s, "thrust_N_left": bench()["force_N"]}, RAW_LOG)
    with pytest.raises(RecordingError, match=r"no mount 'left_upper'.*thrustd replay"):
        compare({"m": mount()}, [log], mount=MountPlace("left_upper", "left", 0, 0.46))
