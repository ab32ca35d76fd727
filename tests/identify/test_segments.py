"""Recordings on a uniform axis: what stamps that tremble and rows that are missing may not do to them."""

import numpy as np
import pytest

from thrustd.identify.segments import segments_of
from thrustd.records.recording import make_recording

DT_S = 0.05


def test_noise_of_a_record_whose_stamps_tremble_stays_what_it_was():
    """Between ticks a line is a mean of two rows: quieter than the instrument, and like its neighbour."""
    rng = np.random.default_rng(2)
    t = DT_S * np.arange(40_000) + rng.normal(0.0, 0.004, 40_000)
    there = rng.random(len(t)) > 0.01
    there[9_000:9_060] = False
    columns = {"time_s": t, "deformation_mm": 0.6 + 0.4 * np.sin(t / 5.0), "force_N": rng.normal(0.0, 10.0, len(t))}
    [segment] = segments_of([make_recording("bench", {name: column[there] for name, column in columns.items()})])
    force = segment.force_n[np.isfinite(segment.force_n)]
    assert segment.dt_s == pytest.approx(DT_S, rel=1e-5)
    assert force.std() == pytest.approx(10.0, rel=0.08)
    assert np.diff(force).std() / np.sqrt(2.0) == pytest.approx(force.std(), rel=0.08)
    at_s = segment.start_s + DT_S * np.arange(len(segment))
    assert segment.inputs["deformation_mm"][:8_000] == pytest.approx(0.6 + 0.4 * np.sin(at_s[:8_000] / 5.0), abs=1e-3)


def test_stamps_without_a_clock_keep_their_own_axis():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.03, 0.07, 2_000))
    data = {"time_s": t, "deformation_mm": np.sin(t), "force_N": np.cos(t)}
    [segment] = segments_of([make_recording("bench", data)])
    assert segment.start_s == t[0]
    at_s = segment.start_s + segment.dt_s * np.arange(len(segment))
    assert segment.inputs["deformation_mm"] == pytest.approx(np.sin(at_s), abs=1e-3)
