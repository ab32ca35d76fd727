"""Engines and mounts over many flights: rows of `health` side by side, at equal conditions, judged by `trend`.

No two flights are flown at the same points, and no deck has an engine's own curves. All points of all flights go into
one regression with two random effects of every flight,

    y = g(N1 / sqrt(theta_t), M, delta, theta, 1 / F) + e_flight + 100 z_flight / F

with g of second order and F the deck's thrust at this N1 (the measured one holds the wear: as a condition it explains
it away). e is what an engine does at equal conditions, a per cent of its thrust; z is what the mounts' zeros did in
that flight, N. Points weigh with their length and their thrust squared. How large e, z and the noise are, the data say:
restricted maximum likelihood (Patterson & Thompson 1971).

The difference of two engines in the same window at the same fan speed has nothing of the day in it, of the air, and of
what the deck does to both: it is the sharpest series. Its evidence of a trend is that of the whole regression with one
and without, so how well every flight tells the difference counts. When it changes, the engine is named that wears: less
thrust at its N1, more fuel.
"""

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import msgspec
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.special import logsumexp

from thrustd.core.atmosphere import SEA_LEVEL_PA, static_pressure_pa
from thrustd.core.calibration import DRIFTED_MM
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.measures import SIGMAS_95
from thrustd.flighttest.trend import Told, Trend, hours_to, judge
from thrustd.records.rows import Row

UNITS = {"load_share": "-", "zero_mm": "mm"}  # of a quantity's values; of the others %
QUANTITIES = {"thrust_at_n1_pct": 0.5, "fuel_at_n1_pct": 1.0, "n2_at_n1_pct": 1.0, "load_share": 0.003}  # least change
SHARE_LIMIT = 0.005  # of the upper mount, 1 % of its stiffness
SLOPES = 0.04, 0.1, 0.2  # of the least change, in a flight: prior sigmas of wear, equally likely
STARTS = 0.3, 0.3, 25.0  # noise and e, %, z, N: where the search for their sizes begins
ALIKE_PCT = 4.0  # of corrected N1: throttles that stand together; nine in ten windows of any PH-LAB flight: 2.2
DAY_S = 86400.0


class Health(msgspec.Struct, frozen=True):
    """One quantity of one engine, of the difference of two, or of one mount."""

    of: str
    quantity: str
    unit: str  # of values, change and, per hour, slope
    hours: list[float]  # flown in all at the end of each flight
    values: list[float]  # at equal conditions, minus their mean
    trend: Trend
    engine: str = ""  # whose change it is; of a difference, the one that wears; empty: nothing changed
    recalibrate_in_h: float = inf  # from the first flight, of mounts
    recalibrate_utc_s: float = float("nan")  # where the logs say when they were recorded


class FleetHealth(msgspec.Struct, frozen=True):
    flights: list[str]
    without_mounts: list[str]  # of the flights: nothing in them measures a thrust
    health: list[Health]
    without_zeros: list[str] = []  # of the flights: tables that were exported with the zeros of their mounts taken off

    def rows(self) -> list[Row]:
        """One per series, its trend's numbers beside it."""
        return [{"of": one.of, "quantity": one.quantity, "unit": one.unit, "engine": one.engine,
                 **msgspec.to_builtins(one.trend), "recalibrate_in_h": one.recalibrate_in_h}
                for one in self.health]  # fmt: skip

    @property
    def changed(self) -> list[Health]:
        return [one for one in self.health if one.trend.changed]


class Design(NamedTuple):
    """Of one regression: y (n,) by what is common (n, c), by flight (n, k) and by its zeros (n, z)."""

    common: Floats
    flown: Floats
    zeros: Floats
    weights: Floats
    y: Floats


def fleet_health(rows: Sequence[Row], quantities: Sequence[str] = tuple(QUANTITIES)) -> FleetHealth:
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
    for quantity in quantities:
        least = QUANTITIES[quantity]
        effects = _effects(points, quantity, engines, files)
        found += [_health(engine, quantity, hours, effects[engine], least) for engine in engines]
        if len(engines) == 2 and quantity != "load_share":
            apart, told = _apart(points, quantity, engines, files, hours)
            one = _health(f"{engines[0]} - {engines[1]}", quantity, hours, apart, least, told)
            whose = _whose(one, quantity, engines) if one.trend.changed else ""
            found.append(msgspec.structs.replace(one, engine=whose))
    found = [_dated(one, SHARE_LIMIT, begun, files) if one.quantity == "load_share" else one for one in found]
    measured = {row["file"] for row in points if np.isfinite(row["thrust_N"])}
    exported = {row["file"] for row in rows if row.get("exported")}
    found += _mounts(rows, files, hours, begun)
    return FleetHealth(files, [f for f in files if f not in measured], found, [f for f in files if f in exported])


def _whose(apart: Health, quantity: str, engines: list[str]) -> str:
    """Of a difference, the first engine minus the second, whose wear it is: wear adds no thrust and saves no fuel."""
    falls = bool(np.nan_to_num(apart.trend.change) < 0.0)
    return engines[0] if falls == (quantity == "thrust_at_n1_pct") else engines[1]


def _effects(points: Sequence[Row], quantity: str, engines: list[str], files: list[str]) -> dict[str, Floats]:
    """Engine -> value per flight (n,) at equal conditions, minus their mean; NaN where a flight has none."""
    used = [row for row in points if np.isfinite(row[quantity])]
    if not used:
        return dict.fromkeys(engines, np.full(len(files), np.nan))
    owners = _ones([engines.index(row["of"]) for row in used], len(engines))
    flown = _ones([engines.index(row["of"]) * len(files) + files.index(row["file"]) for row in used],
                  len(engines) * len(files))  # fmt: skip
    deck_n = _column(used, "deck_N")
    weights = np.sqrt(_column(used, "seconds")) * deck_n
    zeros = flown * (100.0 / deck_n)[:, None]
    design = Design(np.hstack((_conditions(used), owners)), flown, zeros, weights, _column(used, quantity))
    table = _solved(design).values.reshape(len(engines), len(files))
    return {engine: line - np.nanmean(line) if np.isfinite(line).any() else line
            for engine, line in zip(engines, table, strict=True)}  # fmt: skip


def _apart(
    points: Sequence[Row], quantity: str, engines: list[str], files: list[str], hours: Floats
) -> tuple[Floats, Told | None]:
    """First minus second engine where both run alike: value per flight (n,) minus their mean, and its trend."""
    by_window: dict[tuple[str, float], dict[str, Row]] = {}
    for row in points:
        if np.isfinite(row[quantity]):
            by_window.setdefault((row["file"], row["start_s"]), {})[row["of"]] = row
    pairs = [(both[engines[0]], both[engines[1]]) for both in by_window.values() if len(both) == 2 and _alike(both)]
    if not pairs:
        return np.full(len(files), np.nan), None
    first, second = [one for one, _ in pairs], [other for _, other in pairs]
    flown = _ones([files.index(row["file"]) for row in first], len(files))
    deck_n = np.column_stack((_column(first, "deck_N"), _column(second, "deck_N")))
    zeros = flown * (100.0 / deck_n).mean(axis=1)[:, None]  # their difference; what they share falls out
    weights = np.sqrt(_column(first, "seconds") / (1.0 / deck_n**2).sum(axis=1))
    common = np.hstack((_conditions(first), np.ones((len(first), 1))))
    design = Design(common, flown, zeros, weights, _column(first, quantity) - _column(second, quantity))
    gap = float(np.ptp(hours)) / max(len(hours) - 1, 1)
    steady = _solved(design)
    if gap <= 0.0:
        return steady.values - np.nanmean(steady.values), None
    trend = (hours - hours.mean()) / gap
    worn = [_solved(design, trend, share * QUANTITIES[quantity], steady.sizes) for share in SLOPES]
    best = min(worn, key=lambda one: one.unlikely)
    steady = min(steady, _solved(design, sizes=best.sizes), key=lambda one: one.unlikely)  # no better sizes left unseen
    evidence = float(logsumexp([(steady.unlikely - one.unlikely) / 2.0 for one in worn]) - np.log(len(worn)))
    return steady.values - np.nanmean(steady.values), Told(evidence, best.slope / gap, SIGMAS_95 * best.slope_std / gap)


def _alike(engines: dict[str, Row]) -> bool:
    return float(np.ptp([row["n1_corrected_pct"] for row in engines.values()])) < ALIKE_PCT


def _ones(places: list[int], width: int) -> Floats:
    """Rows (n, width) with a one at their place."""
    found = np.zeros((len(places), width))
    found[np.arange(len(places)), places] = 1.0
    return found


def _column(rows: Sequence[Row], name: str) -> Floats:
    return np.array([row[name] for row in rows], dtype=np.float64)


class Solved(NamedTuple):
    unlikely: float  # -2 log of the restricted likelihood
    values: Floats  # (k,) e of each flight, without the trend
    slope: float  # of the trend
    slope_std: float
    sizes: tuple[float, float, float]  # of noise and e, %, and of z, N


def _solved(
    design: Design, wear: Floats | None = None, size: float = 1.0, sizes: tuple[float, float, float] = STARTS
) -> Solved:
    """With the likeliest sizes of noise, e and z, from `sizes` on; `wear` (k,): a trend, prior sigma `size`."""
    common, flown, zeros, weights, y = design
    there, c = np.asarray(flown.any(axis=0)), common.shape[1]
    k, zeros = int(there.sum()), zeros[:, zeros.any(axis=0)]
    weights = weights / float(np.sqrt(np.mean(weights**2)))
    trend = np.zeros((len(y), 1)) if wear is None else (flown @ wear)[:, None]
    columns = np.hstack((common, flown[:, there], zeros, trend)) * weights[:, None]
    squares, moment, whole = columns.T @ columns, columns.T @ (y * weights), float(np.sum((y * weights) ** 2))
    tiny = 1e-9 * float(np.trace(squares)) / len(moment)  # conditions that no flight changed
    squares[np.diag_indices_from(squares)] += 1e-3 * tiny  # flights of a single point leave it singular to rounding

    def posterior(sizes: Floats) -> tuple[tuple[Floats, bool], Floats, float]:
        """Factor of the precision, mean, and log determinant of the precision over that of the trend's prior."""
        noise, of_flight, zero = np.exp(-2.0 * sizes)
        prior = np.repeat((tiny, of_flight, zero, size**-2), (c, k, zeros.shape[1], 1))
        factor = cho_factor(squares * noise + np.diag(prior), check_finite=False)
        determinant = 2.0 * float(np.log(np.diag(factor[0])).sum() + np.log(size))
        return factor, cho_solve(factor, moment * noise, check_finite=False), determinant

    def unlikely(sizes: Floats) -> float:
        _, mean, determinant = posterior(sizes)
        misses = (whole - float(mean @ moment)) * np.exp(-2.0 * sizes[0])
        return float(misses + determinant + 2.0 * (len(y) * sizes[0] + k * sizes[1] + zeros.shape[1] * sizes[2]))

    around = np.log(sizes) + 0.5 * np.vstack((np.zeros(3), np.eye(3)))
    bounds = [(-7.0, 5.0), (-7.0, 5.0), (-3.0, 8.0)]
    options = {"xatol": 0.05, "fatol": 0.05, "initial_simplex": np.clip(around, *np.transpose(bounds))}
    found = minimize(unlikely, around[0], method="Nelder-Mead", bounds=bounds, options=options)
    factor, mean, _ = posterior(found.x)
    values = np.full(flown.shape[1], np.nan)
    values[there] = mean[c : c + k]
    last = cho_solve(factor, np.eye(len(moment))[-1], check_finite=False)[-1]
    noise, of_flight, zero = np.exp(found.x).tolist()
    return Solved(float(found.fun), values, float(mean[-1]), float(np.sqrt(last)), (noise, of_flight, zero))


def _conditions(points: Sequence[Row]) -> Floats:
    """Second order in corrected N1, Mach, pressure, temperature, newtons over thrust; centred, scaled, (n, 20)."""
    names = "n1_corrected_pct", "mach", "pressure_altitude_m", "sat_degC", "deck_N"
    n1, mach, altitude_m, sat_degc, deck_n = (_column(points, name) for name in names)
    delta = static_pressure_pa(altitude_m) / SEA_LEVEL_PA
    scaled = [(column - column.mean()) / max(float(column.std()), 1e-9)
              for column in (n1, mach, delta, sat_degc, 1.0 / deck_n)]  # fmt: skip
    squares = [one * other for place, one in enumerate(scaled) for other in scaled[place:]]
    return np.column_stack((*scaled, *squares))


def _health(of: str, quantity: str, hours: Floats, values: Floats, least: float, told: Told | None = None) -> Health:
    trend = judge(hours, values, least, told)
    of_whom, unit = of if trend.changed else "", UNITS.get(quantity, "%")
    return Health(of, quantity, unit, hours.tolist(), values.tolist(), trend, of_whom)


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
            found.append(_dated(one, DRIFTED_MM, begun, files))
    return found


def _dated(one: Health, limit: float, begun: dict[str, float], files: list[str]) -> Health:
    """With the hour, and the date at the present use, by which it may have moved by `limit`."""
    hours = hours_to(limit, one.trend)
    first_s, seconds, date = begun[files[0]], float(begun[files[-1]] - begun[files[0]]), float("nan")
    if np.isfinite(seconds) and seconds > DAY_S:
        date = first_s + hours * seconds / one.hours[-2]  # flown when the last one began
    return msgspec.structs.replace(one, recalibrate_in_h=hours, recalibrate_utc_s=date)
