"""The twin's JT15D-4: spools, fuel, and a net thrust that is not the brochure deck's.

Net thrust over ambient pressure ratio is a smooth function of the steady fuel flow the fan speed stands for:

    F / delta = c1 p + c2 p^1.5 + c3 p^2 + M (c4 + c5 sqrt(p) + c6 p) + c7 M^2 p
    p = W_f / (delta sqrt(theta)) / 0.177 kg/s

with ambient delta and theta. The seven numbers were fitted once to the brochure program's pairs (0.65 % RMS) and to the
static reference points (take-off 11 121 N at 0.177 kg/s, within 1.6 %); the corrected speed-fuel line is read off three
recorded PH-LAB flights. Fan speed, not fuel, makes the thrust: in a slam the fuel flow leads it by a second.

Below OFF_N1_PCT nothing burns: what flows loses DUCT_LOSS dynamic pressures of the nozzle on its way through.

Every engine has its own `Health`: a bias of 2 to 4 % against that relation, a slow drift, a transient lead or lag, and
its own appetite for fuel, drawn from a seed.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from scipy.interpolate import PchipInterpolator

from thrustd.core.atmosphere import (
    SEA_LEVEL_K,
    SEA_LEVEL_PA,
    dynamic_pressure_pa,
    static_pressure_pa,
    total_pressure_ratio,
    total_temperature_ratio,
)  # fmt: skip
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

Real = TypeVar("Real", float, Floats)

IDLE_N1_PCT = 29.0
TAKE_OFF_N1_PCT = 98.0
OFF_N1_PCT = 5.0  # below: no thrust worth the name
THRUST_C = (-3454.5, 26061.7, -11316.6, -1476.9, 2645.8, -13214.0, 5616.8)  # N
FUEL_REFERENCE_KG_S = 0.177
NOZZLES_M2, DUCT_LOSS = 0.15, 1.0

# corrected N1 [%], corrected fuel flow [g/s], corrected N2 [%], steady
_STEADY = np.array(
    (
        (0.0, 0.0, 0.0),
        (5.0, 0.0, 12.0),
        (20.0, 18.0, 40.0),
        (30.0, 24.8, 49.5),
        (40.0, 30.5, 58.5),
        (47.0, 37.0, 66.0),
        (50.0, 41.5, 68.5),
        (56.0, 49.0, 72.5),
        (61.0, 58.0, 75.7),
        (69.0, 73.5, 80.3),
        (77.0, 93.5, 84.5),
        (84.0, 111.5, 87.2),
        (94.5, 155.0, 92.0),
        (98.5, 172.5, 93.7),
        (106.0, 208.0, 96.5),
        (115.0, 255.0, 99.0),
    )
)
_FUEL_LINE = PchipInterpolator(_STEADY[:, 0], _STEADY[:, 1] / 1000)
_N2_LINE = PchipInterpolator(_STEADY[:, 0], _STEADY[:, 2])


class Health(NamedTuple):
    """How one engine differs from the nominal relation."""

    bias: float  # relative thrust
    drift_per_h: float  # relative thrust
    lead_s: float  # thrust ahead of what N1 says, in transients
    fuel_factor: float  # fuel flow of a scripted flight over the nominal line


def draw_health(rng: np.random.Generator, side: int) -> Health:
    """2 to 4 % of bias with either sign; the right engine (side 1) is the thirsty one, as recorded."""
    return Health(
        bias=float(rng.choice((-1.0, 1.0)) * rng.uniform(0.02, 0.04)),
        drift_per_h=float(rng.normal(0.0, 0.004)),
        lead_s=float(rng.uniform(-0.4, 0.4)),
        fuel_factor=float((0.97, 1.03)[side] + rng.normal(0.0, 0.01)),
    )


@compiled
def net_thrust_n(fuel_kg_s: Real, mach: Real, altitude_m: Real, static_k: Real) -> Real:
    """Nominal net thrust at the *steady* fuel flow `fuel_kg_s` of one engine."""
    c1, c2, c3, c4, c5, c6, c7 = THRUST_C
    delta = static_pressure_pa(altitude_m) / SEA_LEVEL_PA
    p = np.maximum(fuel_kg_s, 0.0) / (delta * np.sqrt(static_k / SEA_LEVEL_K)) / FUEL_REFERENCE_KG_S
    static = c1 * p + c2 * p**1.5 + c3 * p * p
    return delta * (static + mach * (c4 + c5 * np.sqrt(p) + c6 * p) + c7 * mach * mach * p)


def windmilling_n(mach: Floats, altitude_m: Floats) -> Floats:
    """Net thrust (n,) of an engine that burns nothing: rho A V_j (V_j - V), V_j = V / sqrt(1 + loss)."""
    slower = 1.0 / np.sqrt(1.0 + DUCT_LOSS)
    return np.asarray(2.0 * dynamic_pressure_pa(mach, altitude_m) * NOZZLES_M2 * slower * (slower - 1.0))


def steady_fuel_kg_s(n1_pct: Floats, mach: Floats, altitude_m: Floats, static_k: Floats) -> Floats:
    """Nominal fuel flow (n,) that holds a fan speed."""
    theta = total_temperature_ratio(mach, static_k)
    return np.asarray(_FUEL_LINE(n1_pct / np.sqrt(theta)) * total_pressure_ratio(mach, altitude_m) * np.sqrt(theta))


def steady_n2_pct(n1_pct: Floats, mach: Floats, static_k: Floats) -> Floats:
    root = np.sqrt(total_temperature_ratio(mach, static_k))
    return np.asarray(_N2_LINE(n1_pct / root) * root)


@compiled
def _lagged(time_s: Floats, values: Floats, tau_s: float) -> Floats:
    """First-order lag (n,) of what is straight between its samples; neither it nor twice the values less it leaps."""
    out = values.copy()
    for i in range(1, len(values) if tau_s > 0.0 else 0):
        dt_s = time_s[i] - time_s[i - 1]
        behind = tau_s * (values[i] - values[i - 1]) / dt_s
        out[i] = values[i] - behind + (out[i - 1] - values[i - 1] + behind) * np.exp(-dt_s / tau_s)
    return out


def true_thrust_n(
    time_s: Floats,
    n1_pct: Floats,
    mach: Floats,
    altitude_m: Floats,
    static_k: Floats,
    health: Health,
    fuel_ratio: float = 1.0,
) -> Floats:
    """Net thrust (n,) of one engine. `fuel_ratio`: this engine's steady fuel flow over the nominal line."""
    speed_pct = n1_pct + np.sign(health.lead_s) * (n1_pct - _lagged(time_s, n1_pct, abs(health.lead_s)))
    fuel_kg_s = fuel_ratio * steady_fuel_kg_s(np.clip(speed_pct, 0.0, 115.0), mach, altitude_m, static_k)
    nominal_n = net_thrust_n(fuel_kg_s, mach, altitude_m, static_k)
    own = 1.0 + health.bias + health.drift_per_h * (time_s - time_s[0]) / 3600.0
    running = np.clip((n1_pct - OFF_N1_PCT) / OFF_N1_PCT, 0.0, 1.0)
    return np.asarray(nominal_n * own * running + (1.0 - running) * windmilling_n(mach, altitude_m))


def fuel_ratio(
    time_s: Floats,
    n1_pct: Floats,
    fuel_kg_s: Floats,
    mach: Floats,
    altitude_m: Floats,
    static_k: Floats,
) -> float:
    """Median of recorded over nominal fuel flow where the fan speed is steady and above idle."""
    steady = (np.abs(np.gradient(n1_pct, time_s)) < 0.1) & (n1_pct > 50.0)
    if steady.sum() < 10:
        return 1.0
    nominal = steady_fuel_kg_s(n1_pct[steady], mach[steady], altitude_m[steady], static_k[steady])
    return float(np.median(fuel_kg_s[steady] / nominal))


@compiled
def spool_rate_pct_s(n1_pct: float, wanted_pct: float, altitude_m: float) -> float:
    """dN1/dt of a governed engine: slow near idle, quick near the top; idle to take-off in 8 to 13 s."""
    thin = static_pressure_pa(altitude_m) / SEA_LEVEL_PA
    limit = (1.6 + 13.5 * (max(n1_pct, 0.0) / 100.0) ** 1.6) * (0.5 + 0.5 * thin)
    if n1_pct < IDLE_N1_PCT - 2.0:
        limit = 1.2  # starter and light-up
    rate = (wanted_pct - n1_pct) / 0.9
    return min(max(rate, -1.8 * limit - 4.0), limit)


def fuel_lead_kg_s(n1_pct: Floats, time_s: Floats, steady_kg_s: Floats) -> Floats:
    """Over- or underfuelling that accelerates the spools: proportional to dN1/dt."""
    return np.asarray(steady_kg_s * np.clip(1.0 + 0.04 * np.gradient(n1_pct, time_s), 0.6, 1.5))


def engine_columns(
    time_s: Floats, n1_pct: Floats, air: tuple[Floats, Floats, Floats], health: Health
) -> dict[str, Floats]:
    """What an engine does along N1, (n,) each; `air`: Mach, altitude m, static temperature K."""
    return {
        "n1_pct": n1_pct,
        "n2_pct": steady_n2_pct(n1_pct, air[0], air[2]),
        "fuel_flow_kg_s": health.fuel_factor * fuel_lead_kg_s(n1_pct, time_s, steady_fuel_kg_s(n1_pct, *air)),
        "thrust_N": true_thrust_n(time_s, n1_pct, *air, health, health.fuel_factor),
    }
