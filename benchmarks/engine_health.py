"""The proof of `thrustd fleet health`: fleets of thirty flights, healthy ones and ones whose left engine loses thrust.

    python -m benchmarks.engine_health [FLEETS]

Every fleet is an aircraft of the twin (engines, fuel) that flies thirty scripted flights, each on another day along
another script. The loss is 2 % of thrust at equal N1, evenly over the thirty flights. To keep it to minutes the wires
and the filter are left out: the thrust of the mounts is the true one plus what `make fusion` measures with calibrated
zeros, one constant of FLIGHT_N (one sigma) per engine and flight, drawn anew for every flight, and NOISE_N from second
to second. The judgement is made after every flight from the sixth on. Wanted: the engine named by flight 20, no healthy
fleet ever.
"""

import sys

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.core.columns import Floats
from thrustd.flighttest.fleet_health import fleet_health
from thrustd.flighttest.flight import Flight
from thrustd.flighttest.health import health_rows
from thrustd.flighttest.trend import FEWEST
from thrustd.installation.shipped import read_deck
from thrustd.records.recording import Recording
from thrustd.records.rows import Row
from thrustd.twin.aircraft import scripted
from thrustd.twin.airframe import ENGINES, draw_airframe

FLEETS, FIRST, FLIGHTS, SECONDS = 30, 800, 30, 600.0
LOSS = 0.02
FLIGHT_N, NOISE_N = 25.0, 5.0
N1_NOISE_PCT, FUEL_NOISE_KG_S = 0.05, 0.0003


def main() -> None:
    fleets = int(sys.argv[1]) if len(sys.argv) > 1 else FLEETS
    deck = read_deck()
    alarms, named = [], []
    for seed in range(FIRST, FIRST + fleets):
        healthy, worn = map(first_named, fleets_rows(seed, deck))
        alarms.append(healthy)
        named.append(worn)
        print(seed, "healthy:", healthy or "steady", "; losing 2 %:", worn or "not named", flush=True)
    found = [flight for flight, who in (one for one in named if one) if who == "left"]
    print(f"healthy fleets named: {sum(map(bool, alarms))} of {fleets}")
    print(f"worn engine named: {len(found)} of {fleets}, by flight 20: {sum(flight <= 20 for flight in found)}, "
          f"median flight {np.median(found) if found else 0:.0f}, last {max(found, default=0)}")  # fmt: skip


def first_named(rows: list[list[Row]]) -> tuple[int, str] | None:
    """The first flight after which a thrust is named, and whose."""
    for flights in range(FEWEST, len(rows) + 1):
        seen = [row for flight in rows[:flights] for row in flight]
        changed = fleet_health(seen, ["thrust_at_n1_pct"]).changed
        if changed:
            return flights, changed[-1].engine
    return None


def fleets_rows(seed: int, deck: Deck) -> tuple[list[list[Row]], list[list[Row]]]:
    """Rows of every flight of one aircraft, healthy and losing: the same flights, the same noise."""
    healths = tuple(health._replace(drift_per_h=0.0) for health in draw_airframe(seed).healths)
    both: tuple[list[list[Row]], list[list[Row]]] = [], []
    for number in range(FLIGHTS):
        measured = _measured(scripted(SECONDS, 1000 * seed + number, healths), 1000 * seed + number)
        left_n = measured["mount_N_left"]
        worn_n = left_n * (1.0 - LOSS * number / (FLIGHTS - 1))
        for rows, thrust_n in zip(both, (left_n, worn_n), strict=True):
            flight = Flight(measured.with_channels(mount_N_left=thrust_n), ENGINES, True)
            rows.append([{"file": f"{number:02d}"} | row for row in health_rows(flight, deck)])
    return both


def _measured(profile: Recording, seed: int) -> Recording:
    """What sensors and mounts make of it, per second."""
    rng = np.random.default_rng([seed, 13])
    even = profile.resample(1.0)
    n = len(even)
    columns: dict[str, Floats] = {}
    for engine in ENGINES:
        off_n = FLIGHT_N * float(rng.standard_normal())
        columns |= {
            f"mount_N_{engine}": even[f"thrust_N_{engine}"] + off_n + NOISE_N * rng.standard_normal(n),
            f"n1_pct_{engine}": even[f"n1_pct_{engine}"] + N1_NOISE_PCT * rng.standard_normal(n),
            f"fuel_flow_kg_s_{engine}": even[f"fuel_flow_kg_s_{engine}"] + FUEL_NOISE_KG_S * rng.standard_normal(n),
        }
    return even.with_channels(**columns)


if __name__ == "__main__":
    main()
