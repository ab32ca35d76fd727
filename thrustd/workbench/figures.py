"""A comparison as JSON for the page: the numbers of `compare`, and its pictures as numbers."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.compare import REGION_SAMPLES
from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.picture_data import channel_dependences, loop_of, rate_map_of, spectrum_of
from thrustd.diagnose.search.dependence import Dependence
from thrustd.records.recording import unit_of
from thrustd.workbench.intervals import Intervals, intervals_of

LOOP_DOTS = 6_000
SPECTRUM_POINTS = 500
HISTORY_BUCKETS = 600
DIGITS = 6  # significant, of everything that is only drawn


def comparison_json(c: Comparison) -> dict[str, Any]:
    """`Comparison.to_json` with the time stretches of each failure and the pictures' numbers."""
    stride = max(1, len(c.time_s) // REGION_SAMPLES)
    thin = _thinned(c, stride)
    answer = c.to_json()
    for said, failure in zip(answer["where_it_fails"], c.where_it_fails, strict=True):
        said["intervals"], said["worst"] = _stretches(thin, failure.mask)
        said["dependences"] = [dependence_json(d) for d in channel_dependences(_masked(thin, failure.mask))]
        said["map"] = _map(_masked(thin, failure.mask))
    return answer | {
        "dependences": [dependence_json(d) for d in channel_dependences(thin)],
        "loop": _loop(thin),
        "spectrum": _spectrum(c),
        "map": _map(thin),
    }


def history_json(c: Comparison) -> dict[str, Any]:
    """The residual of one model on one recording: lowest and highest per stretch of time."""
    edges = np.unique(np.linspace(0, len(c.time_s), HISTORY_BUCKETS + 1).astype(int)[:-1])
    low, high = np.fmin.reduceat(c.residual_n, edges), np.fmax.reduceat(c.residual_n, edges)
    return {
        "model": c.model, "recording": c.recording, "rmse_n": c.rmse_n, "time_s": short(c.time_s[edges]),
        "low": short(low), "high": short(high),
    }  # fmt: skip


def _thinned(c: Comparison, stride: int) -> Comparison:
    channels = {name: column[::stride] for name, column in c.channels.items()}
    return replace(
        c, time_s=c.time_s[::stride], reference_n=c.reference_n[::stride], model_n=c.model_n[::stride],
        channels=channels,
    )  # fmt: skip


def _masked(c: Comparison, mask: npt.NDArray[np.bool_]) -> Comparison:
    return replace(c, reference_n=np.where(mask, c.reference_n, np.nan))


def _stretches(c: Comparison, mask: npt.NDArray[np.bool_]) -> tuple[Intervals, tuple[float, float]]:
    """Where a failure lies in time, and its stretch with most squared error."""
    found = intervals_of(mask, c.time_s)
    squares = np.concatenate(([0.0], np.cumsum(np.nan_to_num(np.where(mask, c.residual_n, 0.0)) ** 2)))
    first, last = np.searchsorted(c.time_s, np.array(found)).T
    worst = found[int(np.argmax(squares[last + 1] - squares[first]))]
    return found, worst


def dependence_json(d: Dependence) -> dict[str, Any]:
    return {
        "channel": d.channel,
        "unit": unit_of(d.channel),
        "at": short(d.at),
        "mean": short(d.residual_n),
        "low": short(d.low_n),
        "high": short(d.high_n),
    }


def _loop(c: Comparison) -> dict[str, Any]:
    loop = loop_of(c, LOOP_DOTS)
    step = max(1, len(c.time_s) // LOOP_DOTS)
    member = np.full(len(c.time_s), -1)
    for i, failure in enumerate(c.where_it_fails):
        member[failure.mask & (member < 0)] = i
    return {
        "deformation_mm": short(loop.deformation_mm),
        "reference_n": short(loop.reference_n),
        "residual_n": short(loop.residual_n),
        "failure": member[::step].tolist(),
        "limit_n": loop.limit_n,
    }


def _spectrum(c: Comparison) -> dict[str, Any]:
    s = spectrum_of(c)
    at, near = _log_spaced(len(s.frequency_hz)), _log_spaced(len(s.coherence_hz))
    return {
        "frequency_hz": short(s.frequency_hz[at]),
        "residual_n_rthz": short(s.residual_n_rthz[at]),
        "coherence_hz": short(s.coherence_hz[near]),
        "coherence": {name: short(share[near]) for name, share in s.coherence.items()},
    }


def _log_spaced(n: int) -> npt.NDArray[np.intp]:
    """Line numbers that fill a logarithmic axis evenly."""
    return np.unique(np.round(np.geomspace(1, n, min(n, SPECTRUM_POINTS))).astype(np.intp)) - 1


def _map(c: Comparison) -> dict[str, Any]:
    found = rate_map_of(c)
    return {
        "force_edges_n": short(found.force_edges_n),
        "rate_edges_n_s": short(found.rate_edges_n_s),
        "rms_n": [short(row) for row in found.rms_n],
    }


def short(values: Floats) -> Sequence[float | None]:
    """Rounded to what a picture shows; NaN as null."""
    return [float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]
