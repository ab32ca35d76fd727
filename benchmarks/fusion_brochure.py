"""The brochure alone on whole flights: `python -m benchmarks.fusion_brochure [--seeds ...]`.

Deck, hand-over and filter at 10 Hz on the engines and air data of twin aircraft along the recordings, with the noise of
their sensors but without wire and mounts: some 8 s of processor time a flight. Around take-off alone a band that is too
narrow in cruise looks too wide.
"""

import argparse

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import ENGINES, FLIGHTS, PH_LAB, Array, installation
from benchmarks.fusion_table import AFTER_S, RUNNING_N1_PCT, SETTLE_S, TRANSIENT_PCT_S
from thrustd.brochure.deck import Deck
from thrustd.brochure.source import BrochureRoute
from thrustd.core.measures import SIGMAS_95, rms
from thrustd.fusion.fusion_inputs import INPUTS
from thrustd.fusion.settings import FusionSettings
from thrustd.fusion.thrust_filter import ThrustFilter
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.twin.flight import NOISE, recorded_flight

SIGNALS = ("fuel_flow_kg_s", "n1_pct", "n2_pct", "mach", "pressure_altitude_m", "sat_degC")
STEP_S = 0.1


def flown(deck: Deck, profile: Recording, engine: int, seed: int) -> tuple[Array, Array, Array]:
    """(error [N], its sigma [N], |dN1/dt| [%/s]), (n,) each; NaN rate where the engine stands or the filter settles."""
    rng, time_s = np.random.default_rng([seed, engine]), np.arange(profile.time_s[0], profile.time_s[-1], STEP_S)
    names = [name if name in profile.channels else f"{name}_{ENGINES[engine]}" for name in SIGNALS]
    lines = [np.interp(time_s, profile.time_s, profile[name]) for name in names]
    noise = [NOISE[signal] * rng.standard_normal(len(time_s)) for signal in SIGNALS]
    readings = np.ascontiguousarray(np.transpose(lines) + np.transpose(noise))
    truth_n = np.interp(time_s, profile.time_s, profile[f"thrust_N_{ENGINES[engine]}"])
    route = BrochureRoute(deck, engine, lambda signal, number: SIGNALS.index(signal))
    thrust_filter, told = ThrustFilter(FusionSettings(), engine), np.zeros(1, INPUTS)
    told["mount_n"] = told["mount_std_n"] = told["load_share"] = np.nan
    rows, routes_n, ages_s = np.empty((len(time_s), 3)), np.zeros(4), np.zeros(len(SIGNALS))
    for k, row in enumerate(readings):
        route.look(STEP_S, row, routes_n)
        route.tell(STEP_S, row, ages_s, False, told)
        told["t_ns"] = round(time_s[k] * 1e9)
        rate_pct_s = abs(told["n1_rate_pct_s"].item())
        estimate = thrust_filter.step(told)
        rows[k] = estimate.thrust_n - truth_n[k], estimate.thrust_std_n, rate_pct_s
    rows[(lines[1] <= RUNNING_N1_PCT) | (time_s < time_s[0] + SETTLE_S), 2] = np.nan
    return rows[:, 0], rows[:, 1], rows[:, 2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[201, 202, 203])
    arguments = parser.parse_args()
    console, deck = Console(), installation().parts().deck
    grid, shares = Table("flight", "seed", "engine", "RMSE N", "in band %, steady", "transients"), []
    for name in FLIGHTS:
        record = read_recording(PH_LAB / name)
        for seed in arguments.seeds:
            profile, _ = recorded_flight(record, seed)
            for engine, side in enumerate(ENGINES):
                error_n, std_n, rate_pct_s = flown(deck, profile, engine, seed)
                moving = np.convolve(rate_pct_s > TRANSIENT_PCT_S, np.ones(round(AFTER_S / STEP_S)))[: len(error_n)] > 0
                used, inside = np.isfinite(rate_pct_s), np.abs(error_n) <= SIGMAS_95 * std_n
                shares.append([100 * inside[used & ~moving].mean(), 100 * inside[used & moving].mean()])
                grid.add_row(name, str(seed), side, f"{rms(error_n[used]):.0f}", *(f"{s:.1f}" for s in shares[-1]))
    grid.add_row("mean", "", "", "", *(f"{share:.1f}" for share in np.mean(shares, axis=0)))
    console.print(grid)


if __name__ == "__main__":
    main()
