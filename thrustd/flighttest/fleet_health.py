"""Engines and mounts over many flights: rows of `health` side by side, at equal conditions, judged by `trend`.

No two flights are flown at the same points, and no deck has an engine's own curves. All points of all flights go into
one regression,

    y = g(N1 / sqrt(theta_t), M, delta, theta) + e_(engine, flight)

with g of second order, the same for all engines but for a constant: e is what an engine does at equal conditions, a per
cent of its thrust. What the mounts' zero did in that flight is newtons, and is told from it by the small thrusts: its
prior is ZERO_N. Points weigh with their length and their thrust squared. What day and deck do to both engines is not in
their difference; when that changes, the engine is named that wears: less thrust at its N1, more fuel, more N2.
"""

from collections.abc import Sequence
from math import inf
from typing import Any

import msgspec
import numpy as np

from thrustd.core.atmosphere import SEA_LEVEL_PA, static_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.flighttest.trend import ODDS, Trend, hours_to, judge
from thrustd.records.rows import Row

QUANTITIES = {"thrust_at_n1_pct": 0.5, "fuel_at_n1_pct": 1.0, "n2_at_n1_pct": 1.0, "load_share": 0.003}  # least change
ZERO_LIMIT_MM = 0.01  # 50 N on a mount of 5 kN/mm
SHARE_LIMIT = 0.005  # of the upper mount, 1 % of its stiffness
ZERO_N = 25.0  # of an engine in one flight, one sigma: friction and creep of the mounts (docs/fusion.md)
PAIR_ODDS = 2e-3  # of a difference: day and deck, which look like wear for a few flights, are not in it
DAY_S = 86400.0


class Health(msgspec.Struct, frozen=True):
    """One quantity of one engine, of the difference of two, or of one mount."""

    of: str
    quantity: str
    hours: list[float]  # service hours at the end of each flight
    values: list[float]  # at equal conditions, minus their mean
    trend: Trend
    engine: str = ""  # whose change it is; of a difference, of the one that wears
    recalibrate_in_h: float = inf  # from the first flight, of mounts
    recalibrate_utc_s: float = float("nan")  # where the logs say when they were recorded


class FleetHealth(msgspec.Struct, frozen=True):
    flights: list[str]
    health: list[Health]

    @property
    def changed(self) -> list[Health]:
        return [one for one in self.health if one.trend.changed]


def fleet_health(rows: Sequence[Row]) -> FleetHealth:
    """Of rows of `health_rows` with a column `file`; RecordingError when no flight has a steady window."""
    points = [row for row in rows if row.get("kind") == "engine"]
    if not points:
        raise RecordingError("no flight with a steady window; expected logs of flights")
    files = list(dict.fromkeys(row["file"] for row in rows if row.get("kind")))
    begun = {row["file"]: row["start_utc_s"] for row in rows if row.get("kind")}
    if all(np.isfinite(begun[file]) for file in files):
        files.sort(key=lambda file: float(begun[file]))
    flown = {row["file"]: row["hours"] for row in rows if row.get("kind")}
    hours = np.cumsum([flown[file] for file in files])
    engines = sorted({row["of"] for row in points})
    found: list[Health] = []
    for quantity, least in QUANTITIES.items():
        effects = _effects(points, quantity, engines, files)
        found += [_health(engine, quantity, hours, effects[engine], least) for engine in engines]
        if len(engines) == 2 and quantity != "load_share":
            apart = effects[engines[0]] - effects[engines[1]]
            one = _health(f"{engines[0]} - {engines[1]}", quantity, hours, apart, least, PAIR_ODDS)
            found.append(msgspec.structs.replace(one, engine=_whose(one, quantity, engines)))
    found = [_dated(one, SHARE_LIMIT, begun, files) if one.quantity == "load_share" else one for one in found]
    return FleetHealth(files, [*found, *_mounts(rows, files, hours, begun)])


def _whose(apart: Health, quantity: str, engines: list[str]) -> str:
    """Of a difference, the first engine minus the second, whose wear it is: wear adds no thrust and saves no fuel."""
    falls = bool(np.nan_to_num(apart.trend.change) < 0.0)
    return engines[0] if falls == (quantity == "thrust_at_n1_pct") else engines[1]


def _effects(points: Sequence[Row], quantity: str, engines: list[str], files: list[str]) -> dict[str, Floats]:
    """Engine -> value per flight (n,) at equal conditions, minus their mean; NaN where a flight has none."""
    used = [row for row in points if np.isfinite(row[quantity])]
    place = {(engine, file): i for i, (engine, file) in enumerate((e, f) for e in engines for f in files)}
    values = np.full(len(place), np.nan)
    if used:
        owners = np.zeros((len(used), len(engines)))
        owners[np.arange(len(used)), [engines.index(row["of"]) for row in used]] = 1.0
        flown = np.zeros((len(used), len(place)))
        flown[np.arange(len(used)), [place[row["of"], row["file"]] for row in used]] = 1.0
        there = flown.any(axis=0)
        common = np.hstack((_conditions(used), owners))
        thrust_n = np.array([abs(row["thrust_N"]) for row in used])
        weights = np.sqrt([row["seconds"] for row in used]) * thrust_n
        y = np.array([row[quantity] for row in used])
        zeros = flown[:, there] * (100.0 * ZERO_N / thrust_n)[:, None]
        values[there] = _between(common, flown[:, there], zeros, weights / weights.mean(), y)
    table = values.reshape(len(engines), len(files))
    return {engine: line - np.nanmean(line) if np.isfinite(line).any() else line
            for engine, line in zip(engines, table, strict=True)}  # fmt: skip


def _between(common: Floats, flown: Floats, zeros: Floats, weights: Floats, y: Floats) -> Floats:
    """What is left of each flight (k,): a random effect, so that what the day's temperature explains is not its own.

    y (n,) by what is common (n, c), by flight (n, k), whose prior is as wide as all of y, and by the zero of the
    mounts in each flight (n, k), in units of its prior.
    """
    c, k = common.shape[1], flown.shape[1]
    design = np.hstack((common, flown, zeros)) * weights[:, None]
    squares, moment = design.T @ design, design.T @ (y * weights)
    tiny = 1e-9 * float(np.trace(squares)) / len(moment)  # conditions that no flight changed
    within = np.linalg.solve(squares + tiny * np.eye(len(moment)), moment)
    noise2 = float(np.var(y * weights - design @ within)) or 1.0
    prior = np.concatenate((np.full(c, tiny), np.full(k, noise2 / float(np.var(y))), np.full(k, noise2)))
    return np.asarray(np.linalg.solve(squares + np.diag(prior), moment)[c : c + k], dtype=np.float64)


def _conditions(points: Sequence[Row]) -> Floats:
    """Second order in corrected N1, Mach, pressure and temperature, centred and scaled; (n, 14)."""
    n1, mach, altitude_m, sat_degc = (
        np.array([row[name] for row in points])
        for name in ("n1_corrected_pct", "mach", "pressure_altitude_m", "sat_degC")
    )
    delta = static_pressure_pa(altitude_m) / SEA_LEVEL_PA
    scaled = [(column - column.mean()) / max(float(column.std()), 1e-9) for column in (n1, mach, delta, sat_degc)]
    squares = [one * other for place, one in enumerate(scaled) for other in scaled[place:]]
    return np.column_stack((*scaled, *squares))


def _health(of: str, quantity: str, hours: Floats, values: Floats, least: float, odds: float = ODDS) -> Health:
    return Health(of, quantity, hours.tolist(), values.tolist(), judge(hours, values, least, odds), of)


def _mounts(rows: Sequence[Row], files: list[str], hours: Floats, begun: dict[str, float]) -> list[Health]:
    """Their zeros, from before the engines are started."""
    zeros: dict[str, dict[str, Any]] = {}
    for row in rows:
        if row.get("kind") == "mount":
            zeros.setdefault(row["of"], {})[row["file"]] = row["zero_mm"]
    found = []
    for mount, by_file in zeros.items():
        values = np.array([by_file.get(file, np.nan) for file in files], dtype=np.float64)
        if np.isfinite(values).any():
            one = _health(mount, "zero_mm", hours, values - np.nanmean(values), 0.002)
            found.append(_dated(one, ZERO_LIMIT_MM, begun, files))
    return found


def _dated(one: Health, limit: float, begun: dict[str, float], files: list[str]) -> Health:
    """With the hour, and the date at the present use, by which it may have moved by `limit`."""
    hours = hours_to(limit, one.trend)
    seconds = float(begun[files[-1]] - begun[files[0]])
    date = (
        begun[files[0]] + hours * seconds / one.hours[-1] if np.isfinite(seconds) and seconds > DAY_S else float("nan")
    )
    return msgspec.structs.replace(one, recalibrate_in_h=hours, recalibrate_utc_s=date)
