"""A flight smoothed after the landing: every engine's tape run backwards, written as CSV, scored against a truth."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from thrustd.core.measures import OPERATING_N
from thrustd.fusion.smoother import Smoothed, Tape, smooth
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording
from thrustd.replay.score import ErrorSums, Score, Truth

MOUNTS_PER_ENGINE = 2  # the thesis' range is given per mount


def write_smoothed(path: Path, tapes: Mapping[str, Tape], truth: Iterable[Truth]) -> dict[str, dict[str, Score]]:
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
    known: dict[str, tuple[list[int], list[float]]] = {name: ([], []) for name in flights}
    for name, t_ns, value_n in truth:
        known[name][0].extend(t_ns)
        known[name][1].extend(value_n)
    return {name: {"smoothed": _score(flights[name], *true)} for name, true in known.items() if true[0]}


def _score(smoothed: Smoothed, t_ns: list[int], value_n: list[float]) -> Score:
    known_ns = np.array(t_ns)
    inside = (smoothed.t_ns >= known_ns[0]) & (smoothed.t_ns <= known_ns[-1])
    true_n = np.interp(smoothed.t_ns[inside], known_ns, value_n)
    sums = ErrorSums()
    sums.add(smoothed.thrust_n[inside], smoothed.thrust_std_n[inside], true_n, OPERATING_N * MOUNTS_PER_ENGINE)
    return sums.score()
