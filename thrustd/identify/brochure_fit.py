"""`thrustd brochure fit`: the N1 curves of a brochure deck from recorded flights, so that wear is a re-fit.

In steady flight the fuel flow says what thrust a fan speed stands for. Corrected to standard conditions (see
`thrustd.brochure.deck`), over all flights and both engines at once,

    ln w = H_engine(n) + k M + e ln theta_t

with H piecewise linear between knots, held smooth by its second differences (one linear least-squares problem, every
flight of equal weight), then made a monotone cubic. k and e are common to all engines: they are the engine type's,
and one flight covers too little of them. The thrust error of the N1 route is
taken on each flight with that flight left out.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec.structs import replace

from thrustd.brochure.deck import Deck, total_ratios
from thrustd.brochure.deck_data import DeckData, N1Curve, ThrustSurface, corrected_thrust, hermite
from thrustd.errors import DeckError, RecordingError
from thrustd.identify.brochure_pairs import fit_surface, read_pairs
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ENGINES = ("left", "right")
KNOTS_PCT = np.array([25.0, 31, 38, 46, 54, 61, 67, 73, 80, 88, 96, 105])  # corrected N1
SMOOTHNESS = 0.3  # weight of a second difference against one flight
HALF_WINDOW_S = 5.0  # N1 rate from a central difference over twice this
STEADY_PCT_S = 0.1
SETTLE_S = 15.0  # steady for this long before, and one window after
EVERY_S = 2.0
MIN_FLOW_KG_S = 0.015  # below: engine off or starting
SCORE_ABOVE_N = 1000.0  # 9 % of rated: at idle the net thrust crosses zero and a relative error means nothing
MIN_SAMPLES = 30


class Steady(NamedTuple):
    """Steady samples of one engine in one flight, all (n,)."""

    flight: str
    engine: int
    corrected_n1_pct: Array
    log_flow: Array  # of corrected fuel flow [kg/s]
    mach: Array
    delta_t: Array
    log_theta_t: Array


class BrochureFit(NamedTuple):
    """The new deck and, per (engine, flight), the relative thrust error of the N1 route with that flight left out."""

    data: DeckData
    left_out: dict[tuple[int, str], float]
    samples: dict[tuple[int, str], int]


def brochure_fit(flights: Sequence[Path], base: DeckData) -> BrochureFit:
    """Fit the N1 curves to recordings with n1_pct_*, fuel_flow_kg_s_*, mach, pressure_altitude_m, sat_degC."""
    if len(flights) < 2:
        raise RecordingError(f"brochure fit needs at least 2 flights (one is left out in turn), got {len(flights)}")
    samples = [steady for path in flights for steady in steady_samples(read_recording(path))]
    left_out: dict[tuple[int, str], float] = {}
    for name in dict.fromkeys(s.flight for s in samples):
        rest = [s for s in samples if s.flight != name]
        curves = {curve.engine: curve for curve in fit_curves(rest)}
        for s in (s for s in samples if s.flight == name and s.engine in curves):
            left_out[s.engine, name] = thrust_error(s, curves[s.engine], base.thrust)
    curves_all = [_with_error(curve, left_out) for curve in fit_curves(samples)]
    errors = {
        **{key: value for key, value in base.errors.items() if not key.startswith("n1_")},
        **{f"n1_leave_one_flight_out_rms_engine_{c.engine}": c.relative_std for c in curves_all},
    }
    data = replace(base, n1=tuple(curves_all), errors=errors)
    return BrochureFit(data, left_out, {(s.engine, s.flight): len(s.mach) for s in samples})


def steady_samples(record: Recording) -> list[Steady]:
    """Steady samples of each engine that the recording knows."""
    found = []
    for engine, side in enumerate(ENGINES):
        n1_name, flow_name = f"n1_pct_{side}", f"fuel_flow_kg_s_{side}"
        if n1_name not in record or flow_name not in record:
            continue
        n1, flow, mach = record[n1_name], record[flow_name], np.maximum(record["mach"], 0.0)
        rows = np.flatnonzero(_steady(record, n1) & np.isfinite(flow + mach) & (flow > MIN_FLOW_KG_S))
        rows = rows[:: max(round(EVERY_S * record.sample_hz), 1)]
        if len(rows) < MIN_SAMPLES:
            raise RecordingError(f"{record.name}: {len(rows)} steady samples of {n1_name}; expected {MIN_SAMPLES}")
        columns = (mach[rows], record["pressure_altitude_m"][rows], record["sat_degC"][rows])
        delta, theta = np.array([total_ratios(*row) for row in zip(*columns, strict=True)]).T
        corrected = np.log(flow[rows] / (delta * np.sqrt(theta)))
        found.append(
            Steady(record.name, engine, n1[rows] / np.sqrt(theta), corrected, mach[rows], delta, np.log(theta))
        )
    if not found:
        raise RecordingError(f"{record.name}: no engine with n1_pct_* and fuel_flow_kg_s_* (left, right)")
    return found


def _steady(record: Recording, n1_pct: Array) -> Mask:
    half = max(round(HALF_WINDOW_S * record.sample_hz), 1)
    rate = np.full(len(n1_pct), np.inf)
    rate[half:-half] = (n1_pct[2 * half :] - n1_pct[: -2 * half]) / (2 * HALF_WINDOW_S)
    calm = np.abs(np.nan_to_num(rate, nan=np.inf)) < STEADY_PCT_S
    settle = max(round(SETTLE_S * record.sample_hz), 1)
    # calm from `settle` samples before to `half` samples after, by differences of the running count
    count = np.concatenate(([0], np.cumsum(calm)))
    at = np.arange(len(calm))
    first, last = np.maximum(at - settle, 0), np.minimum(at + half + 1, len(calm))
    steady: Mask = (count[last] - count[first]) == settle + half + 1
    return steady


def fit_curves(samples: Sequence[Steady]) -> list[N1Curve]:
    """One curve per engine; k and e shared by all of them."""
    engines = sorted({s.engine for s in samples})
    n = len(KNOTS_PCT)
    width = n * len(engines) + 2
    rows, targets = [], []
    for s in samples:
        weight = 1.0 / np.sqrt(len(s.mach))
        block = np.zeros((len(s.mach), width))
        at = n * engines.index(s.engine)
        block[:, at : at + n] = _hats(s.corrected_n1_pct)
        block[:, -2], block[:, -1] = s.mach, s.log_theta_t
        rows.append(block * weight)
        targets.append(s.log_flow * weight)
    for i in range(len(engines)):
        bend = np.zeros((n - 2, width))
        bend[:, n * i : n * (i + 1)] = _second_differences() * SMOOTHNESS
        rows.append(bend)
        targets.append(np.zeros(n - 2))
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=None)[0]
    return [
        _curve(engine, solution[n * i : n * (i + 1)], solution[-2:], [s for s in samples if s.engine == engine])
        for i, engine in enumerate(engines)
    ]


def _hats(n1_pct: Array) -> Array:
    """Weights (n, knots) of linear interpolation, carried on beyond the ends."""
    right = np.clip(np.searchsorted(KNOTS_PCT, n1_pct, side="right"), 1, len(KNOTS_PCT) - 1)
    part = (n1_pct - KNOTS_PCT[right - 1]) / (KNOTS_PCT[right] - KNOTS_PCT[right - 1])
    weights = np.zeros((len(n1_pct), len(KNOTS_PCT)))
    at = np.arange(len(n1_pct))
    weights[at, right - 1], weights[at, right] = 1.0 - part, part
    return weights


def _second_differences() -> Array:
    """Change of slope at every inner knot, per 10 % of N1."""
    steps = np.diff(KNOTS_PCT) / 10.0
    rows = np.zeros((len(KNOTS_PCT) - 2, len(KNOTS_PCT)))
    for i in range(len(rows)):
        rows[i, i : i + 3] = 1 / steps[i], -1 / steps[i] - 1 / steps[i + 1], 1 / steps[i + 1]
    return rows


def _curve(engine: int, values: Array, shared: Array, samples: Sequence[Steady]) -> N1Curve:
    secants = np.diff(values) / np.diff(KNOTS_PCT)
    if not (secants > 0).all():
        where = KNOTS_PCT[int(np.argmin(secants))]
        raise RecordingError(
            f"engine {ENGINES[engine]}: fuel flow falls with N1 above {where:g} %: not a usable flight"
        )
    # harmonic means of the neighbouring secants: Fritsch & Butland 1984, monotone
    inner = 2.0 / (1.0 / secants[:-1] + 1.0 / secants[1:])
    n1 = np.concatenate([s.corrected_n1_pct for s in samples])
    return N1Curve(
        engine=engine,
        corrected_n1_pct=tuple(KNOTS_PCT.tolist()),
        log_fuel_flow=tuple(np.round(values, 6).tolist()),
        slope_per_pct=tuple(np.round([secants[0], *inner, secants[-1]], 7).tolist()),
        mach_slope=round(float(shared[0]), 5),
        temperature_exponent=round(float(shared[1]), 5),
        fitted_n1_pct=(round(float(n1.min()), 2), round(float(n1.max()), 2)),
        relative_std=1.0,  # until it is measured on flights left out
    )


def thrust_error(s: Steady, curve: N1Curve, surface: ThrustSurface) -> float:
    """RMS of the N1 route against the fuel-flow route, relative, where thrust is above 1000 N."""
    errors = []
    for n1, log_flow, mach, delta, log_theta in zip(*s[2:], strict=True):
        predicted = hermite(curve, n1) + curve.mach_slope * mach + curve.temperature_exponent * log_theta
        thrust = corrected_thrust(surface, float(np.exp(log_flow)), mach)
        if thrust * delta > SCORE_ABOVE_N:
            errors.append(corrected_thrust(surface, float(np.exp(predicted)), mach) / thrust - 1.0)
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")


def _with_error(curve: N1Curve, left_out: dict[tuple[int, str], float]) -> N1Curve:
    mine = [error for (engine, _), error in left_out.items() if engine == curve.engine and np.isfinite(error)]
    if not mine:
        raise RecordingError(f"engine {ENGINES[curve.engine]}: recorded in one flight only; expected two or more")
    return replace(curve, relative_std=round(float(np.sqrt(np.mean(np.square(mine)))), 5))


def fit_deck_file(flights: Sequence[Path], output: Path, base: Path, pairs: Path | None = None) -> BrochureFit:
    """The verb: a deck from `base` with new N1 curves and, with `pairs`, a new thrust surface too; written whole."""
    data = Deck.from_json(_read_text(base), str(base)).data
    if pairs is not None:
        surface, errors = fit_surface(read_pairs(pairs))
        errors = {name: float(f"{value:.4g}") for name, value in errors.items()}
        data = replace(data, thrust=surface, errors=errors)
    fit = brochure_fit(flights, data)
    sources = f"N1 curves: {', '.join(path.name for path in flights)}"
    kept = tuple(line for line in data.provenance if not line.startswith("N1 curves: "))
    data = replace(fit.data, provenance=(*kept, sources))
    text = msgspec.json.format(msgspec.json.encode(data), indent=1).decode() + "\n"
    Deck.from_json(text, str(output))  # the same checks as at start-up, before anything is written
    _write_text(output, text)
    return fit._replace(data=data)


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DeckError(f"{path}: cannot be read: {error}") from None


def _write_text(path: Path, text: str) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        raise DeckError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        part.unlink(missing_ok=True)


def report_lines(fit: BrochureFit) -> list[dict[str, Any]]:
    """One row per engine and flight for the table that the verb prints."""
    return [
        {
            "engine": ENGINES[engine],
            "flight": flight,
            "samples": fit.samples[engine, flight],
            "left_out_error_pct": 100.0 * error,
        }
        for (engine, flight), error in sorted(fit.left_out.items())
    ]
