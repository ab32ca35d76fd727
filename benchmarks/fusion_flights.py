"""Twin flights through the unchanged pipeline, in memory."""

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from thrustd.brochure.hand_over import LAG_S, HandOver, movement_n
from thrustd.brochure.rate import smooth_rate
from thrustd.core.columns import Floats
from thrustd.core.types import Estimate, Event, Fault, Output, Status
from thrustd.fusion.fusion_inputs import FusionInputs
from thrustd.fusion.settings import FusionSettings
from thrustd.fusion.thrust_filter import ThrustFilter
from thrustd.installation.installation import CONFIG, Installation, installation_from_files, read_installation
from thrustd.pipeline.pipeline import Pipeline
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.twin.airframe import Airframe
from thrustd.twin.flight import Rates, Truth, fly, recorded_flight, scripted_flight
from thrustd.wire.event_batch import EventBatch

ROOT = Path(__file__).parents[1]
PH_LAB = ROOT.parent / "shared" / "data" / "ph_lab"
FLIGHTS = ("ftis_20180312_ref.npz", "ftis_20190312_1014.npz", "ftis_20190312_pm.npz")
ENGINES = ("left", "right")
ADC_HZ = 100.0
AIRBORNE_MACH = 0.18
TOGETHER = 256  # events that are worked on at once
FUSED_HZ, EVERY = 50.0, 5  # keep one fused step in so many: 10 Hz
UNTOLD = Rates(truth_hz=0.0)  # the profile is the truth


def follow(pipeline: Pipeline, events: Iterable[Event]) -> Iterator[Output]:
    """Outputs of a stream of events."""
    stream = iter(events)
    while together := tuple(islice(stream, TOGETHER)):
        yield from pipeline.take(EventBatch.of(together))


class Said(NamedTuple):
    """What a pipeline made of a stream of events."""

    estimates: tuple[list[Estimate], ...]  # by engine
    faults: list[Fault]


def outputs_of(pipeline: Pipeline, events: Iterable[Event], engines: int = 2, every: int = 1) -> Said:
    """One estimate of each engine in so many."""
    found, count = Said(tuple([] for _ in range(engines)), []), [0] * engines
    for output in follow(pipeline, events):
        if isinstance(output, Estimate):
            if count[output.engine] % every == 0:
                found.estimates[output.engine].append(output)
            count[output.engine] += 1
        elif isinstance(output, Fault):
            found.faults.append(output)
    return found


def part(name: str, before_s: float, seconds: float) -> Recording | None:
    """Of a recording, from so long before it flies; None = it is not at hand."""
    if not (PH_LAB / name).exists():
        return None
    record = read_recording(PH_LAB / name)
    start_s = float(record.time_s[int(np.argmax(record["mach"] > AIRBORNE_MACH))]) - before_s
    return record.window(start_s, start_s + seconds)


class Flown(NamedTuple):
    """One engine of one flight at 10 Hz; all (n,)."""

    time_s: Floats  # of the profile
    truth_n: Floats
    n1_pct: Floats
    estimates: list[Estimate]

    def column(self, name: str) -> Floats:
        return np.array([getattr(estimate, name) for estimate in self.estimates], dtype=np.float64)


class Flight(NamedTuple):
    name: str
    engines: tuple[Flown, ...]
    faults: list[Fault]


def installation(folder: Path = ROOT / "deploy") -> Installation:
    """The shipped installation with its ADC at 100 Hz, as the identification bench runs it."""
    shipped = read_installation(folder / "ph-lab.toml")
    text = shipped.files[CONFIG].decode().replace("sample_hz = 1000.0", f"sample_hz = {ADC_HZ}")
    return installation_from_files({**shipped.files, CONFIG: text.encode()}, "ph-lab.toml at 100 Hz")


def fly_through(
    place: Installation,
    name: str,
    record: Recording | None,
    seed: int,
    scripted_s: float = 1200.0,
    engine_start: bool = False,
    flown: bool = False,
) -> Flight:
    """One flight with one twin aircraft; the estimates of the pipeline beside the truth.

    `engine_start`: in front of a recording; a scripted flight has its own. `flown`: on mounts that are not new.
    """
    if record is not None:
        profile, airframe = recorded_flight(record, seed, engine_start)
    else:
        profile, airframe = scripted_flight(scripted_s, seed)
    return fly_profile(place, name, profile, airframe, seed, flown)


def fly_profile(
    place: Installation, name: str, profile: Recording, airframe: Airframe, seed: int, flown: bool = False
) -> Flight:
    """The same along a profile."""
    found = outputs_of(place.pipeline(), events_of(place, profile, airframe, seed, flown), every=EVERY)
    return Flight(name, tuple(_flown(profile, *each) for each in enumerate(found.estimates)), found.faults)


def events_of(
    place: Installation, profile: Recording, airframe: Airframe, seed: int, flown: bool = False
) -> Iterator[Event]:
    """What is on the wire along a profile."""
    items = fly(profile, airframe, place.parts().can_table, seed, UNTOLD, flown=flown)
    return (item for item in items if not isinstance(item, Truth))


def _flown(profile: Recording, engine: int, estimates: list[Estimate]) -> Flown:
    time_s = np.array([estimate.t_ns for estimate in estimates]) * 1e-9
    side = ENGINES[engine]
    lines = [np.interp(time_s, profile.time_s, profile[f"{name}_{side}"]) for name in ("thrust_N", "n1_pct")]
    return Flown(time_s, lines[0], lines[1], estimates)


def refiltered(flown: Flown, mount: bool, brochure: bool) -> tuple[Floats, Floats]:
    """(thrust, one sigma) when one source is taken away, at 10 Hz."""
    thrust_filter, rows = _steps(flown, mount, brochure)
    outputs = [thrust_filter.step(inputs.row()) for inputs in rows]
    return np.array([o.thrust_n for o in outputs]), np.array([o.thrust_std_n for o in outputs])


def _steps(flown: Flown, mount: bool, brochure: bool) -> tuple[ThrustFilter, list[FusionInputs]]:
    """A filter and what it is told; lead and lag of the brochure from its own rate, as in flight."""
    moved, lagged_pct, dt_s, rows = HandOver().row, np.nan, EVERY / FUSED_HZ, []
    for estimate, n1_pct in zip(flown.estimates, flown.n1_pct.tolist(), strict=True):
        lag_n = movement_n(moved, estimate.brochure_n, dt_s, LAG_S)
        rate_pct_s, lagged_pct = smooth_rate(lagged_pct, n1_pct, dt_s)
        rows.append(
            FusionInputs(
                t_ns=estimate.t_ns,
                mount_n=estimate.mount_n if mount else np.nan,
                mount_std_n=estimate.mount_std_n if mount else np.nan,
                brochure_n=estimate.brochure_n if brochure else np.nan,
                brochure_std_n=estimate.brochure_std_n if brochure else np.nan,
                n1_pct=n1_pct,
                n1_rate_pct_s=rate_pct_s,
                brochure_lag_n=lag_n if np.isfinite(lag_n) else 0.0,
                status=estimate.status & int(Status.GAP),
            )
        )
    return ThrustFilter(FusionSettings(), 0, mount_age_s=0.5 / FUSED_HZ), rows
