"""Is the 95 % band one? Over many aircraft: `python -m benchmarks.fusion_ensemble [--first 281] [--aircraft 20]`.

The zero and stiffness of an engine's mounts and its deviation from the deck stay for a whole flight: one engine is
inside its band nearly always or hardly ever. So a band is that of an ensemble: many twin aircraft that nothing was
tuned on fly the recordings in turn, from GROUND_S before they are airborne: as flown, with the engines idling; behind
a start of the engines on new mounts, whose zeros are calibrated; on mounts that hold what the last flight left in
their friction, so that they cannot be; and as flown on such mounts; and as flown with an installation that errs as much
as the aircraft's file says that it may, every error drawn from its sigma there (`drawn`): the band is made for those,
and aircraft that are as their benches left them are inside nearly always. An engine counts as one draw, whatever the
length of its flight; the interval behind a share is where 95 % of the shares lie when the engines are drawn anew, with
replacement, from those that flew (cluster bootstrap: Efron & Tibshirani, An Introduction to the Bootstrap, ch. 8).
Aircraft that flew already are kept in out/fusion_ensemble.jsonl; `--again` throws them away.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.fusion_flights import ENGINES, FLIGHTS, Flown, fly_profile, installation, part, refiltered
from benchmarks.kept import Kept
from thrustd.core.aircraft import AircraftData
from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.installation.installation import Installation
from thrustd.twin.flight import recorded_flight, scripted_flight
from thrustd.twin.installation import PLAIN, Knobs

KEPT = Path("out/fusion_ensemble.jsonl")
RUNNING_N1_PCT = 20.0
SETTLE_S = 30.0
TRANSIENT_PCT_S = 0.5
AFTER_S = 15.0  # a transient is N1 that moves, and this long after it
GROUND_S = 120.0
DRAWS = 10_000
COLDER_K = 20.0  # than where the zero is from: what temperature_n of the aircraft's file stands for
HALVES = ("steady", "transients")
CONDITIONS = (
    "begins at idle",
    "begins with the engines off",
    "begins with the engines off, mounts not new",
    "begins at idle, mounts not new",
    "begins at idle, installation drawn",
    "begins with the engines off, installation drawn",
)


class Engine(NamedTuple):
    """One engine of one flight; RMSE in N, coverage in %. NaN-free, so that it goes through JSON."""

    name: str
    mount_rmse: float
    brochure_rmse: float
    fused_rmse: float
    fused_std: float  # mean
    oracle_rmse: float
    coverage: dict[str, tuple[float, float]]  # source -> (steady, transients)
    faults: list[str]  # of the aircraft


def transient(flown: Flown) -> npt.NDArray[np.bool_]:
    """(n,) where the throttle moves or has just moved."""
    moving = np.abs(np.gradient(flown.n1_pct, flown.time_s)) > TRANSIENT_PCT_S
    width = round(AFTER_S * 10)
    return np.convolve(moving, np.ones(width))[: len(moving)] > 0


def oracle(mount_error: Floats, brochure_error: Floats) -> float:
    """RMSE of the best fixed weighting of both sources after the truth took their biases away."""
    m, b = mount_error - mount_error.mean(), brochure_error - brochure_error.mean()
    weight = np.clip(np.sum(b * (b - m)) / np.sum((b - m) ** 2), 0.0, 1.0)
    return rms(weight * m + (1 - weight) * b)


def score(flown: Flown, name: str, faults: list[str]) -> Engine:
    """Where the engine runs, half a minute after the start."""
    truth = flown.truth_n
    used = (flown.n1_pct > RUNNING_N1_PCT) & (flown.time_s > flown.time_s[0] + SETTLE_S)
    moving = transient(flown)
    mount, brochure = flown.column("mount_n") - truth, flown.column("brochure_n") - truth
    both = used & np.isfinite(mount + brochure)
    bands = {
        "fused": (flown.column("thrust_n"), flown.column("thrust_std_n")),
        "mount only": refiltered(flown, True, False),
        "brochure only": refiltered(flown, False, True),
    }
    coverage = {}
    for source, (thrust, std) in bands.items():
        inside = np.abs(thrust - truth) <= SIGMAS_95 * std
        coverage[source] = (100 * float(inside[used & ~moving].mean()), 100 * float(inside[used & moving].mean()))
    fused_rmse = rms((bands["fused"][0] - truth)[used])
    best_rmse = oracle(mount[both], brochure[both])
    fused_std = float(bands["fused"][1][used].mean())
    return Engine(name, rms(mount[both]), rms(brochure[both]), fused_rmse, fused_std, best_rmse, coverage, faults)


def drawn(aircraft: AircraftData, seed: int) -> Knobs:
    """Errors of an installation, each from its prior in `[installation]`; those of a zero and a scale by engine."""
    rng, known = np.random.default_rng([seed, 7]), aircraft.installation

    def by_engine(std: float) -> tuple[float, float, float, float]:
        left, right = (std * rng.standard_normal(2)).tolist()
        return left, left, right, right

    per_n = 1.0 / sum(aircraft.spring_n_mm)
    return PLAIN._replace(
        zero_mm=by_engine(known.zero_n * per_n),
        scale=by_engine(known.scale),
        drag_m2=float(known.drag_m2 * rng.standard_normal()),
        expansion_mm_k=float(known.temperature_n * per_n / COLDER_K * rng.standard_normal()),
        accel_zero_g=float(known.rest_n / (aircraft.engine_mass_kg * STANDARD_GRAVITY_M_S2) * rng.standard_normal()),
    )


def engines(place: Installation, name: str, seed: int, seconds: float, condition: str) -> list[Engine]:
    start, flown = "engines off" in condition, "not new" in condition
    knobs = drawn(place.aircraft(), seed) if "drawn" in condition else PLAIN
    record = part(name, GROUND_S, seconds)
    made = recorded_flight(record, seed, start, knobs) if record is not None else scripted_flight(seconds, seed, knobs)
    flight = fly_profile(place, name, *made, seed, flown)
    faults = [f"{fault.where} {fault.kind}" for fault in flight.faults if fault.active and fault.kind != "zero"]
    sides = zip(ENGINES, flight.engines, strict=True)
    return [score(flown, f"{name} {seed} {side}", faults) for side, flown in sides]


def share(inside_pct: Floats) -> str:
    """Mean over the engines (n,) and its 95 % interval."""
    drawn = np.random.default_rng(0).choice(inside_pct, (DRAWS, len(inside_pct))).mean(axis=1)
    low, high = np.quantile(drawn, (0.025, 0.975))
    return f"{inside_pct.mean():.1f} % ({low:.1f} to {high:.1f})"


def coverage_table(flown: list[Engine]) -> Table:
    grid = Table("source", *HALVES, title=f"truth inside the 95 % band, {len(flown)} engines; 95 % of it if drawn anew")
    for source in flown[0].coverage:
        inside = np.array([engine.coverage[source] for engine in flown])
        grid.add_row(source, *(share(half) for half in inside.T))
    return grid


def error_table(flown: list[Engine]) -> Table:
    """RMSE over all engines, and of the worst and the median one."""
    grid = Table("N", "all engines", "median engine", "worst engine", title="RMSE against the truth")
    for name in ("mount", "brochure", "fused", "oracle"):
        rmse = np.array([getattr(engine, f"{name}_rmse") for engine in flown])
        cells = (rms(rmse), np.median(rmse), rmse.max())
        grid.add_row("best fixed weight*" if name == "oracle" else name, *(f"{cell:.1f}" for cell in cells))
    return grid


def told(flown: list[Engine]) -> list[str]:
    """In words: fused beside the better source and beside the best fixed weight, and what was reported."""
    excess_n = np.array([e.fused_rmse - min(e.mount_rmse, e.brochure_rmse) for e in flown])
    ratio = np.array([e.fused_rmse / e.oracle_rmse for e in flown])
    stds = np.array([e.fused_std for e in flown])
    reported = sorted({fault for e in flown for fault in e.faults})
    worse_n = excess_n[excess_n >= 0.5]
    others = (
        f"; the others {np.median(worse_n):.1f} N worse (median), at most {worse_n.max():.1f} N" if worse_n.size else ""
    )
    return [
        f"fused better than the better source, or equal (0.5 N): {len(flown) - worse_n.size} of {len(flown)}{others}",
        f"fused / best fixed weight: {np.median(ratio):.2f} (median engine)",
        f"one sigma of fused: {stds.mean():.0f} N (mean), {stds.min():.0f} to {stds.max():.0f} N",
        f"reported by healthy sensors: {reported or 'nothing'}",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=281, help="seed of the first aircraft")
    parser.add_argument("--aircraft", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=360.0)
    parser.add_argument("--only", choices=CONDITIONS, help="one of these conditions")
    parser.add_argument("--again", action="store_true", help="throw the kept aircraft away")
    arguments, _ = parser.parse_known_args()
    if arguments.again:
        KEPT.unlink(missing_ok=True)
    console, place = Console(), installation()
    for condition in [arguments.only] if arguments.only else CONDITIONS:
        kept, flown = Kept(KEPT, f"{arguments.seconds:g} s, {condition}"), list[Engine]()
        done = {row["seed"]: [Engine(**engine) for engine in row["engines"]] for row in kept.rows()}
        for seed in track(range(arguments.first, arguments.first + arguments.aircraft), condition, console=console):
            if seed not in done:
                done[seed] = engines(place, FLIGHTS[seed % len(FLIGHTS)], seed, arguments.seconds, condition)
                kept.add({"seed": seed, "engines": [engine._asdict() for engine in done[seed]]})
            flown += done[seed]
        console.print(f"[b]{condition}[/b]", coverage_table(flown), error_table(flown), *told(flown), sep="\n")
    console.print("* of both sources, with biases removed and weight chosen by the truth: nobody has that in flight")


if __name__ == "__main__":
    main()
