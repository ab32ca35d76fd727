"""What the aircraft weighs along a flight: a mass sheet, minus the fuel that its flow meters counted.

    empty_kg = 4157.0        # all TOML, kg
    payload_kg = 695.0       # everybody and everything on board
    fuel_kg = 1837.0         # on board when the log begins
    std_kg = 30.0            # one sigma of their sum

A recording with a column mass_kg needs none.
"""

from math import sqrt
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from thrustd.core.aircraft import Wing
from thrustd.core.columns import Floats
from thrustd.core.config import Section, read_toml
from thrustd.core.errors import ConfigError, RecordingError, UsageError
from thrustd.flighttest.flight import Flight
from thrustd.records.recording import Recording
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


def mass_of(flight: Flight, sheet: MassSheet | None, wing: Wing) -> tuple[Floats, float]:
    """Mass (n,) of a flight per second, and its one sigma, kg; fuel flow is bridged where it is missing.

    RecordingError when it is unknown, or not what this aircraft can weigh.
    """
    mass_kg, std_kg = _of_column(flight) if sheet is None else _of_sheet(flight, sheet)
    least_kg, most_kg = wing.mass_kg
    unknown_kg = (most_kg - least_kg) / sqrt(12.0)  # sigma of a mass of which only the aircraft is known
    if std_kg > unknown_kg:
        raise RecordingError(
            f"{flight.name}: std_kg = {std_kg:g}; expected below {unknown_kg:.0f}: an aircraft of {least_kg:g} to "
            f"{most_kg:g} kg is known better without a sheet"
        )
    wrong = mass_kg[(mass_kg < least_kg) | (mass_kg > most_kg)]
    if len(wrong):
        raise RecordingError(
            f"{flight.name}: weighs {wrong[0]:.0f} kg by its {'column' if sheet is None else 'sheet'}; expected mass_kg"
            f" = {least_kg:g} to {most_kg:g} of the aircraft's file: is it in kg?"
        )
    return mass_kg, std_kg


def _of_column(flight: Flight) -> tuple[Floats, float]:
    record = flight.record
    if COLUMN not in record or not np.isfinite(record[COLUMN]).any():
        raise RecordingError(f"{flight.name}: no mass: expected --mass-sheet FILE, or a column {COLUMN}")
    mass_kg = _bridged(record, COLUMN)
    return mass_kg, COLUMN_STD * float(mass_kg.mean())


def _of_sheet(flight: Flight, sheet: MassSheet) -> tuple[Floats, float]:
    record = flight.record
    flows = [f"fuel_flow_kg_s_{engine}" for engine in flight.engines]
    if not all(name in record and np.isfinite(record[name]).any() for name in flows):
        raise RecordingError(f"{flight.name}: no fuel flow of every engine: the mass of the fuel is not known")
    used_kg = np.cumsum(np.sum([_bridged(record, name) for name in flows], axis=0)) / record.sample_hz
    burnt = sheet.fuel_kg - float(used_kg[-1])
    if burnt < 0:
        raise RecordingError(
            f"{flight.name}: burns {used_kg[-1]:.0f} kg; the mass sheet has fuel_kg = {sheet.fuel_kg:g}"
        )
    return sheet.empty_kg + sheet.payload_kg + sheet.fuel_kg - used_kg, sheet.std_kg


def _bridged(record: Recording, name: str) -> Floats:
    known = np.isfinite(record[name])
    return np.asarray(np.interp(record.time_s, record.time_s[known], record[name][known]))
