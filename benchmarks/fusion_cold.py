"""Logs that begin in flight: `python -m benchmarks.fusion_cold [--seeds ...] [--moments ...]`.

The mounts of twin aircraft fly a recording from the ground on; their models are started at several moments of it, as a
daemon would that wakes up there. Per engine over the first two minutes: error of the mount route when the load is taken
for eternal and friction for that of a load that grew, and as `mounts.start` begins, with the share inside its band.
"""

import argparse
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import ADC_HZ, ENGINES, FLIGHTS, PH_LAB, Array, installation
from thrustd.core.measures import SIGMAS_95
from thrustd.fusion.settings import FusionSettings
from thrustd.model.compile import CompiledModel
from thrustd.mounts.start import CRUISE, LOAD_AGE_S, Unseen
from thrustd.records.files import read_recording
from thrustd.sensors.limits import FLYING_MACH
from thrustd.twin.airframe import carried_n, mount_temperature_degc, settled, thrust_shares_n
from thrustd.twin.flight import recorded_flight
from thrustd.twin.mount import advance

WATCHED_S = 120.0
EVERY = 10  # samples between two looks
MODEL_STD_N = 10.0  # of the error maps of the shipped models


class Mount(NamedTuple):
    rows: Array  # (n, n_inputs) of its model
    share_n: Array  # (n,) true
    model: CompiledModel
    flying: npt.NDArray[np.bool_]  # (n,)


class Late(NamedTuple):
    """One mount from one moment on, (n_looks,) each."""

    eternal_error_n: Array
    error_n: Array
    common_n: Array
    own_n: Array


def mounts_of(flight: str, seed: int, seconds: float) -> list[Mount]:
    record = read_recording(PH_LAB / flight)
    profile, airframe = recorded_flight(record.window(record.time_s[0], record.time_s[0] + seconds), seed)
    time_s = np.arange(profile.time_s[0], profile.time_s[-1], 1 / ADC_HZ)
    line: Callable[[str], Array] = lambda name: np.interp(time_s, profile.time_s, profile[name])  # noqa: E731
    thrust_n = np.stack([line(f"thrust_N_{engine}") for engine in ENGINES])
    accel = {name: line(name) for name in ("accel_x_g", "accel_z_g")}
    loads_n, shares_n = carried_n(airframe, thrust_n, accel["accel_x_g"]), thrust_shares_n(airframe, thrust_n)
    found = []
    for i, (state, model) in enumerate(
        zip(settled(airframe, loads_n[:, 0]), installation().parts().models, strict=True)
    ):
        warm_degc = np.interp(time_s, profile.time_s, mount_temperature_degc(profile, ENGINES[i // 2]))
        mm = advance(airframe.mounts[i], state, loads_n[i], 1 / ADC_HZ, warm_degc, accel["accel_z_g"])
        channels = {"deformation_mm": mm + airframe.lvdts[i].zero_mm, "temperature_degC": warm_degc, **accel}
        found.append(Mount(model.inputs(channels), shares_n[i], model, line("mach") > FLYING_MACH))
    return found


def started(mount: Mount, first: int) -> Late:
    model, window = mount.model, slice(first, first + round(WATCHED_S * ADC_HZ))
    rows, true_n = mount.rows[window], mount.share_n[window]
    own = np.array([name == "deformation_mm" for name in model.channels])
    unseen = Unseen(model)
    flying = bool(mount.flying[first])
    state = unseen.start(
        lambda mm: np.where(own, mm, rows[0]), rows.item(0, 0), None, LOAD_AGE_S, 0.0, CRUISE if flying else None
    )
    error_n, eternal_n = model.simulate(rows, state) - true_n, model.simulate(rows) - true_n
    age_s = np.arange(len(rows))[::EVERY] / ADC_HZ
    force_n, tau_s = unseen.doubts.T
    creep_n = (force_n * np.exp(-age_s[:, None] / tau_s)).sum(axis=1)
    friction_n = [unseen.friction_std_n(row) if unseen.branched else 0.0 for row in rows[::EVERY]]
    return Late(eternal_n[::EVERY], error_n[::EVERY], np.hypot(creep_n, friction_n), _own_n(mount, true_n[::EVERY]))


def _own_n(mount: Mount, true_n: Array) -> Array:
    """One sigma of a mount that was not tared, but for its start."""
    settings, valid = FusionSettings(), mount.model.spec.valid
    stiffness_n_mm = np.diff(valid.force_n).item() / np.diff(valid.deformation_mm).item()
    known_n = MODEL_STD_N, settings.mount_friction_std_n, settings.mount_zero_std_mm * stiffness_n_mm
    return np.sqrt(np.sum(np.square(known_n)) + (settings.mount_stiffness_std * true_n) ** 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flight", default=FLIGHTS[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[41, 42, 43, 44])
    parser.add_argument("--moments", type=float, nargs="+", default=[0, 640, 700, 800, 1000, 1500, 2400, 3600])
    arguments = parser.parse_args()
    table = Table("begins at, s", "taken for eternal: RMS, N", "RMS, N", "worst mean, N", "sigma, N", "inside, %")
    flights = [mounts_of(arguments.flight, seed, max(arguments.moments) + WATCHED_S) for seed in arguments.seeds]
    inside: list[float] = []
    for moment_s in arguments.moments:
        eternal, now, stds = [], [], []
        for mounts in flights:
            late = [started(mount, round(moment_s * ADC_HZ)) for mount in mounts]
            for a, b in (late[:2], late[2:]):
                eternal.append(a.eternal_error_n + b.eternal_error_n)
                now.append(a.error_n + b.error_n)
                stds.append(np.sqrt(a.own_n**2 + b.own_n**2 + (a.common_n + b.common_n) ** 2))
        share = 100 * float(np.mean(np.abs(now) <= SIGMAS_95 * np.array(stds)))
        inside.append(share)
        rms = [f"{np.sqrt(np.mean(np.square(errors))):.0f}" for errors in (eternal, now)]
        worst = f"{np.abs(np.mean(now, axis=1)).max():.0f}"
        table.add_row(f"{moment_s:g}", *rms, worst, f"{np.mean(stds):.0f}", f"{share:.1f}")
    Console().print(table)
    Console().print(f"inside over all: {np.mean(inside):.1f} %, {2 * len(flights)} engines")


if __name__ == "__main__":
    main()
