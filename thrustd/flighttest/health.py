"""What one flight says of the health of engines and mounts, as rows that are laid side by side over many flights.

Of every steady window of the flight, per engine, against the deck at the same N1, Mach, altitude and temperature:

    thrust_at_n1_pct    100 (F / F_deck(N1) - 1), F of the mounts; without them nothing measures a thrust: NaN
    fuel_at_n1_pct      100 (W / W_deck(N1) - 1), as thrust: what the fuel flow says over what N1 says
    n2_at_n1_pct        the same of N2
    load_share          upper mount's part: moves when a mount or its transducer does

and per mount its zero, the reading before the engines are started: with what a calibration file or a run before took
off, and before this run takes its own off, which its first fault `zero` says. A table that was exported from a replay
holds neither: its mounts' zeros are not known. Left against right is the difference of
two rows of one flight: the air, the day and the deck's own error are in both.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.brochure.deck_curves import DeckInputs
from thrustd.core.atmosphere import ZERO_CELSIUS_K, total_temperature_ratio
from thrustd.core.errors import LogError, ThrustdError
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest.flight import Flight, read_flight
from thrustd.flighttest.windows import Window, steady_windows
from thrustd.installation.shipped import read_deck
from thrustd.records.flight_log import ZEROED, open_flight_log
from thrustd.records.once import columns_sha256
from thrustd.records.rows import Row
from thrustd.replay.replay import open_installation, start_of
from thrustd.sources.mcap_log import LogFile

LIMITS = SteadyLimits(n1_pct=1.0, mach=0.02, altitude_m=150.0, accel_x_g=0.05, load_factor_g=0.3, least_s=10.0)
LEAST_N1_PCT = 50.0  # below it thrust is small and a per cent of it says nothing
OFF_N1_PCT = 2.0
ZERO_S = 5.0  # shortest engine-off stretch that tells a zero
STANDS_MACH = 0.05
STEPPED = "mount_force_n"  # of a mount whose model has been stepped, zeros taken off
NOTHING: Mapping[str, float] = {}


class At(NamedTuple):
    """Thrust of the deck at a window, by each of its three inputs, N."""

    fuel_flow_n: float
    n1_n: float
    n2_n: float


@dataclass(frozen=True, slots=True)
class HealthJob:
    """Rows of one file, for `fleet`: one per engine and steady window, one per mount."""

    deck: str = ""  # empty = the shipped one

    def __call__(self, file: str) -> list[Row]:
        deck = Path(self.deck) if self.deck else None
        flight = read_flight(Path(file), deck)
        sha256 = columns_sha256(flight.record)  # a raw log and its replay are one flight
        rows = health_rows(flight, read_deck(deck), begun_s(Path(file)), taken_mm(Path(file)))
        return [{"sha256": sha256} | row for row in rows]


def begun_s(path: Path) -> float:
    """UTC seconds since 1970 at which a flight log begins; NaN of anything else."""
    try:
        log = LogFile(path)
    except LogError:
        return float("nan")
    for message in log.messages():
        return message.log_ns * 1e-9 if log.header.epoch_offset_ns else float("nan")
    return float("nan")


def taken_mm(path: Path) -> dict[str, float] | None:
    """By mount, the zero that a flight log's run took off its samples from its beginning; None: it is no log."""
    log = open_flight_log(path)
    if log is None:
        return None
    try:
        installation, start = open_installation(log, None), start_of(log)
        calibration = installation.calibration()
    except ThrustdError:  # of an older version: its estimates are as good without
        return {}
    names = [mount.name for mount in installation.config.mount]
    known = {name: calibration.of(name).zero_mm if calibration else 0.0 for name in names}
    if start is None or start.snapshot is None:
        return known
    told = zip(names, start.snapshot["mounts"], strict=True)
    return known | {name: mount["zero"][0] for name, mount in told if mount}


def health_rows(
    flight: Flight, deck: Deck, start_utc_s: float = float("nan"), zeros_mm: Mapping[str, float] | None = NOTHING
) -> list[Row]:
    """RecordingError when no steady window is in it. `zeros_mm`: taken off the mounts' readings, by mount."""
    flight = flight.per_second()
    running = np.any([flight.record[f"n1_pct_{engine}"] > LIMITS.least_n1_pct for engine in flight.engines], axis=0)
    about: Row = {
        "flight": flight.name,
        "start_utc_s": start_utc_s,
        "hours": float(running.sum()) / 3600.0 / flight.record.sample_hz,
    }
    windows = steady_windows(flight, LIMITS)
    points = [
        about | row
        for window in windows
        for number, engine in enumerate(flight.engines)
        if (row := _engine(flight, engine, number, deck, window))
    ]
    return [*points, *(about | row for row in _mounts(flight, zeros_mm))]


def _engine(flight: Flight, engine: str, number: int, deck: Deck, window: Window) -> Row:
    """One window; empty where the deck says nothing of it."""
    part = flight.record.window(window.start_s, window.end_s)
    values = {name: float(np.nanmean(column)) for name, column in part.channels.items() if np.isfinite(column).any()}
    if "sat_degC" not in values:
        return {}
    at = _at(deck, values, engine, number)
    if values[f"n1_pct_{engine}"] < LEAST_N1_PCT or not np.isfinite(at.n1_n):
        return {}
    thrust_n = values.get(f"mount_N_{engine}", np.nan)
    theta = total_temperature_ratio(values["mach"], values["sat_degC"] + ZERO_CELSIUS_K)
    return {
        "of": engine,
        "kind": "engine",
        "start_s": window.start_s,
        "seconds": window.end_s - window.start_s,
        "mach": values["mach"],
        "pressure_altitude_m": values["pressure_altitude_m"],
        "sat_degC": values["sat_degC"],
        "n1_corrected_pct": values[f"n1_pct_{engine}"] / float(np.sqrt(theta)),
        "thrust_N": thrust_n,
        "deck_N": at.n1_n,
        "thrust_at_n1_pct": 100.0 * (thrust_n / at.n1_n - 1.0),
        "fuel_at_n1_pct": 100.0 * (at.fuel_flow_n / at.n1_n - 1.0),
        "n2_at_n1_pct": 100.0 * (at.n2_n / at.n1_n - 1.0),
        "load_share": values.get(f"load_share_{engine}", np.nan),
    }


def _at(deck: Deck, values: dict[str, float], engine: str, number: int) -> At:
    fuel, n1, n2 = (values.get(f"{name}_{engine}", np.nan) for name in ("fuel_flow_kg_s", "n1_pct", "n2_pct"))
    found = deck.estimate(
        DeckInputs(fuel, n1, n2, values["mach"], values["pressure_altitude_m"], values["sat_degC"], 0.0), number
    )
    return At(found.fuel_flow_thrust_n, found.n1_thrust_n, found.n2_thrust_n)


def _mounts(flight: Flight, zeros_mm: Mapping[str, float] | None) -> list[Row]:
    record, rows = flight.record, list[Row]()
    n1_pct = np.array([record[f"n1_pct_{engine}"] for engine in flight.engines])
    off = np.all(n1_pct < OFF_N1_PCT, axis=0) & (record["mach"] < STANDS_MACH)
    off &= ~np.logical_or.accumulate(np.any(n1_pct >= OFF_N1_PCT, axis=0))  # what was carried is not gone at the end
    untouched = off & (record.time_s <= float(record.metadata.get(ZEROED, "inf")) - 1.0)  # they are means of a second
    for name in (name for name in record.channels if name.startswith("deformation_mm_")):
        mount, heard = name.removeprefix("deformation_mm_"), np.isfinite(record[name])
        exported = zeros_mm is None and f"{STEPPED}_{mount}" in record
        known = not exported and np.sum(off & heard) >= ZERO_S * record.sample_hz and bool(np.any(untouched & heard))
        zero_mm = (
            float(np.median(record[name][untouched & heard])) + (zeros_mm or NOTHING).get(mount, 0.0)
            if known
            else np.nan
        )
        rows.append({"of": mount, "kind": "mount", "zero_mm": zero_mm, "exported": exported})
    return rows
