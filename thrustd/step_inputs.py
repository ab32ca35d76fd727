"""The latest readings as the deck and the monitor want them, at one fused step. Missing or stale is NaN."""

from collections.abc import Sequence
from math import nan

from thrustd.brochure.deck import DeckEstimate, DeckInputs
from thrustd.fusion.monitor_inputs import MonitorInputs, Sensor
from thrustd.mount_route import MountState
from thrustd.sync import Hold

AIR_PRESSURE_SEA_LEVEL_PA = 101325.0  # ISO 2533
HEAT_RATIO = 1.4  # air


def deck_inputs(
    hold: Hold, t_ns: int, engine: int, n1_rate_pct_s: float, without: frozenset[Sensor] = frozenset()
) -> DeckInputs:
    """What the brochure deck reads of one engine; `without`: sensors that are not believed."""

    def value(signal: str, index: int) -> float:
        return nan if (signal, index) in without else hold.value(t_ns, signal, index)

    return DeckInputs(
        value("fuel_flow_kg_s", engine),
        value("n1_pct", engine),
        value("n2_pct", engine),
        value("mach", 0),
        value("pressure_altitude_m", 0),
        value("sat_degC", 0),
        n1_rate_pct_s,
    )


def monitor_inputs(
    hold: Hold, t_ns: int, states: Sequence[MountState], raw: Sequence[DeckEstimate], fused_n: tuple[float, ...]
) -> MonitorInputs:
    """Everything the monitor watches; `raw` deck estimates and `fused_n` thrust by engine."""

    def by_engine(signal: str) -> tuple[float, ...]:
        return tuple(hold.value(t_ns, signal, e) for e in range(len(fused_n)))

    return MonitorInputs(
        t_ns=t_ns,
        deformation_mm=tuple(state.deformation_mm for state in states),
        mount_force_n=tuple(state.force_n for state in states),
        mount_std_n=tuple(state.std_n for state in states),
        n1_pct=by_engine("n1_pct"),
        n2_pct=by_engine("n2_pct"),
        fuel_flow_kg_s=by_engine("fuel_flow_kg_s"),
        fuel_flow_thrust_n=tuple(estimate.fuel_flow_thrust_n for estimate in raw),
        n1_thrust_n=tuple(estimate.n1_thrust_n for estimate in raw),
        n2_thrust_n=tuple(estimate.n2_thrust_n for estimate in raw),
        fused_thrust_n=fused_n,
        mach=hold.value(t_ns, "mach"),
        pressure_altitude_m=hold.value(t_ns, "pressure_altitude_m"),
        sat_degc=hold.value(t_ns, "sat_degC"),
        accel_x_g=hold.value(t_ns, "accel_x_g"),
        accel_y_g=hold.value(t_ns, "accel_y_g"),
        accel_z_g=hold.value(t_ns, "accel_z_g"),
    )


def dynamic_pressure_pa(hold: Hold, t_ns: int) -> float:
    """q = gamma / 2 p M^2."""
    mach = hold.value(t_ns, "mach")
    static_pa = static_pressure_pa(hold.value(t_ns, "pressure_altitude_m"))
    return 0.5 * HEAT_RATIO * static_pa * mach * mach


def static_pressure_pa(pressure_altitude_m: float) -> float:
    """Static pressure of the standard atmosphere below 11 km, its continuation above (ISO 2533)."""
    return AIR_PRESSURE_SEA_LEVEL_PA * max(1.0 - 2.25577e-5 * pressure_altitude_m, 1e-3) ** 5.25588
