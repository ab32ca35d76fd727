"""Evidence for an effect on the user's own data: the residual with the part that the effect explains over it.

Beside the history each law is shown where it can be told by eye: friction as loops by direction, creep as holds, heat
over temperature, damping over speed, everything else over the channel it reads.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.compare.motion import Motion, motion_of
from thrustd.diagnose.search.explained import Explained, Stretch
from thrustd.identify.segments import DEFORMATION
from thrustd.model.effects import effect_named
from thrustd.records.recording import unit_of
from thrustd.workbench.figures import short

BUCKETS = 500  # of the history
BINS = 28  # of a curve
LEAST = 20  # samples in a bin
LOOPS = ("hysteresis", "free_play", "mullins_softening")
SPEEDS = ("viscous_damping", "time_delay")
HOLDS = ("creep", "relaxation")
TIMES = ("ageing", "sensor_drift")


def evidence_json(explained: Explained | None) -> list[dict[str, Any]]:
    """One picture per set: history of residual and explained part, and the view that tells its first law."""
    if explained is None:
        return []
    return [_evidence(explained, i) for i in range(len(explained.words))]


def _evidence(explained: Explained, i: int) -> dict[str, Any]:
    return {
        "effects": list(explained.words[i]),
        "laws": list(explained.laws[i]),
        "rmse_n": explained.rmse_n[i],
        "history": _history(explained.stretches, i),
        "view": _view(explained.laws[i][0], explained.stretches, i),
    }


def _history(stretches: Sequence[Stretch], i: int) -> dict[str, Any]:
    """Lowest and highest residual and mean explained part per bucket of time; null between stretches."""
    total = sum(len(s.time_s) for s in stretches)
    parts: list[list[Floats]] = []
    for s in stretches:
        count = max(1, BUCKETS * len(s.time_s) // total)
        edges = np.linspace(0, len(s.time_s), min(count, len(s.time_s)) + 1).astype(int)[:-1]
        residual = np.nan_to_num(s.residual_n)
        size = np.diff(np.append(edges, len(s.time_s)))
        part = np.add.reduceat(np.nan_to_num(s.explained_n[i]), edges) / size
        parts.append(
            [s.time_s[edges], np.minimum.reduceat(residual, edges), np.maximum.reduceat(residual, edges), part]
        )
        parts.append([s.time_s[-1:], *[np.array([np.nan])] * 3])
    time_s, low, high, part = (np.concatenate(column) for column in zip(*parts, strict=True))
    return {"time_s": short(time_s), "low": short(low), "high": short(high), "explained": short(part)}


def _view(law: str, stretches: Sequence[Stretch], i: int) -> dict[str, Any]:
    """Curves of mean residual and mean explained part; `log`: of the axis."""
    effect = effect_named(law)
    moved = [motion_of(s.channels[DEFORMATION], s.dt_s) for s in stretches]
    rising = np.concatenate([m.direction > 0 for m in moved])
    if effect.word in LOOPS:
        return _curves("deformation", "mm", _all(stretches, DEFORMATION), _by_direction(rising, moved), stretches, i)
    if effect.word in SPEEDS:
        speed = np.concatenate([m.velocity for m in moved])
        return _curves("rate of deformation", "mm/s", speed, {"all samples": rising | ~rising}, stretches, i)
    if effect.word in HOLDS:
        held = np.concatenate([m.held_s for m in moved])
        groups = {"after loading": rising & (held > 0), "after unloading": ~rising & (held > 0)}
        return _curves("time since the last movement", "s", held, groups, stretches, i, log=True)
    channel = "time_s" if effect.word in TIMES else next(iter(effect.channels), DEFORMATION)
    column = _all(stretches, channel)
    groups = {"all samples": np.isfinite(column)}
    if effect.site in ("gain", "spring"):  # it scales the force: what is left grows with the load
        high = _all(stretches, DEFORMATION) > np.median(_all(stretches, DEFORMATION))
        groups = {"large deformation": high, "small deformation": ~high}
    return _curves("time" if channel == "time_s" else channel, unit_of(channel), column, groups, stretches, i)


def _all(stretches: Sequence[Stretch], channel: str) -> Floats:
    return np.concatenate([s.channels[channel] for s in stretches])


def _by_direction(rising: Flags, moved: Sequence[Motion]) -> dict[str, Flags]:
    known = np.concatenate([m.direction != 0 for m in moved])
    return {"loading": rising & known, "unloading": ~rising & known}


def _curves(
    title: str, unit: str, x: Floats, groups: dict[str, Flags], stretches: Sequence[Stretch], i: int, log: bool = False
) -> dict[str, Any]:
    residual = np.concatenate([s.residual_n for s in stretches])
    part = np.concatenate([s.explained_n[i] for s in stretches])
    good = np.isfinite(x) & np.isfinite(residual)
    inside = x[good & np.any(list(groups.values()), axis=0)]
    low, high = np.quantile(inside, [0.001, 0.999]) if inside.size else (0.0, 1.0)
    edges = np.geomspace(max(low, 1e-3 * high), high, BINS + 1) if log else np.linspace(low, high, BINS + 1)
    curves = [
        {"name": name} | _means(edges, x[mask & good], residual[mask & good], part[mask & good])
        for name, mask in groups.items()
    ]
    return {"title": title, "unit": unit, "log": log, "curves": curves}


def _means(edges: Floats, x: Floats, residual: Floats, part: Floats) -> dict[str, Any]:
    place = np.searchsorted(edges, x) - 1
    inside = (place >= 0) & (place < BINS)
    count = np.bincount(place[inside], minlength=BINS)
    kept = count >= LEAST

    def mean(values: Floats) -> Floats:
        total: Floats = np.bincount(place[inside], values[inside], BINS)[kept] / count[kept]
        return total

    return {"at": short(mean(x)), "residual_n": short(mean(residual)), "explained_n": short(mean(part))}
