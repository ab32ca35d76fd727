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


def test_ticks_are_not_counted_from_stamp_to_stamp():
    """Where two neighbours together tremble by half a step now and then, the clock behind them is still there."""
    rng = np.random.default_rng(4)
    t = np.sort(DT_S * np.arange(60_000) + np.clip(rng.normal(0.0, 0.006, 60_000), -0.02, 0.02))
    t = np.delete(t, [*range(7, 20), *range(9_000, 9_090), *rng.integers(1, len(t), 200)])
    columns = {"deformation_mm": np.sin(t / 5.0), "force_N": rng.normal(0.0, 10.0, len(t))}
    [segment] = segments_of([make_recording("bench", {"time_s": t - t[0], **columns})])
    assert segment.dt_s == pytest.approx(DT_S, rel=1e-6)
    phase = (segment.start_s + t[0]) % DT_S
    assert min(phase, DT_S - phase) < 5e-4
    assert np.nanstd(segment.force_n) > 9.0


def test_stamps_without_a_clock_keep_their_own_axis():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.03, 0.07, 2_000))
    data = {"time_s": t, "deformation_mm": np.sin(t), "force_N": np.cos(t)}
    [segment] = segments_of([make_recording("bench", data)])
    assert segment.start_s == t[0]
    at_s = segment.start_s + segment.dt_s * np.arange(len(segment))
    assert segment.inputs["deformation_mm"] == pytest.approx(np.sin(at_s), abs=1e-3)
