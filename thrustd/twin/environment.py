"""What surrounds a mount while it is measured: quiet on the bench, everything moving in the aircraft.

Every channel of a moving record has a random programme of its own (levels held for a while, wandering, single
manoeuvres), so that no two of them look alike for two hours; where physics couples them (fan speed and thrust,
vibration and fan speed, dynamic pressure and Mach number) they are coupled.
"""

import numpy as np
from scipy.signal import lfilter

from thrustd.bench.programme import Levels, multisine, random_steps
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats

LOW_N = 700.0  # a measured mount stays inside the range that its bench covered
HIGH_N = 6200.0
ROOM_DEG_C = 20.0
HYDRAULIC_BAR = 103.0  # Citation II: 1500 psi
Channels = dict[str, Floats]


def bench_force_n(seconds: float, sample_hz: float, rng: np.random.Generator) -> Floats:
    """Steps for two thirds of the time, then a multisine: both are needed to identify the dynamics."""
    stepping_s = round(seconds * 2 / 3)
    steps_n = random_steps(stepping_s, sample_hz, rng, Levels(hold_s=(40.0, 240.0), ramp_s=(1.0, 6.0)))
    return np.concatenate((steps_n, multisine(seconds - stepping_s, sample_hz, rng)))


def flight_force_n(seconds: float, sample_hz: float, rng: np.random.Generator) -> Floats:
    """Throttle steps with the ramps of an engine, small corrections on top."""
    steps_n = random_steps(seconds, sample_hz, rng, Levels(LOW_N, HIGH_N, (20.0, 200.0), (2.0, 10.0)))
    trimmed_n = steps_n + wander(len(steps_n), sample_hz, 6.0, rng) * 40.0
    return np.clip(trimmed_n, LOW_N, HIGH_N)


def quiet(count: int, sample_hz: float) -> Channels:
    """The bench: constant temperature, 1 g, nothing shakes, no air moves."""
    constants = {
        "accel_x_g": 0.0,
        "accel_y_g": 0.0,
        "accel_z_g": 1.0,
        "temperature_degC": ROOM_DEG_C,
        "vibration_mm_s": 0.0,
        "n1_pct": 0.0,
        "fuel_flow_kg_s": 0.0,
        "mach": 0.0,
        "pressure_altitude_m": 0.0,
        "dynamic_pressure_Pa": 0.0,
        "hydraulic_pressure_bar": HYDRAULIC_BAR,
        "bleed_valve_pct": 0.0,
    }
    return {name: np.full(count, value) for name, value in constants.items()}


def moving(force_n: Floats, sample_hz: float, rng: np.random.Generator) -> Channels:
    """A flight around a force programme (n,)."""
    count = len(force_n)
    seconds = count / sample_hz
    mach = np.clip(0.32 + 0.07 * wander(count, sample_hz, 150.0, rng), 0.15, 0.5)
    altitude_m = np.clip(4000.0 + 1500.0 * wander(count, sample_hz, 600.0, rng), 300.0, 9000.0)
    n1_pct = 42.0 + 52.0 * np.sqrt(np.clip(force_n, 0.0, None) / 6500.0) + 3.0 * wander(count, sample_hz, 90.0, rng)
    return {
        "accel_x_g": 0.05 + 0.06 * wander(count, sample_hz, 8.0, rng) + 0.05 * wander(count, sample_hz, 60.0, rng),
        "accel_y_g": 0.02 * wander(count, sample_hz, 3.0, rng),
        "accel_z_g": _load_factor(seconds, sample_hz, rng)[:count],
        "temperature_degC": _warming(count, sample_hz, rng),
        "vibration_mm_s": _vibration(n1_pct, sample_hz, rng),
        "n1_pct": n1_pct,
        "fuel_flow_kg_s": 0.02 + 0.1 * (force_n / 6500.0) + 0.004 * wander(count, sample_hz, 120.0, rng),
        "mach": mach,
        "pressure_altitude_m": altitude_m,
        "dynamic_pressure_Pa": dynamic_pressure_pa(mach, altitude_m),
        "hydraulic_pressure_bar": HYDRAULIC_BAR + _levels(seconds, sample_hz, rng, -18.0, 12.0, (20.0, 150.0))[:count],
        "bleed_valve_pct": _levels(seconds, sample_hz, rng, 0.0, 100.0, (30.0, 240.0))[:count],
    }


def wander(count: int, sample_hz: float, correlation_s: float, rng: np.random.Generator) -> Floats:
    """Smooth random signal (n,) with zero mean and unit variance in the long run: noise through two lags."""
    keep = np.exp(-1 / (sample_hz * correlation_s))
    noise = rng.standard_normal(count)
    gain = np.sqrt((1 - keep**2) ** 3 / (1 + keep**2))  # variance of the two lags in series
    start = lfilter(
        [gain], [1, -2 * keep, keep**2], rng.standard_normal(min(count, round(8 * sample_hz * correlation_s)))
    )
    state = _carry(start, keep)
    smooth, _ = lfilter([gain], [1, -2 * keep, keep**2], noise, zi=state)
    return np.asarray(smooth)


def _carry(past: Floats, keep: float) -> Floats:
    """Filter state after `past`, so that a signal does not start at zero."""
    last, before = (float(past[-1]), float(past[-2])) if len(past) > 1 else (0.0, 0.0)
    return np.array([2 * keep * last - keep**2 * before, -(keep**2) * last])


def _levels(
    seconds: float, sample_hz: float, rng: np.random.Generator, low: float, high: float, hold_s: tuple[float, float]
) -> Floats:
    start = float(rng.uniform(low, high))
    return random_steps(seconds, sample_hz, rng, Levels(low, high, hold_s, (1.0, 8.0), start))


def _load_factor(seconds: float, sample_hz: float, rng: np.random.Generator) -> Floats:
    """Level flight, turns up to 1.7 g, push-overs down to 0.2 g; gusts."""
    count = round(seconds * sample_hz)
    load_g = np.ones(count)
    at = 0
    while at < count:
        at += round(rng.uniform(15, 90) * sample_hz)
        turning = rng.random() < 0.7
        length = round((rng.uniform(15, 50) if turning else rng.uniform(4, 9)) * sample_hz)
        extra = rng.uniform(0.15, 0.7) if turning else rng.uniform(-0.8, -0.3)
        shape = np.clip(4 * np.sin(np.linspace(0, np.pi, length)), 0.0, 1.0)
        part = load_g[at : at + length]
        part += extra * shape[: len(part)]
        at += length
    return load_g + 0.04 * wander(count, sample_hz, 1.0, rng)


def _warming(count: int, sample_hz: float, rng: np.random.Generator) -> Floats:
    time_s = np.arange(count) / sample_hz
    rise_k = rng.uniform(15.0, 35.0) * -np.expm1(-time_s / rng.uniform(900.0, 3600.0))
    return ROOM_DEG_C + rise_k + 2.0 * wander(count, sample_hz, 400.0, rng)


def _vibration(n1_pct: Floats, sample_hz: float, rng: np.random.Generator) -> Floats:
    """Rotor imbalance: grows with the square of the speed, a resonance on the way, an amplitude that changes."""
    resonance = 8.0 * np.exp(-(((n1_pct - rng.uniform(65, 85)) / 6.0) ** 2))
    unrest = 1.0 + 0.35 * wander(len(n1_pct), sample_hz, 120.0, rng)
    return np.clip((3.0 + 9.0 * (n1_pct / 100) ** 2 + resonance) * unrest, 0.2, None)
