"""A flight smoothed after the landing: every engine's tape run backwards, written as CSV, scored against a truth."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from thrustd.flight_score import PCT_ABOVE_N, ErrorSums, Score, TruthRow
from thrustd.fusion.smoother import Smoothed, Tape, smooth
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

MOUNTS_PER_ENGINE = 2  # the thesis' range is given per mount


def write_smoothed(path: Path, tapes: Mapping[str, Tape], truth: Iterable[TruthRow]) -> dict[str, dict[str, Score]]:
    """Writes time_s, thrust_N_<engine>, thrust_std_N_<engine> to `path`; returns engine -> "smoothed" -> score."""
    flights = {name: smooth(tape) for name, tape in tapes.items() if len(tape)}
    if not flights:
        return {}
    first = next(iter(flights.values()))
    columns = {"time_s": first.t_ns * 1e-9}
    for name, smoothed in flights.items():
        columns[f"thrust_N_{name}"] = smoothed.thrust_n
        columns[f"thrust_std_N_{name}"] = smoothed.thrust_std_n
    write_recording(make_recording(path.stem, columns, {"source": "Rauch-Tung-Striebel smoother"}), path)
    rows: dict[str, list[TruthRow]] = {name: [] for name in flights}
    for row in truth:
        rows[row.name].append(row)
    return {name: {"smoothed": _score(flights[name], true)} for name, true in rows.items() if true}


def _score(smoothed: Smoothed, truth: list[TruthRow]) -> Score:
    known_ns = np.array([row.t_ns for row in truth])
    inside = (smoothed.t_ns >= known_ns[0]) & (smoothed.t_ns <= known_ns[-1])
    true_n = np.interp(smoothed.t_ns[inside], known_ns, [row.value_n for row in truth])
    sums = ErrorSums()
    sums.add(smoothed.thrust_n[inside], smoothed.thrust_std_n[inside], true_n, PCT_ABOVE_N * MOUNTS_PER_ENGINE)
    return sums.score()
