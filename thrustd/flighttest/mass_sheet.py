"""What the aircraft weighs along a flight: a mass sheet, minus the fuel that its flow meters counted.

    empty_kg = 4157.0        # all TOML, kg
    payload_kg = 695.0       # everybody and everything on board
    fuel_kg = 1837.0         # on board when the log begins
    std_kg = 30.0            # one sigma of their sum

A recording with a column mass_kg needs none.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from thrustd.core.columns import Floats
from thrustd.core.config import Section, read_toml
from thrustd.core.errors import ConfigError, RecordingError, UsageError
from thrustd.flighttest.flight import Flight
from thrustd.sources.plain_file import read_text

NotNegative = Annotated[float, Meta(ge=0.0, le=1e6)]
Positive = Annotated[float, Meta(gt=0.0, le=1e6)]
COLUMN = "mass_kg"
COLUMN_STD = 0.005  # of a mass that a recording brings along, relative: fuel gauges, standard masses of persons


class MassSheet(Section, frozen=True):
    empty_kg: Positive
    payload_kg: NotNegative
    fuel_kg: NotNegative
    std_kg: Positive


def read_mass_sheet(path: Path) -> MassSheet:
    """UsageError, one line, when it is none."""
    try:
        return read_toml(read_text(path), MassSheet, str(path))
    except ConfigError as problem:
        raise UsageError(str(problem)) from None


def mass_of(flight: Flight, sheet: MassSheet | None) -> tuple[Floats, float]:
    """Mass (n,) of a flight per second, and its one sigma, kg."""
    record = flight.record
    if sheet is None:
        if COLUMN not in record or not np.isfinite(record[COLUMN]).any():
            raise RecordingError(f"{flight.name}: no mass: expected --mass-sheet FILE, or a column {COLUMN}")
        known = np.isfinite(record[COLUMN])
        mass_kg = np.interp(record.time_s, record.time_s[known], record[COLUMN][known])
        return mass_kg, COLUMN_STD * float(mass_kg.mean())
    flows = [name for engine in flight.engines if (name := f"fuel_flow_kg_s_{engine}") in record]
    if len(flows) < len(flight.engines):
        raise RecordingError(f"{flight.name}: no fuel flow of every engine: the mass of the fuel is not known")
    used_kg = np.cumsum(np.nan_to_num(sum(record[name] for name in flows))) / record.sample_hz
    burnt = sheet.fuel_kg - float(used_kg[-1])
    if burnt < 0:
        raise RecordingError(
            f"{flight.name}: burns {used_kg[-1]:.0f} kg; the mass sheet has fuel_kg = {sheet.fuel_kg:g}"
        )
    return sheet.empty_kg + sheet.payload_kg + sheet.fuel_kg - used_kg, sheet.std_kg
