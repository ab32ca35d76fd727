"""The proof of `thrustd performance`: forty flights of the twin with a known drag polar, through the whole pipeline.

    python -m benchmarks.polar [FLIGHTS]

Every flight has its own aircraft (engines, mounts, sensors), polar and day; the logs are raw: wires, mounts, deck and
filter are all in it. Wanted: 95 % intervals hold the truth in 90 % of the flights, C_D0 within 3 %.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.level_points import Polar, level_points
from thrustd.core.aircraft import Wing, read_aircraft
from thrustd.core.measures import rms
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest.flight import read_flight
from thrustd.flighttest.flown import flown
from thrustd.flighttest.mass_sheet import MassSheet
from thrustd.flighttest.performance import performance
from thrustd.flighttest.performance_result import PolarResult
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.twin.airframe import draw_airframe
from thrustd.twin.flight import write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FLIGHTS = 40
EMPTY_KG, FUEL_KG, MASS_STD_KG = 4157.0, 1500.0, 30.0


def main() -> None:
    flights = int(sys.argv[1]) if len(sys.argv) > 1 else FLIGHTS
    wing = read_aircraft(shipped("deploy/citation-ii.toml", "").read_text(), "").wing
    assert wing is not None
    inside: dict[str, list[bool]] = {}
    errors: dict[str, list[float]] = {}
    for seed in range(100, 100 + flights):
        truth, polars = fly(seed, wing)
        for polar in polars:
            for name, interval, true in (
                ("C_D0", polar.zero_lift_drag, truth.zero_lift),
                ("e", polar.oswald, 1 / (np.pi * wing.aspect_ratio * truth.factor)),
            ):
                key = f"{polar.of}: {name}"
                inside.setdefault(key, []).append(interval.low <= true <= interval.high)
                errors.setdefault(key, []).append(100 * (interval.value / true - 1))
        print(seed, *(f"{polar.zero_lift_drag.value / truth.zero_lift - 1:+.3%}" for polar in polars), flush=True)
    for key, hits in inside.items():
        off = np.array(errors[key])
        print(f"{key}: in the interval {sum(hits)} of {len(hits)}, error rms {rms(off):.1f} %, "
              f"largest {np.abs(off).max():.1f} %, beyond 3 %: {int((np.abs(off) > 3).sum())}")  # fmt: skip


def fly(seed: int, wing: Wing) -> tuple[Polar, list[PolarResult]]:
    """One flight; its truth and what `performance` says of it."""
    rng = np.random.default_rng([seed, 12])
    truth = Polar(float(rng.uniform(0.019, 0.027)), float(rng.uniform(0.040, 0.055)), float(rng.uniform(5600, 6600)))
    airframe = draw_airframe(seed)
    profile = level_points(seed, airframe.healths, truth)
    weighed = truth.mass_kg + MASS_STD_KG * float(rng.standard_normal())
    sheet = MassSheet(EMPTY_KG, weighed - EMPTY_KG - FUEL_KG, FUEL_KG, MASS_STD_KG)
    installation = read_installation(shipped("deploy/hil.toml", ""))
    with TemporaryDirectory() as folder:
        log = Path(folder) / "flight.mcap"
        table = installation.can_table(ICD_INPUT_ROWS)
        write_flight(log, profile, airframe, table, installation.log_header(), seed)
        point = flown(read_flight(log), wing, sheet, SteadyLimits())
    return truth, performance([point], wing, True).polars


if __name__ == "__main__":
    main()
