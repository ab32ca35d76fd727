"""Where the twin's flight comes from: a script flown by a point mass, or a real recording.

Both give a *profile*: a Recording of what the aircraft did (spool speeds, fuel, air data, specific forces) with the
true thrust of each engine added. The script starts with the engines off, starts them, takes off and flies random
throttle steps, climbs, descents, turns, pull-ups and parabolas.

    m dV/dt = T - D - m g sin gamma,   V dgamma/dt = g (n cos roll - cos gamma),   D = q S (C_D0 + k C_L^2)

Body specific force: f_x = f_t cos alpha + n sin alpha, f_z = n cos alpha - f_t sin alpha, with f_t = (T - D) / (m g).
"""

from typing import NamedTuple

import numpy as np

from thrustd.core.atmosphere import (
    SEA_LEVEL_PA,
    ZERO_CELSIUS_K,
    dynamic_pressure_pa,
    isa_k,
    sound_m_s,
    stagnation,
    static_pressure_pa,
)  # fmt: skip
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.engine import (
    Health,
    engine_columns,
    fuel_ratio,
    net_thrust_n,
    spool_rate_pct_s,
    true_thrust_n,
)
from thrustd.twin.engine_start import SIDES, with_engine_start
from thrustd.twin.script import Commands, draw_commands

SCRIPT_HZ = 20.0
MASS_KG = 6000.0
WING_M2 = 30.0
DRAG_0 = 0.04  # TU Delft course AE3212-II, clean Citation II
DRAG_LIFT = 1 / (np.pi * 8.44 * 0.8)
LIFT_SLOPE_PER_RAD = 5.084
ZERO_LIFT_RAD = -0.0175
ROTATE_M_S = 55.0
ROLLING = 0.02
N1_TO_FUEL = 0.177  # kg/s at full thrust, for the drag loop's own thrust
CRUISE_M_S = (80.0, 135.0)
NEEDED = ("mach", "pressure_altitude_m", "sat_degC", "accel_x_g", "accel_z_g")


class Motion(NamedTuple):
    """Results of the point mass, each (n,)."""

    n1_left: Floats
    n1_right: Floats
    speed_m_s: Floats
    altitude_m: Floats
    accel_x_g: Floats
    accel_z_g: Floats
    pitch_deg: Floats


def scripted(seconds: float, seed: int, healths: tuple[Health, ...]) -> Recording:
    """A scripted flight of at least `seconds`, repeatable by its seed."""
    rng = np.random.default_rng([seed, 2])
    commands = draw_commands(seconds, SCRIPT_HZ, rng)
    count = len(commands.n1_left)
    gust_g = _gusts(rng, count)
    day_k = float(rng.uniform(-12, 15))
    motion = Motion(*(np.zeros(count) for _ in Motion._fields))
    _fly(commands, 1 / SCRIPT_HZ, gust_g, day_k, motion)
    time_s = np.arange(count) / SCRIPT_HZ
    static_k = isa_k(motion.altitude_m) + day_k
    mach = motion.speed_m_s / sound_m_s(static_k)
    columns = {
        "time_s": time_s,
        "mach": mach,
        "pressure_altitude_m": motion.altitude_m,
        "sat_degC": static_k - ZERO_CELSIUS_K,
        "tat_degC": static_k * stagnation(mach) - ZERO_CELSIUS_K,
        "accel_x_g": motion.accel_x_g,
        "accel_y_g": 0.4 * np.roll(gust_g, count // 3),
        "accel_z_g": motion.accel_z_g,
        "pitch_deg": motion.pitch_deg,
    }
    for side, n1_pct, health in zip(SIDES, (motion.n1_left, motion.n1_right), healths, strict=True):
        engine = engine_columns(time_s, n1_pct, (mach, motion.altitude_m, static_k), health)
        columns |= {f"{name}_{side}": column for name, column in engine.items()}
    return make_recording(f"scripted_seed{seed}", columns, {"source": "twin script", "seed": str(seed)})


def as_flown(record: Recording, healths: tuple[Health, ...], engine_start: bool = False) -> Recording:
    """A real recording as a profile: everything as flown, only the true thrust is simulated.

    Missing values are bridged. Needs Mach, altitude, temperature, accelerations, N1 and fuel flow of both engines.
    `engine_start`: behind a start of the engines, see `engine_start`.
    """
    needed = (*NEEDED, *(f"{name}_{side}" for name in ("n1_pct", "fuel_flow_kg_s") for side in SIDES))
    for name in needed:
        if name not in record.channels or not np.isfinite(record[name]).any():
            raise RecordingError(f"{record.name}: no values in column {name!r}, which the twin needs to fly it")
    record = record.with_channels(**{name: _bridged(record.time_s, c) for name, c in record.channels.items()})
    if engine_start:
        record = with_engine_start(record)
    channels = dict(record.channels)
    static_k = channels["sat_degC"] + ZERO_CELSIUS_K
    air = (channels["mach"], channels["pressure_altitude_m"], static_k)
    for side, health in zip(SIDES, healths, strict=True):
        n1_pct = np.maximum(channels[f"n1_pct_{side}"], 0.0)
        ratio = fuel_ratio(record.time_s, n1_pct, channels[f"fuel_flow_kg_s_{side}"], *air)
        channels[f"thrust_N_{side}"] = true_thrust_n(record.time_s, n1_pct, *air, health, ratio)
    channels.setdefault("accel_y_g", np.zeros(len(record)))
    channels.setdefault("tat_degC", static_k * stagnation(channels["mach"]) - ZERO_CELSIUS_K)
    return make_recording(
        record.name, {"time_s": record.time_s, **channels}, record.metadata, record.sha256, record.notes
    )


def _bridged(time_s: Floats, column: Floats) -> Floats:
    good = np.isfinite(column)
    return column if good.all() or not good.any() else np.interp(time_s, time_s[good], column[good])


def _gusts(rng: np.random.Generator, count: int) -> Floats:
    """Light turbulence, g: white noise through a first-order lag of 0.4 s, 0.02 g RMS."""
    keep = np.exp(-1 / (0.4 * SCRIPT_HZ))
    noise = rng.standard_normal(count) * 0.02 * np.sqrt(1 - keep**2)
    for i in range(1, count):
        noise[i] += keep * noise[i - 1]
    return noise


ROTATES_S = 1.5  # lag of the angle of attack, a rotation of some 3 s


@compiled
def _fly(commands: Commands, dt_s: float, gust_g: Floats, day_k: float, out: Motion) -> None:
    """Integrate the point mass along the commands (explicit Euler; 20 Hz is fast against its seconds)."""
    left = right = 0.0
    speed = height = gamma = 0.0
    load, alpha = 1.0, 0.0
    for i in range(commands.n1_left.size):
        left += dt_s * spool_rate_pct_s(left, commands.n1_left[i], height)
        right += dt_s * spool_rate_pct_s(right, commands.n1_right[i], height)
        static_k = isa_k(height) + day_k
        mach = speed / sound_m_s(static_k)
        delta = static_pressure_pa(height) / SEA_LEVEL_PA
        thrust_n = 0.0
        for n1_pct in (left, right):
            fuel = N1_TO_FUEL * delta * (max(n1_pct - 15.0, 0.0) / 85.0) ** 1.9
            thrust_n += net_thrust_n(fuel, mach, height, static_k)
        weight_n = MASS_KG * STANDARD_GRAVITY_M_S2
        pressure = max(dynamic_pressure_pa(mach, height), 1.0)
        flying = height > 0.0 or (speed > ROTATE_M_S and commands.gamma_rad[i] > 0.0)
        wanted = _wanted_load(commands, i, gamma, speed, height) if flying else 1.0
        load += dt_s / 0.7 * (wanted - load)
        felt = load + (gust_g[i] if flying else 0.1 * gust_g[i])
        lift = felt * weight_n / (pressure * WING_M2) if flying else 0.0
        drag_n = pressure * WING_M2 * (DRAG_0 + DRAG_LIFT * lift * lift)
        if not flying:
            drag_n += ROLLING * weight_n if commands.brake[i] == 0.0 else max(thrust_n, 0.0)
        along = (thrust_n - drag_n) / weight_n
        if not flying and speed <= 0.0:
            along = max(along, 0.0)
        speed = max(speed + dt_s * STANDARD_GRAVITY_M_S2 * (along - np.sin(gamma)), 0.0)
        if flying:
            turn = load * np.cos(commands.bank_rad[i]) - np.cos(gamma)
            gamma += dt_s * STANDARD_GRAVITY_M_S2 * turn / max(speed, 40.0)
        height = max(height + dt_s * speed * np.sin(gamma), 0.01 if flying else 0.0)
        settled = ZERO_LIFT_RAD + lift / LIFT_SLOPE_PER_RAD if flying else 0.0
        alpha += dt_s / ROTATES_S * (settled - alpha)  # no aircraft rotates within one sample
        out.n1_left[i], out.n1_right[i] = left, right
        out.speed_m_s[i], out.altitude_m[i] = speed, height
        out.accel_x_g[i] = along * np.cos(alpha) + felt * np.sin(alpha)
        out.accel_z_g[i] = felt * np.cos(alpha) - along * np.sin(alpha)
        out.pitch_deg[i] = np.degrees(gamma + alpha)


@compiled
def _wanted_load(commands: Commands, i: int, gamma: float, speed: float, height: float) -> float:
    """Load factor that was asked for, or the one that steers to the path angle, keeps the speed and the ground away."""
    if commands.load_g[i] == commands.load_g[i]:  # not NaN
        return commands.load_g[i]
    low, high = CRUISE_M_S
    wanted = commands.gamma_rad[i] + 0.012 * (min(speed - low, 0.0) + max(speed - high, 0.0))
    wanted += 0.08 * max(1.0 - height / 800.0, 0.0)
    rate = min(max((wanted - gamma) / 2.5, -0.06), 0.06)
    return float((np.cos(gamma) + max(speed, 40.0) * rate / STANDARD_GRAVITY_M_S2) / np.cos(commands.bank_rad[i]))
