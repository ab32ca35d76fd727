"""Flight hours of healthy aircraft: is a healthy sensor excluded? `python -m benchmarks.healthy_hours [--minutes 9]`.

Each flight has a twin aircraft of its own: engines, mounts, sensor noise. Three in six are whole recordings behind an
engine start; then one that begins in mid-air, one in an installation with the errors that no bench shows, and one from
the script, which flies where the deck was not fitted. Every report but a calibrated zero is a false exclusion. Flights
are kept in out/healthy_hours.jsonl by the version of the program and not flown again: it goes on where it stopped,
until the hours that are asked for are there.
"""

import argparse
import gc
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.fusion_flights import FLIGHTS, fly_profile, installation, part
from benchmarks.integrity_flight import GROUND_S
from benchmarks.kept import Kept
from benchmarks.made_with import way_of
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.types import Status
from thrustd.installation.installation import Installation
from thrustd.records.recording import Recording
from thrustd.twin.airframe import Airframe
from thrustd.twin.flight import recorded_flight, scripted_flight
from thrustd.twin.installation import PLAIN, hostile

RESULTS = Path("out/healthy_hours.jsonl")
HOURS = 100.0
SCRIPTED_S, MID_AIR_S = 3600.0, 900.0
WITH_ERRORS = ", installed with errors"
FIRST_SEED = 4000  # of the twin aircraft; no other benchmark flies these


class Hours(NamedTuple):
    """One flight; both engines together."""

    flight: str
    seed: int
    seconds: float
    wrongly_excluded: list[str]  # "time where kind"
    rmse_n: float
    std_n: float  # mean
    in_band_pct: float
    disagree_s: float  # the longer of the engines


def profile_of(number: int, seed: int) -> tuple[Recording, Airframe]:
    """What the flight of this number does, and with which aircraft."""
    name, kind = FLIGHTS[number % len(FLIGHTS)], number % 6
    if kind == 5:
        return scripted_flight(SCRIPTED_S, seed)
    record = part(name, -MID_AIR_S if kind == 3 else GROUND_S, np.inf)
    assert record is not None, "the recordings are not at hand"
    return recorded_flight(record, seed, engine_start=kind != 3, knobs=hostile(seed) if kind == 4 else PLAIN)


def fly_one(place: Installation, number: int, seed: int) -> Hours:
    profile, airframe = profile_of(number, seed)
    kind = ("", "", "", ", begun in mid-air", WITH_ERRORS, "")[number % 6]
    flown = fly_profile(place, profile.name + kind, profile, airframe, seed)
    error_n = np.concatenate([e.column("thrust_n") - e.truth_n for e in flown.engines])
    std_n = np.concatenate([e.column("thrust_std_n") for e in flown.engines])
    doubt = [float(np.mean([each.status & Status.DISAGREE != 0 for each in e.estimates])) for e in flown.engines]
    seconds = float(np.ptp(flown.engines[0].time_s))
    return Hours(
        flown.name, seed, seconds,
        [f"{f.t_ns * 1e-9:.0f} {f.where} {f.kind}" for f in flown.faults if f.active and f.kind != "zero"],
        rms(error_n), float(std_n.mean()),
        100.0 * float(np.mean(np.abs(error_n) <= SIGMAS_95 * std_n)), seconds * max(doubt),
    )  # fmt: skip


def kept(key: str) -> list[Hours]:
    """What was flown under this name."""
    return [Hours(**{name: row[name] for name in Hours._fields}) for row in Kept(RESULTS, key).rows()]


def any_excluded(rows: list[Hours]) -> bool:
    """A sensor of an aircraft that is as its models know it."""
    return any(row.wrongly_excluded and not row.flight.endswith(WITH_ERRORS) for row in rows)


def summary(rows: list[Hours]) -> str:
    """A line of all that was flown healthy, one of what was installed with errors, one of every exclusion."""
    if not rows:
        return "healthy aircraft: none flown (python -m benchmarks.healthy_hours)"
    errs = [row for row in rows if row.flight.endswith(WITH_ERRORS)]
    well = [row for row in rows if row not in errs]
    return "\n".join(_line(*each) for each in (("healthy aircraft", well), ("installed with errors", errs)) if each[1])


def _line(name: str, rows: list[Hours]) -> str:
    hours = sum(row.seconds for row in rows) / 3600.0
    mean = [float(np.average([row[i] for row in rows], weights=[row.seconds for row in rows])) for i in (4, 5, 6)]
    found = [row for row in rows if row.wrongly_excluded]
    lines = [
        f"{name}: {hours:.1f} flight hours of {len(rows)} aircraft, {len(found)} with a sensor excluded;"
        f" RMSE {mean[0]:.0f} N, sigma {mean[1]:.0f} N, {mean[2]:.1f} % in band,"
        f" disagree {sum(row.disagree_s for row in rows) / hours:.0f} s/h"
    ]
    return "\n".join(
        [*lines, *(f"  {row.flight} aircraft {row.seed}: {'; '.join(row.wrongly_excluded)}" for row in found)]
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=HOURS)
    parser.add_argument("--minutes", type=float, default=1e9, help="begins no flight after that long")
    parser.add_argument("--first", type=int, default=0, help="number of the first flight, to fly others than before")
    parser.add_argument(
        "--key", default=way_of()["code"], help="name under which flights are kept (default: the version)"
    )
    arguments = parser.parse_args()
    began, place, rows = time.monotonic(), installation(), kept(arguments.key)
    gc.freeze()  # models and libraries stay: no collection walks them, as in a replay
    while sum(row.seconds for row in rows) < 3600.0 * arguments.hours:
        if time.monotonic() - began > 60.0 * arguments.minutes:
            break
        number = arguments.first + len(rows)
        row = fly_one(place, number, FIRST_SEED + number)
        rows.append(row)
        print(f"{row.flight} {row.seed}: {row.wrongly_excluded or 'nobody'}, {row.rmse_n:.0f} N", file=sys.stderr)
        Kept(RESULTS, arguments.key).add(row._asdict())
    print(summary(rows))
    return int(any_excluded(rows))


if __name__ == "__main__":
    sys.exit(main())
