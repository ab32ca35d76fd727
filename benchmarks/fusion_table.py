"""The fusion table of the README and docs/fusion.md: `python -m benchmarks.fusion_table [--seconds S] [--seeds ...]`.

Flights: three PH-LAB recordings flown by the twin (scripted ones when they are not at hand); the seeds are not those
the noises were tuned on (1, 2, 3). Everything is measured on the estimates of the unchanged pipeline.
"""

import argparse
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import Array, Flight, Flown, fly_through, installation, profiles, refiltered, smoothed
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.fusion.consistency import Consistency, consistency

RUNNING_N1_PCT = 20.0
SETTLE_S = 30.0
TRANSIENT_PCT_S = 0.5
AFTER_S = 15.0  # a transient is N1 that moves, and this long after it


class EngineScore(NamedTuple):
    """One engine in one flight; RMSE in N, coverage in %."""

    name: str
    mount_rmse: float
    brochure_rmse: float
    fused_rmse: float
    oracle_rmse: float
    coverage: dict[str, tuple[float, float]]  # route -> (steady, transient)
    consistency: dict[str, Consistency]  # route -> NIS and whiteness of every fused step in steady flight
    filtered_rmse: float
    smoothed_rmse: float


def transient(flown: Flown) -> npt.NDArray[np.bool_]:
    """(n,) where the throttle moves or has just moved."""
    moving = np.abs(np.gradient(flown.n1_pct, flown.time_s)) > TRANSIENT_PCT_S
    width = round(AFTER_S * 10)
    return np.convolve(moving, np.ones(width))[: len(moving)] > 0


def oracle(mount_error: Array, brochure_error: Array) -> float:
    """RMSE of the best fixed weighting of both routes after the truth took their biases away."""
    m, b = mount_error - mount_error.mean(), brochure_error - brochure_error.mean()
    weight = np.clip(np.sum(b * (b - m)) / np.sum((b - m) ** 2), 0.0, 1.0)
    return rms(weight * m + (1 - weight) * b)


def score(flown: Flown, name: str) -> EngineScore:
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
    for route, (thrust, std) in bands.items():
        inside = np.abs(thrust - truth) <= SIGMAS_95 * std
        coverage[route] = (100 * float(inside[used & ~moving].mean()), 100 * float(inside[used & moving].mean()))
    filtered, smooth_n = smoothed(flown)
    return EngineScore(
        name=name,
        mount_rmse=rms(mount[both]),
        brochure_rmse=rms(brochure[both]),
        fused_rmse=rms((bands["fused"][0] - truth)[used]),
        oracle_rmse=oracle(mount[both], brochure[both]),
        coverage=coverage,
        consistency=consistency(flown.innovations),
        filtered_rmse=rms((filtered - truth)[used]),
        smoothed_rmse=rms((smooth_n - truth)[used]),
    )


def tables(scores: list[EngineScore]) -> list[Table]:
    errors = Table(title="RMSE against the truth, N")
    for heading in ("flight", "mount", "brochure", "fused", "best fixed weight*", "fused / best", "10 Hz", "smoothed"):
        errors.add_column(heading)
    for s in scores:
        figures = (s.mount_rmse, s.brochure_rmse, s.fused_rmse, s.oracle_rmse)
        ratio = f"{s.fused_rmse / s.oracle_rmse:.2f}"
        errors.add_row(
            s.name, *(f"{v:.0f}" for v in figures), ratio, f"{s.filtered_rmse:.0f}", f"{s.smoothed_rmse:.0f}"
        )
    bands = Table(title="truth inside the 95 % band, % steady / transient; consistency")
    for heading in ("flight", *scores[0].coverage, *(f"{route}: NIS, whiteness" for route in scores[0].consistency)):
        bands.add_column(heading)
    for s in scores:
        cells = [f"{steady:.1f} / {moving:.1f}" for steady, moving in s.coverage.values()]
        cells += [f"{c.nis:.3f}, {c.whiteness:.2f}" for c in s.consistency.values()]
        bands.add_row(s.name, *cells)
    mean = {route: np.mean([s.coverage[route] for s in scores], axis=0) for route in scores[0].coverage}
    bands.add_row("mean", *(f"{steady:.1f} / {moving:.1f}" for steady, moving in mean.values()), "", "")
    return [errors, bands]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=1500.0, help="of every recording, from its start")
    parser.add_argument("--seeds", type=int, nargs="+", default=[91])
    arguments, _ = parser.parse_known_args()
    console = Console()
    place = installation()
    scores: list[EngineScore] = []
    for name, record in profiles(arguments.seconds):
        for seed in arguments.seeds:
            flight: Flight = fly_through(place, name, record, seed)
            flags = [f"{f.where} {f.kind}" for f in flight.faults]
            console.print(f"{name}, seed {seed}: flags {flags or 'none'}")
            for engine, flown in zip(("left", "right"), flight.engines, strict=True):
                scores.append(score(flown, f"{name.removesuffix('.npz')} {seed} {engine}"))
    for table in tables(scores):
        console.print(table)
    console.print("* of both routes, with biases removed and weight chosen by the truth: nobody has that in flight")


if __name__ == "__main__":
    main()
