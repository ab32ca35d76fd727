"""The latest readings as the deck and the monitor want them, at one fused step. Missing or stale is NaN."""

from collections.abc import Sequence
from math import nan
from typing import NamedTuple

from thrustd.brochure.deck import DeckEstimate, DeckInputs
from thrustd.fusion.monitor_inputs import MonitorInputs, Sensor
from thrustd.fusion.watches import ENGINE_SIGNALS
from thrustd.mount_route import MountState
from thrustd.sync.hold import Hold

AIR_PRESSURE_SEA_LEVEL_PA = 101325.0  # ISO 2533
HEAT_RATIO = 1.4  # air
AIR_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC")
AIRCRAFT_SIGNALS = (*AIR_SIGNALS, "accel_x_g", "accel_y_g", "accel_z_g")


class Latest(NamedTuple):
    """What the hold has at one instant; by engine, or of the aircraft."""

    fuel_flow_kg_s: tuple[float, ...]
    n1_pct: tuple[float, ...]
    n2_pct: tuple[float, ...]
    mach: float
    pressure_altitude_m: float
    sat_degc: float
    accel_x_g: float
    accel_y_g: float
    accel_z_g: float


def latest(hold: Hold, t_ns: int, engines: range) -> Latest:
    values, place = hold.values(t_ns), hold.place
    fuel_flow, n1, n2 = [tuple([values[place(name, e)] for e in engines]) for name in ENGINE_SIGNALS]
    return Latest(fuel_flow, n1, n2, *[values[place(name)] for name in AIRCRAFT_SIGNALS])


def deck_inputs(now: Latest, engine: int, n1_rate_pct_s: float, without: frozenset[Sensor] = frozenset()) -> DeckInputs:
    """What the brochure deck reads of one engine; `without`: sensors that are not believed."""
    by_engine = now.fuel_flow_kg_s[engine], now.n1_pct[engine], now.n2_pct[engine]
    inputs = DeckInputs(*by_engine, now.mach, now.pressure_altitude_m, now.sat_degc, n1_rate_pct_s)
    if not without:
        return inputs
    sensors = (*((name, engine) for name in ENGINE_SIGNALS), *((name, 0) for name in AIR_SIGNALS))
    believed = (nan if sensor in without else value for sensor, value in zip(sensors, inputs[:-1], strict=True))
    return DeckInputs._make((*believed, n1_rate_pct_s))


def monitor_inputs(
    now: Latest, t_ns: int, states: Sequence[MountState], raw: Sequence[DeckEstimate], fused_n: tuple[float, ...]
) -> MonitorInputs:
    """Everything the monitor watches; `raw` deck estimates and `fused_n` thrust by engine."""
    return MonitorInputs(
        t_ns=t_ns,
        deformation_mm=tuple([state.deformation_mm for state in states]),
        mount_force_n=tuple([state.force_n for state in states]),
        mount_std_n=tuple([state.std_n for state in states]),
        n1_pct=now.n1_pct,
        n2_pct=now.n2_pct,
        fuel_flow_kg_s=now.fuel_flow_kg_s,
        fuel_flow_thrust_n=tuple([estimate.fuel_flow_thrust_n for estimate in raw]),
        n1_thrust_n=tuple([estimate.n1_thrust_n for estimate in raw]),
        n2_thrust_n=tuple([estimate.n2_thrust_n for estimate in raw]),
        fused_thrust_n=fused_n,
        mach=now.mach,
        pressure_altitude_m=now.pressure_altitude_m,
        sat_degc=now.sat_degc,
        accel_x_g=now.accel_x_g,
        accel_y_g=now.accel_y_g,
        accel_z_g=now.accel_z_g,
    )


def dynamic_pressure_pa(now: Latest) -> float:
    """q = gamma / 2 p M^2."""
    return 0.5 * HEAT_RATIO * static_pressure_pa(now.pressure_altitude_m) * now.mach * now.mach


def static_pressure_pa(pressure_altitude_m: float) -> float:
    """Static pressure of the standard atmosphere below 11 km, its continuation above (ISO 2533)."""
    return AIR_PRESSURE_SEA_LEVEL_PA * max(1.0 - 2.25577e-5 * pressure_altitude_m, 1e-3) ** 5.25588
