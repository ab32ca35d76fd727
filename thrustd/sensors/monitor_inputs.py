"""What the monitor is told at one fused step, and how the aircraft is laid out."""

from typing import Any, NamedTuple

from thrustd.core.columns import Floats

Sensor = tuple[str, int]  # (canonical channel name, engine or mount index)
ENGINE_SIGNALS = ("fuel_flow_kg_s", "n1_pct", "n2_pct")
AIRCRAFT_SIGNALS = (
    "mach",
    "pressure_altitude_m",
    "sat_degC",
    "accel_x_g",
    "accel_y_g",
    "accel_z_g",
    "tat_degC",
    "pitch_deg",
)


class Layout(NamedTuple):
    """Which mounts carry which engine."""

    mount_names: tuple[str, ...]  # by mount index
    mounts_of_engine: tuple[tuple[int, ...], ...]  # by engine: upper mount first
    engine_names: tuple[str, ...] = ("left", "right")

    def sensors(self) -> tuple[Sensor, ...]:
        """Everything that is watched, in the order of `MonitorInputs.readings`: mounts, engines, aircraft, the rest."""
        engines, mounts = range(len(self.mounts_of_engine)), range(len(self.mount_names))
        return (
            *(("deformation_mm", i) for i in mounts),
            *((name, e) for name in ENGINE_SIGNALS for e in engines),
            *((name, 0) for name in AIRCRAFT_SIGNALS),
            *(("temperature_degC", i) for i in mounts),
        )


class MonitorInputs(NamedTuple):
    """NaN = missing or stale."""

    t_ns: int
    readings: Floats  # the latest of each of `Layout.sensors`, as it came
    mounts: Any  # MOUNT_STATE by mount, after load-factor corrections
    # (n_engines, 6), of readings as they came: thrust by fuel flow, N1, N2; sigma of the deck; dF/d ln w and ln w of
    # the corrected fuel flow w
    deck_n: Floats
