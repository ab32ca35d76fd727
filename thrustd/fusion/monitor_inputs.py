"""What the monitor is told at one fused step, and how the aircraft is laid out."""

from typing import NamedTuple

Sensor = tuple[str, int]  # (canonical channel name, engine or mount index)


class Layout(NamedTuple):
    """Which mounts carry which engine."""

    mount_names: tuple[str, ...]  # by mount index
    mounts_of_engine: tuple[tuple[int, ...], ...]  # by engine: upper mount first


class MonitorInputs(NamedTuple):
    """Latest readings; NaN = missing or stale. Tuples are by mount or by engine."""

    t_ns: int
    deformation_mm: tuple[float, ...]  # by mount, as measured
    mount_force_n: tuple[float, ...]  # by mount, after load-factor corrections
    mount_std_n: tuple[float, ...]  # by mount
    n1_pct: tuple[float, ...]
    n2_pct: tuple[float, ...]
    fuel_flow_kg_s: tuple[float, ...]
    fuel_flow_thrust_n: tuple[float, ...]  # DeckEstimate's, from unmasked inputs
    n1_thrust_n: tuple[float, ...]
    fused_thrust_n: tuple[float, ...]  # ThrustFilter.thrust_n before this step
    mach: float
    pressure_altitude_m: float
    sat_degc: float
    accel_x_g: float
    accel_y_g: float
    accel_z_g: float
    n2_thrust_n: tuple[float, ...] = ()
