"""The thrust surface of a brochure deck from input/output pairs of the brochure program.

Linear least squares on relative errors (Fx / F = 1), in the terms of `thrustd.brochure.deck_data`: ten of a cubic in
fuel flow X and flight speed u, and b_0, b_1, b_2 of the nozzles' expansion. The static reference points take part with
the weight of their own doubt. Pairs that the first fits miss by more than 3 % are left out (the files hold a few rows
that belong to another input). The band of validity comes from leaving out one set of pairs at a time.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace
from scipy.optimize import brentq

from thrustd.brochure.deck import total_ratios
from thrustd.brochure.deck_data import ThrustSurface, corrected_thrust
from thrustd.core.atmosphere import ZERO_CELSIUS_K, isa_k, stagnation
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.measures import rms
from thrustd.records.files import load

SCALE_KG_S = 0.1
SPEED_DEGREE = 3
NOZZLE_TERMS = 3
MACH_LIMIT = 0.95  # pairs above are typing errors of students
FLOW_LIMIT_KG_S = 0.3  # corrected; the take-off rating is 0.177 kg/s
THRUST_FLOOR_N = 300.0
OUTLIER = 0.03
ROUNDS = 4
PAIR_STD = 0.0015  # relative: convergence limits inside the brochure program


class StaticPoint(NamedTuple):
    """Sea level, ISA, Mach 0."""

    fuel_flow_kg_s: float
    thrust_n: float
    relative_std: float  # how far the surface may pass from it


STATIC_POINTS = (
    StaticPoint(0.177, 11121.0, 0.004),  # take-off, Vermeij 1993 table F.1 (in the course AE3212-II)
    StaticPoint(0.164, 10431.0, 0.004),  # maximum cruise, same
)
IDLE_FLOW_KG_S, IDLE_THRUST_N = 0.0261, 778.4  # 7 % of 11.12 kN, ICAO emissions databank row 1PW036


class Pairs(NamedTuple):
    """One engine per row: all (n,)."""

    corrected_kg_s: Floats
    mach: Floats
    corrected_thrust_n: Floats
    group: Floats  # the `set` column


COLUMNS = (
    *("altitude_m", "mach", "deltaT_K", "set"),
    *("fuelflow_left_kg_s", "fuelflow_right_kg_s", "thrust_left_N", "thrust_right_N"),
)


def read_pairs(path: Path) -> Pairs:
    """Rows of `brochure_pairs.csv`: altitude_m, mach, deltaT_K (static minus ISA), fuel flow and thrust, set."""
    rows = load(path).columns
    for name in COLUMNS:
        if name not in rows:
            raise RecordingError(f"{path.name}: no column {name!r}; it has {', '.join(rows)}")
        bad = np.flatnonzero(~np.isfinite(rows[name]))
        if len(bad):
            raise RecordingError(f"{path.name}: {name} in data row {bad[0] + 1} is not a number")
    return Pairs(*np.concatenate([_one_engine(rows, side) for side in ("left", "right")], axis=1))


def _one_engine(rows: Mapping[str, Floats], side: str) -> Floats:
    altitude, mach = rows["altitude_m"], rows["mach"]
    isa_degc = isa_k(altitude) - ZERO_CELSIUS_K
    ratios = [total_ratios(*row) for row in zip(mach, altitude, isa_degc + rows["deltaT_K"], strict=True)]
    delta, theta = np.array(ratios).T
    thrust = rows[f"thrust_{side}_N"]
    flow = rows[f"fuelflow_{side}_kg_s"] / (delta * np.sqrt(np.maximum(theta, 1e-3)))
    keep = (thrust > THRUST_FLOOR_N) & (flow > 0) & (flow < FLOW_LIMIT_KG_S) & (mach < MACH_LIMIT)
    return np.stack([flow, mach, thrust / delta, rows["set"]])[:, keep]


def fit_surface(pairs: Pairs) -> tuple[ThrustSurface, dict[str, float]]:
    """The surface through all pairs, and its errors on sets left out of the fit (relative, -)."""
    terms = _terms(pairs.corrected_kg_s, pairs.mach)
    keep = _without_outliers(terms, pairs)
    surface = _surface(_solve(terms, pairs, keep), pairs, keep)
    left_out = np.full(len(keep), np.nan)
    for group in np.unique(pairs.group):
        rows = pairs.group == group
        left_out[rows] = terms[rows] @ _solve(terms, pairs, keep & ~rows)
    error = left_out / pairs.corrected_thrust_n - 1.0
    static = [corrected_thrust(surface, p.fuel_flow_kg_s, 0.0) / p.thrust_n - 1.0 for p in STATIC_POINTS]
    idle = corrected_thrust(surface, IDLE_FLOW_KG_S, 0.0) / IDLE_THRUST_N - 1.0
    return surface, {
        "pairs_leave_one_set_out_rms": rms(error[keep]),
        "pairs_leave_one_set_out_rms_with_outliers": rms(error),
        "pairs_used": float(keep.sum()),
        "pairs_left_out_as_outliers": float((~keep).sum()),
        "static_take_off": static[0],
        "static_max_cruise": static[1],
        "static_idle": idle,
    }


def _terms(corrected_kg_s: Floats, mach: Floats) -> Floats:
    """Regressors (n, 13): X^i u^j with i + j <= 3, then X^i q."""
    x = corrected_kg_s / SCALE_KG_S
    ratio = stagnation(mach)
    u, q = mach / np.sqrt(ratio), ratio**-3.5 - 1.0
    columns = [x**i * u**j for i in range(SPEED_DEGREE + 1) for j in range(SPEED_DEGREE + 1 - i)]
    return np.stack(columns + [x**i * q for i in range(NOZZLE_TERMS)], axis=1)


def _solve(terms: Floats, pairs: Pairs, keep: npt.NDArray[np.bool_]) -> Floats:
    flow, thrust, std = np.array(STATIC_POINTS).T
    weight = PAIR_STD / (std * thrust)
    rows = terms[keep] / pairs.corrected_thrust_n[keep, None]
    static = _terms(flow, np.zeros(len(flow))) * weight[:, None]
    target = np.concatenate([np.ones(len(rows)), thrust * weight])
    solution: Floats = np.linalg.lstsq(np.concatenate([rows, static]), target, rcond=None)[0]
    return solution


def _without_outliers(terms: Floats, pairs: Pairs) -> npt.NDArray[np.bool_]:
    keep = np.ones(len(terms), dtype=np.bool_)
    for _ in range(ROUNDS):
        keep = np.abs(terms @ _solve(terms, pairs, keep) / pairs.corrected_thrust_n - 1.0) < OUTLIER
    return keep


def _surface(solution: Floats, pairs: Pairs, keep: npt.NDArray[np.bool_]) -> ThrustSurface:
    rows, at = [], 0
    for i in range(SPEED_DEGREE + 1):
        count = SPEED_DEGREE + 1 - i
        rows.append(tuple(solution[at : at + count].tolist()))
        at += count
    flow_low, flow_high = np.percentile(pairs.corrected_kg_s[keep], [0.5, 99.5]).tolist()
    mach_low, mach_high = np.percentile(pairs.mach[keep], [0.5, 99.5]).tolist()
    return _through_idle(
        ThrustSurface(
            fuel_flow_scale_kg_s=SCALE_KG_S,
            speed_n=tuple(rows),
            nozzle_n=tuple(solution[at:].tolist()),
            fuel_flow_box_kg_s=(flow_low, 0.19),
            idle_length_kg_s=1.0,
            mach_box=(0.0, 0.9),
            fitted_fuel_flow_kg_s=(flow_low, flow_high),
            fitted_mach=(mach_low, mach_high),
        )
    )


def _through_idle(surface: ThrustSurface) -> ThrustSurface:
    """Bend the lower extension so that it meets the static idle point (the cubic was never meant to go there)."""

    def miss(length_kg_s: float) -> float:
        bent = replace(surface, idle_length_kg_s=length_kg_s)
        return corrected_thrust(bent, IDLE_FLOW_KG_S, 0.0) - IDLE_THRUST_N

    return replace(surface, idle_length_kg_s=float(brentq(miss, 1e-3, 10.0)))
