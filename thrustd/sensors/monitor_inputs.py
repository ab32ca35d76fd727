"""What the monitor is told at one fused step, and how the aircraft is laid out."""

from typing import Any, NamedTuple

from thrustd.core.aircraft import NO_MOUNT
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
    # by engine, the mount in each place, the upper one first; NO_MOUNT: none is there, or none that has a transducer
    places: tuple[tuple[int, int], ...]
    engine_names: tuple[str, ...] = ("left", "right")

    @property
    def mounts_of_engine(self) -> tuple[tuple[int, ...], ...]:
        return tuple(tuple(i for i in row if i != NO_MOUNT) for row in self.places)

    def sources(self) -> list[tuple[Sensor | None, ...]]:
        """By engine, what its thrust is told by: see `past`; None where no mount is."""
        mounts = [[("deformation_mm", i) if i != NO_MOUNT else None for i in row] for row in self.places]
        return [(*row, *((name, engine) for name in ENGINE_SIGNALS)) for engine, row in enumerate(mounts)]

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
