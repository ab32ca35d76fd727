"""`thrustd brochure fit`: the spool curves of a brochure deck from recorded flights, so that wear is a re-fit.

In steady flight the fuel flow says what thrust a fan speed stands for (`spool_curves`). The thrust error of the N1
source is taken against the fuel-flow source, on each flight with that flight left out of the fit.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec.structs import replace

from thrustd.brochure.deck import Deck, total_ratios
from thrustd.brochure.deck_data import DeckData, SpoolCurve, ThrustSurface, corrected_thrust, hermite
from thrustd.brochure.fit.spool_curves import Spool, Steady, fit_curves
from thrustd.brochure.fit.surface import fit_surface, read_pairs
from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import DeckError, RecordingError
from thrustd.core.measures import rms
from thrustd.records.files import read_recording
from thrustd.records.once import check_each_once
from thrustd.records.recording import Recording
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import read_text

Rows = npt.NDArray[np.intp]

ENGINES = ("left", "right")
HALF_WINDOW_S = 5.0  # N1 rate from a central difference over twice this
STEADY_PCT_S = 0.1
SETTLE_S = 15.0  # steady for this long before, and one window after
EVERY_S = 2.0
MIN_FLOW_KG_S = 0.015  # below: engine off or starting
SCORE_ABOVE_N = 1000.0  # 9 % of rated: at idle the net thrust crosses zero and a relative error means nothing
MIN_SAMPLES = 30


LeftOut = dict[tuple[int, str], float]  # (engine, flight) -> relative thrust error with that flight left out


class BrochureFit(NamedTuple):
    """The new deck, the errors of its spool sources on flights left out, and what could not be used."""

    data: DeckData
    left_out: LeftOut
    left_out_n2: LeftOut
    remarks: tuple[str, ...]


def brochure_fit(flights: Sequence[Path], base: DeckData) -> BrochureFit:
    """Fit the spool curves to recordings with n1_pct_*, fuel_flow_kg_s_*, mach, pressure_altitude_m, sat_degC."""
    if len(flights) < 2:
        raise RecordingError(f"brochure fit needs at least 2 flights (one is left out in turn), got {len(flights)}")
    records = [read_recording(path) for path in flights]
    check_each_once(records)  # a flight left out would still be in its copy
    remarks: list[str] = []
    n1, left_out = _fit_spool([s for r in records for s in _n1_samples(r, remarks)], "n1", base.thrust)
    core = _in_two_flights([s for r in records for s in steady_samples(r, "n2", [])])
    n2, left_out_n2 = _fit_spool(core, "n2", base.thrust)
    without = [ENGINES[c.engine] for c in n1 if c.engine not in {s.engine for s in core}]
    if without:
        remarks.append(f"N2 in fewer than two flights: no cross-check by N2 for {', '.join(without)}")
    errors = {key: value for key, value in base.errors.items() if "leave_one_flight_out" not in key}
    for spool, curves in (("n1", n1), ("n2", n2)):
        errors |= {f"{spool}_leave_one_flight_out_rms_engine_{c.engine}": c.relative_std for c in curves}
    data = replace(base, n1=tuple(n1), n2=tuple(n2), errors=errors)
    return BrochureFit(data, left_out, left_out_n2, tuple(remarks))


def _n1_samples(record: Recording, remarks: list[str]) -> list[Steady]:
    """Of the source that thrust comes from: one engine at least."""
    why: list[str] = []
    found = steady_samples(record, "n1", why)
    if not found:
        expected = "expected n1_pct_* and fuel_flow_kg_s_* of one engine at least (left, right)"
        raise RecordingError(f"{record.name}: {'; '.join(why)}; {expected}")
    remarks += [f"{record.name}: left out: {line}" for line in why]
    return found


def _in_two_flights(samples: list[Steady]) -> list[Steady]:
    """Of the engines that more than one flight knows: one is left out in turn."""
    flights = {(s.engine, s.flight) for s in samples}
    return [s for s in samples if sum(engine == s.engine for engine, _ in flights) > 1]


def _fit_spool(samples: list[Steady], spool: Spool, surface: ThrustSurface) -> tuple[list[SpoolCurve], LeftOut]:
    left_out: LeftOut = {}
    if not samples:
        return [], left_out
    for name in dict.fromkeys(s.flight for s in samples):
        rest = [s for s in samples if s.flight != name]
        curves = {curve.engine: curve for curve in fit_curves(rest, spool)} if rest else {}
        for s in (s for s in samples if s.flight == name and s.engine in curves):
            left_out[s.engine, name] = thrust_error(s, curves[s.engine], surface)
    return [_with_error(curve, left_out) for curve in fit_curves(samples, spool)], left_out


def steady_samples(record: Recording, spool: Spool, why: list[str]) -> list[Steady]:
    """Steady samples of each engine that the recording knows; `why` is told what is not there of the others."""
    found = []
    for engine, side in enumerate(ENGINES):
        names = (f"{spool}_pct_{side}", f"n1_pct_{side}", f"fuel_flow_kg_s_{side}")
        missing = [name for name in dict.fromkeys(names) if name not in record or np.isnan(record[name]).all()]
        if missing:
            why.append(f"no numbers in {' and '.join(missing)}")
            continue
        speed, n1, flow = (record[name] for name in names)
        mach = np.maximum(record["mach"], 0.0)
        known = np.isfinite(speed + flow + mach + record["pressure_altitude_m"])
        rows = np.flatnonzero(_steady(record, n1) & known & (flow > MIN_FLOW_KG_S))
        rows = rows[:: max(round(EVERY_S * record.sample_hz), 1)]
        if len(rows) < MIN_SAMPLES:
            why.append(
                f"{len(rows)} steady samples of {names[0]} (within {STEADY_PCT_S:g} %/s for {SETTLE_S:g} s, "
                f"fuel flow above {MIN_FLOW_KG_S:g} kg/s), expected {MIN_SAMPLES}"
            )
            continue
        found.append(_as_steady(record, engine, rows, speed[rows], flow[rows]))
    return found


def _as_steady(record: Recording, engine: int, rows: Rows, speed_pct: Floats, flow_kg_s: Floats) -> Steady:
    mach = np.maximum(record["mach"][rows], 0.0)
    columns = (mach, record["pressure_altitude_m"][rows], record["sat_degC"][rows])
    delta, theta = np.array([total_ratios(*row) for row in zip(*columns, strict=True)]).T
    corrected = np.log(flow_kg_s / (delta * np.sqrt(theta)))
    return Steady(record.name, engine, speed_pct / np.sqrt(theta), corrected, mach, delta, np.log(theta))


def _steady(record: Recording, n1_pct: Floats) -> Flags:
    half = max(round(HALF_WINDOW_S * record.sample_hz), 1)
    rate = np.full(len(n1_pct), np.inf)
    rate[half:-half] = (n1_pct[2 * half :] - n1_pct[: -2 * half]) / (2 * HALF_WINDOW_S)
    calm = np.abs(np.nan_to_num(rate, nan=np.inf)) < STEADY_PCT_S
    settle = max(round(SETTLE_S * record.sample_hz), 1)
    # calm from `settle` samples before to `half` samples after, by differences of the running count
    count = np.concatenate(([0], np.cumsum(calm)))
    at = np.arange(len(calm))
    first, last = np.maximum(at - settle, 0), np.minimum(at + half + 1, len(calm))
    steady: Flags = (count[last] - count[first]) == settle + half + 1
    return steady


def thrust_error(s: Steady, curve: SpoolCurve, surface: ThrustSurface) -> float:
    """RMS of a spool source against the fuel-flow source, relative, where thrust is above 1000 N."""
    errors = []
    for n1, log_flow, mach, delta, log_theta in zip(*s[2:], strict=True):
        predicted = hermite(curve, n1) + curve.mach_slope * mach + curve.temperature_exponent * log_theta
        thrust = corrected_thrust(surface, float(np.exp(log_flow)), mach)
        if thrust * delta > SCORE_ABOVE_N:
            errors.append(corrected_thrust(surface, float(np.exp(predicted)), mach) / thrust - 1.0)
    return rms(np.array(errors)) if errors else float("nan")


def _with_error(curve: SpoolCurve, left_out: dict[tuple[int, str], float]) -> SpoolCurve:
    mine = [error for (engine, _), error in left_out.items() if engine == curve.engine and np.isfinite(error)]
    if not mine:
        raise RecordingError(f"engine {ENGINES[curve.engine]}: recorded in one flight only; expected two or more")
    return replace(curve, relative_std=round(rms(np.array(mine)), 5))


def fit_deck_file(flights: Sequence[Path], output: Path, base: Path, pairs: Path | None = None) -> BrochureFit:
    """The verb: a deck from `base` with new spool curves and, with `pairs`, a new thrust surface too; written whole."""
    data = Deck.from_json(read_text(base, DeckError), str(base)).data
    if pairs is not None:
        surface, errors = fit_surface(read_pairs(pairs))
        errors = {name: float(f"{value:.4g}") for name, value in errors.items()}
        data = replace(data, thrust=surface, errors=errors)
    fit = brochure_fit(flights, data)
    sources = f"spool curves: {', '.join(path.name for path in flights)}"
    kept = tuple(line for line in data.provenance if not line.startswith("spool curves: "))
    data = replace(fit.data, provenance=(*kept, sources))
    text = msgspec.json.format(msgspec.json.encode(data), indent=1).decode() + "\n"
    Deck.from_json(text, str(output))  # the same checks as at start-up, before anything is written
    write_whole(output, text, DeckError)
    return fit._replace(data=data)


def report_lines(fit: BrochureFit) -> list[dict[str, Any]]:
    """One row per engine and flight for the table that the verb prints."""
    return [
        {
            "engine": ENGINES[engine],
            "flight": flight,
            "n1_left_out_error_pct": 100.0 * error,
            "n2_left_out_error_pct": 100.0 * fit.left_out_n2[engine, flight]
            if (engine, flight) in fit.left_out_n2
            else None,
        }
        for (engine, flight), error in sorted(fit.left_out.items())
    ]


def rms_left_out_pct(fit: BrochureFit) -> dict[str, dict[Spool, float]]:
    """Engine -> spool -> RMS over the flights left out."""
    found: dict[str, dict[Spool, float]] = {}
    for curve in fit.data.n1:
        found.setdefault(ENGINES[curve.engine], {})["n1"] = 100.0 * curve.relative_std
    for curve in fit.data.n2:
        found.setdefault(ENGINES[curve.engine], {})["n2"] = 100.0 * curve.relative_std
    return found
