"""What an unknown start may add is kept out of the evidence, as much of it as can be and no more."""

import numpy as np
import pytest

from tests.diagnose.scene import inertia, mount, record
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.evidence import gather
from thrustd.diagnose.search.gram import block_gram
from thrustd.diagnose.search.start import Start, start_of
from thrustd.records.recording import make_recording


def test_without_is_the_inverse_root_of_the_covariance():
    rng = np.random.default_rng(0)
    basis, strength = np.linalg.qr(rng.normal(size=(30, 3)))[0], np.array([0.1, 1.0, 30.0])
    start = Start(basis, strength)
    whitened = start.without(np.eye(30))
    covariance = np.eye(30) + basis @ np.diag(strength**2) @ basis.T
    assert whitened @ covariance @ whitened.T == pytest.approx(np.eye(30), abs=1e-9)


def test_products_block_by_block_are_those_of_the_whitened_columns():
    data = record([inertia(50.0)])
    evidence = gather(mount(), [data])
    residual = evidence.reference_n - evidence.output(mount())
    start = start_of(mount(), evidence)
    core = evidence.channels["accel_x_g"][:, None]
    group = np.column_stack((evidence.channels["accel_z_g"], evidence.channels["cabin_psi"]))
    gram = block_gram(evidence, residual, core, [group], start=start)
    table = start.without(np.column_stack((residual, core, group)))
    assert gram.matrices.sum(axis=0) == pytest.approx(table.T @ table, rel=1e-8)


def test_a_mount_that_was_at_work_before_is_no_missing_effect():
    """The record begins in the middle: the slow mode is not settled on its first sample."""
    model = mount(gains=(0.08,), taus_s=(150.0,))
    data = record(n=14_000)
    full = make_recording("whole", {"time_s": data.time_s, **data.channels, "force_N": _force(model, data)})
    late = full.rows(slice(2000, 14_000))
    assert diagnose(model, [late]).verdict == ("none",)


def _force(model, data):
    from thrustd.model.compile import compile_model

    compiled = compile_model(model, data.sample_hz)
    return compiled.simulate(compiled.inputs(data.channels)) + np.random.default_rng(3).normal(0, 12.0, len(data))
