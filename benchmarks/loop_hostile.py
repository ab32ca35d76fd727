"""The loop in the air on a commissioned aircraft that errs in everything: `python -m benchmarks.loop_hostile CONFIG`.

CONFIG is a configuration that `benchmarks.commission` left of aircraft N (`--aircraft`): as commissioned, or with its
calibration file. The same hostile aircraft flies recorded flights without wires (`loop_in_air`), each mount is
diagnosed and extended against the brochure, and judged by the truth on a flight that nothing was estimated on: each
mount by its share of the thrust, and all mounts of an engine together by its thrust.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import FLIGHTS
from benchmarks.loop_in_air import JUDGED, flown, untold
from thrustd.core.columns import Floats
from thrustd.core.errors import ModelError
from thrustd.core.measures import rms
from thrustd.diagnose.compare.reference import referenced
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.question import Given
from thrustd.diagnose.search.records import stretches
from thrustd.installation.installation import Installation, read_installation
from thrustd.model.artifact import ModelSpec
from thrustd.model.calibrated import calibrated
from thrustd.records.recording import Recording
from thrustd.twin.installation import hostile


def error_n(spec: ModelSpec, flight: Recording, installation: Installation, mount: str) -> Floats:
    """Of a model as it flies in this aircraft against its mount's share of the true thrust (n,)."""
    place = installation.place(mount)
    flies = calibrated(spec, place, mount)
    segments = stretches(flies, referenced([flight], f"truth_N_{mount}", place, None, [flies]))
    return np.concatenate([simulate(flies, segment) - segment.force_n for segment in segments])


def as_replayed(flight: Recording, installation: Installation) -> Recording:
    """As `replay` writes it: without the zeros of the calibration file."""
    names = [mount.name for mount in installation.config.mount]
    zeros_mm = {f"deformation_mm_{name}": installation.place(name).calibration.zero_mm for name in names}
    return flight.with_channels(**{name: flight[name] - zero_mm for name, zero_mm in zeros_mm.items()})


class Looped(NamedTuple):
    """One mount."""

    row: list[str]
    before_n: Floats  # errors on the other flight
    after_n: Floats


def looped(installation: Installation, aircraft: int, mount: str, flights: str) -> Looped:
    """Verdict and grade; N before and after; what was estimated; seconds of processor time."""
    knobs, place = hostile(aircraft), installation.place(mount)
    given = Given(against="brochure", mount=place, deck=installation.parts().deck, others=installation.others_of(mount))
    spec = installation.bench_model(next(one for one in installation.config.mount if one.name == mount))
    seen = [untold(as_replayed(flown(FLIGHTS[int(n)], aircraft, knobs), installation)) for n in flights]
    began, after, sizes = time.process_time(), spec, ""
    report = diagnose(spec, seen, given=given)
    words = [word for word in report.verdict if word not in ("none", "unknown")]
    if words:
        try:
            longer = extend(spec, seen, words, given=given)
            after, sizes = longer.spec, "; ".join(p.sentence.split(" (")[0] for p in longer.parameters)
        except ModelError as problem:
            sizes = str(problem)[:80]
    spent, other = time.process_time() - began, as_replayed(flown(JUDGED, aircraft, knobs), installation)
    before_n, after_n = (error_n(each, other, installation, mount) for each in (spec, after))
    verdict = f"{'+'.join(report.verdict)} ({report.grade})"
    return Looped([mount, flights, verdict, _fell(before_n, after_n), sizes, f"{spent:.0f}"], before_n, after_n)


def _fell(before_n: Floats, after_n: Floats) -> str:
    return f"{rms(before_n):.1f}, {rms(after_n):.1f}"


def rows_of(config: Path, aircraft: int, flights: str) -> Iterator[list[str]]:
    """Of every mount, and of every engine with all its mounts."""
    installation = read_installation(config)
    for engine in installation.config.aircraft.engines:
        mine = [installation.config.mount[i].name for i in installation.config.mounts_of(engine)]
        found = []
        for mount in mine:
            found.append(looped(installation, aircraft, mount, flights))
            yield [config.stem, *found[-1].row]
        before_n, after_n = (np.sum([getattr(one, name) for one in found], axis=0) for name in ("before_n", "after_n"))
        yield [config.stem, engine, flights, "", _fell(before_n, after_n), "", ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("config", type=Path, nargs="+")
    parser.add_argument("--aircraft", type=int, required=True, metavar="SEED")
    parser.add_argument("--flights", nargs="+", default=["1"], choices=("0", "1", "01"), help="to estimate on")
    given = parser.parse_args()
    shown = Table("configuration", "of", "from", "verdict", "N before, after", "sizes", "s")
    for config in given.config:
        for flights in given.flights:
            for row in rows_of(config, given.aircraft, flights):
                print(*row, sep=" | ", flush=True)
                shown.add_row(*row)
    Console(width=160).print(shown)


if __name__ == "__main__":
    main()
