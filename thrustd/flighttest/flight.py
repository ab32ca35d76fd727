"""A flight as the uses of thrust read it: means of a second, thrust of every engine with its sigma.

    thrust_N_<engine>, thrust_std_N_<engine>       fused; where there is none, the brochure's
    brochure_N_<engine>, brochure_std_N_<engine>   the brochure alone
    status_<engine>                                bits of the estimate at that second
    thrust_per_fuel_<engine>                       d ln F / d ln(fuel flow), where the thrust is the deck's

Everything else is called as in the log. A raw log is replayed first; a recording without estimates (an FTIS export, a
CSV with N1, fuel flow and air data) has the brochure's thrust, from the deck.
"""

from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from thrustd.brochure.deck import Deck, DeckRows
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.flighttest.terms import band_in
from thrustd.installation.shipped import aircraft_data, read_deck
from thrustd.records.files import read_recording
from thrustd.records.recording import MOST_FLIGHT_S, Recording, make_recording
from thrustd.replay.budget import Band

AIR = "mach", "pressure_altitude_m", "sat_degC"
SECOND_HZ = 1.0
LOG = ".mcap"
ESTIMATE = {
    "thrust_N": "estimate_thrust_n", "thrust_std_N": "estimate_thrust_std_n", "mount_N": "estimate_mount_n",
    "brochure_N": "estimate_brochure_n", "brochure_std_N": "estimate_brochure_std_n", "status": "estimate_status",
    "load_share": "estimate_load_share", "thrust_rate_N_s": "estimate_thrust_rate_n_s",
}  # fmt: skip


class Flight(NamedTuple):
    """One flight; `fused`: its thrust is that of an estimate log, else the brochure's alone."""

    record: Recording
    engines: tuple[str, ...]
    fused: bool
    band: Band | None = None  # what its installation says of the terms of its band, where it tells them

    @property
    def name(self) -> str:
        return self.record.name

    def per_second(self) -> "Flight":
        """Means of a second, NaN where it has no sample; the status of an engine is the newest of it."""
        held = [name for name in self.record.channels if name.startswith("status_")]
        even = self.record.resample(SECOND_HZ)
        at = np.searchsorted(self.record.time_s, even.time_s, side="right") - 1
        columns = {name: self.record[name][at] for name in held}
        return self._replace(record=even.with_channels(**columns) if columns else even)

    def missing_s(self, names: Iterable[str]) -> dict[str, int]:
        """Seconds of the flight without a value, of the columns that have such."""
        even = self.record.select(names).resample(SECOND_HZ)
        missing = {name: int(np.isnan(column).sum()) for name, column in even.channels.items()}
        return {name: seconds for name, seconds in missing.items() if seconds}


SHORTEST_S = 2.0  # of a flight: a rate needs two seconds


def absent(missing_s: dict[str, int]) -> str:
    """What has no value for how long; quantities that lack as long together."""
    names = {seconds: [name for name, s in missing_s.items() if s == seconds] for seconds in missing_s.values()}
    return "; ".join(f"no {', '.join(names[seconds])} in {seconds} s" for seconds in sorted(names, reverse=True))


def read_flight(path: Path | str, deck: Path | None = None, aircraft: Path | None = None) -> Flight:
    """Any log or recording with N1 and air data; RecordingError, one line, when it lacks them.

    deck, aircraft: files for the thrust of a recording without estimates and what is not sure about its fuel.
    """
    path = Path(path)
    record = read_recording(path, digest=False)
    band = band_in(path) if path.suffix.lower() == LOG else None
    if "raw events" in " ".join(record.notes):
        record = _replayed(path)
    engines = tuple(name.removeprefix("n1_pct_") for name in record.channels if name.startswith("n1_pct_"))
    _check(record.at_most(MOST_FLIGHT_S), engines)
    estimated = tuple(engine for engine in engines if f"estimate_thrust_n_{engine}" in record)
    if estimated:  # the bus may tell of further engines, which carry no transducers
        return Flight(_named(record, estimated), estimated, True, band)
    burning = read_deck(deck).burning(aircraft_data(aircraft).fuel.thrust)
    return Flight(_by_deck(record, engines, burning), engines, fused=False)


def _replayed(path: Path) -> Recording:
    from thrustd.replay.replay import replay

    with TemporaryDirectory() as folder:
        log = Path(folder) / path.name
        replay(path, log)
        return read_recording(log, digest=False)


def _check(record: Recording, engines: tuple[str, ...]) -> None:
    if not engines:
        raise RecordingError(f"{record.name}: no column n1_pct_<engine>; expected the fan speed of every engine")
    for name in AIR:
        if name not in record or not np.isfinite(record[name]).any():
            raise RecordingError(f"{record.name}: no air data: no values of {name}; expected {', '.join(AIR)}")
    for name in (f"n1_pct_{engine}" for engine in engines):
        if not np.isfinite(record[name]).any():
            raise RecordingError(f"{record.name}: no values of {name}; expected the fan speed of every engine")
    length_s = float(record.time_s[-1] - record.time_s[0])
    if length_s < SHORTEST_S:
        raise RecordingError(f"{record.name}: no steady window: it is {length_s:.3g} s long")


def _named(record: Recording, engines: tuple[str, ...]) -> Recording:
    """Estimates under the names of this module; the truth of a simulated flight as truth_N_<engine>."""
    columns = {"time_s": record.time_s, **record.channels}
    for engine in engines:
        truth = columns.pop(f"thrust_N_{engine}", None)
        if truth is not None:
            columns[f"truth_N_{engine}"] = truth
        for ours, theirs in ESTIMATE.items():
            columns[f"{ours}_{engine}"] = columns.pop(f"{theirs}_{engine}")
    return make_recording(record.name, columns, record.metadata, record.sha256, record.notes)


def _by_deck(record: Recording, engines: tuple[str, ...], deck: Deck) -> Recording:
    columns: dict[str, Floats] = {}
    for number, engine in enumerate(engines):
        found = deck_thrust(record, deck, number, engine)
        for name in ("thrust", "brochure"):
            columns |= {f"{name}_N_{engine}": found.thrust_n, f"{name}_std_N_{engine}": found.std_n}
        with np.errstate(divide="ignore", invalid="ignore"):
            columns[f"thrust_per_fuel_{engine}"] = found.per_fuel_n / found.thrust_n
    return record.with_channels(**columns)


def deck_thrust(record: Recording, deck: Deck, number: int, engine: str) -> DeckRows:
    nothing = np.full(len(record), np.nan)
    n1_pct = record[f"n1_pct_{engine}"]
    fuel, n2 = (record.channels.get(f"{name}_{engine}", nothing) for name in ("fuel_flow_kg_s", "n2_pct"))
    rate = np.gradient(n1_pct, record.time_s) if len(record) > 1 else np.zeros(1)
    rows = np.column_stack((fuel, n1_pct, n2, *(record[name] for name in AIR), rate))
    return deck.along(rows, number)
