"""The points of one flight for a drag polar: means of its steady, straight windows, and what is not sure about them.

The accelerometer's zero against pitch is one constant of a flight. Air data tell it, as well as the air was still: with
prior sigma s_0 (the aircraft's file) and the difference d of the two excess thrusts over n points, spread s_d,

    zero = d s_0^2 / (s_0^2 + s_d^2 / n),   sigma = s_0 (s_d / sqrt(n)) / sqrt(s_0^2 + s_d^2 / n)

No point is left out because its two excess thrusts disagree: nobody knows which of them is wrong there. Its variance is
the mean of what the flight says of all points and what the point says of itself, so it counts less the more they do:

    s_i^2 = (s_d^2 + (d_i - d)^2) / 2
"""

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.core.aircraft import Wing
from thrustd.core.columns import Flags, Floats, Integers
from thrustd.core.errors import RecordingError
from thrustd.core.measures import SIGMAS_95
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest.aerodynamics import Motion, coefficients, motion_of
from thrustd.flighttest.flight import Flight
from thrustd.flighttest.mass_sheet import MassSheet, mass_of
from thrustd.flighttest.uncertainty import FEWEST_VALUES, mean_of
from thrustd.flighttest.windows import Window, overlaps, steady_windows, windows_by

STRAIGHT_G = 0.05  # load factor within 1 +- this: no turn, no pull-up
SLOWEST_MACH = 0.1  # below: on the ground
LEAST_SPREAD_G = 0.001  # of the difference: a few points may agree by chance
MAD_SIGMA = 1.4826  # median absolute deviation -> sigma of a normal distribution
LEFT_OUT = "", "turns", "on the ground", "values missing"


class Zero(NamedTuple):
    """The accelerometer's zero against pitch and path in one flight."""

    mean_g: float
    std_g: float
    difference_g: float  # median of accelerometer minus air data


class Flown(NamedTuple):
    """Per point, each (n,); `flight`, `motion` and `mass_kg` are per second."""

    flight: Flight
    motion: Motion
    mass_kg: Floats
    windows: list[Window]
    missing_s: Integers  # of each, seconds that lack a value; means are of the others
    mach: Floats
    altitude_m: Floats
    alpha_rad: Floats
    area_pa_m2: Floats  # q S
    weight_n: Floats
    load_g: Floats
    excess_g: Floats  # by accelerometer, its zero taken out
    energy_g: Floats
    excess_std_g: Floats  # random part
    energy_std_g: Floats
    lift2_std: Floats  # random part of C_L^2
    thrust_n: dict[str, Floats]  # fused or brochure -> all engines together
    thrust_std_n: dict[str, Floats]  # of each engine (n, engines): systematic
    thrust_random_n: dict[str, Floats]
    mass_std: float  # relative
    zero: Zero
    why: Floats  # place in LEFT_OUT
    apart_g: Floats  # what accelerometer and air data differ by in this point, beyond the flight's usual difference
    spread_g: float  # its usual size

    @property
    def name(self) -> str:
        return self.flight.name

    @property
    def doubt_g(self) -> Floats:
        """One sigma (n,) of an excess thrust, of what the two of a point and of the flight say of one another."""
        return np.asarray(np.sqrt((self.spread_g**2 + self.apart_g**2) / 2.0))

    @property
    def used(self) -> Flags:
        return np.asarray(self.why == 0)


def flown(flight: Flight, wing: Wing, sheet: MassSheet | None, limits: SteadyLimits, marks: str | None = None) -> Flown:
    """RecordingError without mass, air data, accelerations or a steady, straight window."""
    windows = windows_by(flight, marks) if marks else []
    if shared := overlaps(windows):
        raise RecordingError(f"{flight.name}: {shared[0]}; expected windows apart: a polar counts every second once")
    flight = flight.per_second()
    mass_kg, mass_std_kg = mass_of(flight, sheet, wing)
    motion = motion_of(flight, wing)
    windows = windows or steady_windows(flight, limits)
    rows, known = _rows(flight, windows), _known(flight, motion)
    found = _point_means(flight, motion, mass_kg, mass_std_kg, wing, windows, [part[known[part]] for part in rows])
    return found._replace(missing_s=np.array([int((~known[part]).sum()) for part in rows]))


def _known(flight: Flight, motion: Motion) -> Flags:
    """Seconds (n,) in which all values of a point are known."""
    record = flight.record
    thrusts = [record[f"{kind}_N_{engine}"] for kind in ("thrust", "brochure") for engine in flight.engines]
    needed = record["mach"], record["pressure_altitude_m"], motion.excess_g, motion.energy_g, motion.load_g, *thrusts
    return np.asarray(np.isfinite(needed).all(axis=0))


def _rows(flight: Flight, windows: list[Window]) -> list[Integers]:
    edges = [np.searchsorted(flight.record.time_s, (window.start_s, window.end_s)) for window in windows]
    for window, (first, last) in zip(windows, edges, strict=True):
        if first == last:
            raise RecordingError(f"{flight.name}: no samples from {window.start_s:g} to {window.end_s:g} s")
    return [np.arange(first, last) for first, last in edges]


def _point_means(
    flight: Flight, motion: Motion, mass_kg: Floats, mass_std_kg: float, wing: Wing, windows: list[Window],
    rows: list[Integers],
) -> Flown:  # fmt: skip
    record = flight.record

    def means(column: Floats) -> Floats:
        return np.array([float(np.mean(column[part])) if len(part) >= FEWEST_VALUES else np.nan for part in rows])

    def randoms(column: Floats) -> Floats:
        return np.array([mean_of(column[part]).random_u95 / SIGMAS_95 for part in rows])

    sums = {
        kind: np.asarray(np.sum([record[f"{kind}_N_{engine}"] for engine in flight.engines], axis=0))
        for kind in ("thrust", "brochure")
    }
    stds = {
        kind: np.column_stack([means(record[f"{kind}_std_N_{engine}"]) for engine in flight.engines]) for kind in sums
    }
    load, energy, excess = means(motion.load_g), means(motion.energy_g), means(motion.excess_g)
    mach = means(record["mach"])
    zero, why, spread_g = _judge(excess - energy, load, mach, wing)
    lift = coefficients(motion, sums["thrust"], mass_kg, motion.excess_g).lift
    found = Flown(
        flight, motion, mass_kg, windows, np.zeros(len(rows), int), mach, means(record["pressure_altitude_m"]),
        means(motion.alpha_rad), means(motion.area_pa_m2), means(mass_kg) * STANDARD_GRAVITY_M_S2, load,
        excess - zero.mean_g, energy, randoms(motion.excess_g), randoms(motion.energy_g), randoms(lift * lift),
        {kind: means(total) for kind, total in sums.items()}, stds,
        {kind: randoms(total) for kind, total in sums.items()}, mass_std_kg / float(mass_kg.mean()), zero, why,
        excess - energy - zero.difference_g, spread_g,
    )  # fmt: skip
    if not found.used.any():
        raise RecordingError(f"{flight.name}: no steady window in straight flight; expected other --limit or --marks")
    return found


def _judge(difference_g: Floats, load_g: Floats, mach: Floats, wing: Wing) -> tuple[Zero, Floats, float]:
    """The accelerometer's zero, why points are left out, and the usual size of the difference beyond its median."""
    why = np.where(~(mach > SLOWEST_MACH), 2, np.where(abs(load_g - 1.0) > STRAIGHT_G, 1, 0))
    flying = (why == 0) & np.isfinite(difference_g)
    if not flying.any():
        return Zero(0.0, wing.accel_x_std_g, 0.0), why, 0.0
    middle = float(np.median(difference_g[flying]))
    spread = MAD_SIGMA * float(np.median(abs(difference_g[flying] - middle)))
    why[~np.isfinite(difference_g)] = 3
    of_mean = max(spread, LEAST_SPREAD_G) / sqrt(flying.sum())
    prior = wing.accel_x_std_g
    mean = middle * prior**2 / (prior**2 + of_mean**2)
    return Zero(mean, prior * of_mean / hypot(prior, of_mean), middle), why, spread
