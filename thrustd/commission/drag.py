"""Drag of the nacelles, from flight at idle: there a deck knows the thrust best against what the air does to a nacelle.

    A = (deck - mounts) / q       of engines together, over the rows where sigma_deck / q is least
    lean = what the mounts' thrust changes by with the load factor and the deck's does not, over the engine's weight

Mounts carry F - A q, and A is one number for nacelles of one design. The error of a deck is one error however long a
flight is: no row averages it out. So the rows within BEST of the least sigma_deck / q are taken, LEAST_S of them at
least, and sigma is theirs. In cruise a deck's error over Mach number looks like a nacelle's drag, and is as large.
Thirty seconds at flight idle, fast and steady, tell the most. Zeros and gains have to be calibrated before.

Mounts whose axis leans against the engine's carry a part of its weight. What 1 g makes of it is in their zeros;
pull-ups and push-overs show the rest: differences over LEAN_S, which no deck's slow error reaches.

The aircraft's file may say how they lean (`cant`), and its sigma: that is where the search begins, else at 0 +-
LEAN_STD_DEG. What is written is all of the lean and replaces that cant.

Flights are read as if the file held neither drag nor lean (`without_drag`); the drag that it holds is one more look
with the same deck. So the same flights again say the same again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from thrustd.core.calibration import Calibration, Drag, MountCalibration, write_calibration
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.measures import SIGMAS_95
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.flighttest.flight import deck_thrust
from thrustd.installation.installation import Installation
from thrustd.records.once import check_each_once
from thrustd.records.recording import Recording

BEST, LEAST_S = 1.25, 20.0
FLYING_MACH, STEADY_PCT_S = 0.18, 0.5
FAST_MACH, IDLE_PCT, ENOUGH_S = 0.35, 50.0, 30.0  # the stretch that a team is asked to fly
LEAN_S, LEAN_STD_DEG, DRAG_STD_M2 = 5, 3.0, 0.1  # differences over so long; priors where the aircraft's file has none
LEAST_STD_DEG = 0.01
UNLIKELY = 3.0  # sigmas below no drag: something else is wrong


@dataclass(frozen=True, slots=True)
class FlightDrag:
    """What one flight tells."""

    flight: str
    m2: float
    std_m2: float
    seconds: float
    mach: float
    n1_pct: float
    lean_deg: list[float]  # by engine
    lean_std_deg: list[float]

    @property
    def where(self) -> str:
        return f"{self.seconds:.0f} s at Mach {self.mach:.2f}, N1 {self.n1_pct:.0f} %"


@dataclass(frozen=True, slots=True)
class DragFit:
    """What the flights say, and of the drag what the file said before."""

    m2: float
    std_m2: float
    flights: list[FlightDrag]
    lean_deg: list[float]  # by engine
    lean_std_deg: list[float]


def fit_drag(flights: Sequence[Recording], installation: Installation) -> DragFit:
    """`flights`: columns of `flight_columns` by `without_drag(installation)`.

    RecordingError, one line, when they tell nothing, or no drag at all.
    """
    check_each_once(flights)
    found = [_flight_drag(flight.resample(1.0), installation) for flight in flights]
    prior = without_drag(installation).aircraft().installation.drag_m2 ** -2
    looks = [(one.m2, one.std_m2**-2) for one in found]
    m2, known = _mean(looks), max(weight for _, weight in looks)  # a deck's error at idle is in every flight
    if m2 < -UNLIKELY * known**-0.5:
        told = f"{m2:.3f} +- {SIGMAS_95 * known**-0.5:.3f} m2"
        raise RecordingError(f"{flights[0].name}: {told}; expected a drag: are zeros and gains calibrated?")
    before = calibration.drag if (calibration := installation.calibration()) is not None else None
    if before is not None and (weight := before.std_m2**-2 - prior) > 0.0:
        m2 = _mean([*looks, (before.m2 * before.std_m2**-2 / weight, weight)])
        known = max(known, weight)
    lean_deg, lean_std_deg = (np.array([getattr(one, name) for one in found]) for name in ("lean_deg", "lean_std_deg"))
    cant_deg, cant_std_deg = _cants(installation)
    weights, assumed = lean_std_deg**-2.0, cant_std_deg**-2.0  # the prior is in every flight's
    together = weights.sum(axis=0) - (len(found) - 1) * assumed
    leans = cant_deg + np.sum(weights * (lean_deg - cant_deg), axis=0) / together
    told_m2, std_m2 = m2 * known / (known + prior), (known + prior) ** -0.5
    return DragFit(told_m2, std_m2, found, leans.tolist(), (together**-0.5).tolist())


def missing_stretch(one: FlightDrag) -> str:
    """What a flight lacks to tell the drag well; empty where it has it."""
    if one.mach >= FAST_MACH and one.n1_pct <= IDLE_PCT:
        return ""
    return (
        f"{one.flight}: no steady {ENOUGH_S:g} s fast at flight idle, which tell a drag best; the best here are"
        f" {one.where}, expected Mach {FAST_MACH:g} or more and N1 {IDLE_PCT:g} % at most"
    )


def _cants(installation: Installation) -> tuple[Floats, Floats]:
    """By engine: what the aircraft's file says of its mounts' axes, and one sigma, deg."""
    level, engines = without_drag(installation), installation.config.aircraft.engines
    aircraft, rows = level.aircraft(), []
    for engine in engines:
        mine = [level.place(installation.config.mount[i].name) for i in level.config.mounts_of(engine)]
        known = [cant for place in mine if (cant := aircraft.cant_of(place.mount, engine)) is not None]
        std_deg = max((cant.std_deg for cant in known), default=LEAN_STD_DEG)
        part = sum(place.share for place in mine)
        rows.append((sum(place.share * place.lean_deg for place in mine) / part, max(std_deg, LEAST_STD_DEG)))
    cant_deg, cant_std_deg = np.array(rows).T
    return cant_deg, cant_std_deg


def _mean(looks: Sequence[tuple[float, float]]) -> float:
    """Of (value, weight)."""
    return sum(value * weight for value, weight in looks) / sum(weight for _, weight in looks)


def _flight_drag(flight: Recording, installation: Installation) -> FlightDrag:
    config, deck = installation.config, installation.parts().deck
    engines = list(config.aircraft.engines)
    q_pa = flight["dynamic_pressure_Pa"]
    decks = [deck_thrust(flight, deck, number, engine) for number, engine in enumerate(engines)]
    carried = []
    for engine in engines:
        mine = [installation.place(config.mount[i].name) for i in config.mounts_of(engine)]
        part = sum(place.share for place in mine)  # less than 1 where a mount has no transducer
        carried.append(sum(flight[f"model_N_{place.mount}"] for place in mine) / part)
    off_n = np.array([deck_n - mounts_n for (deck_n, *_), mounts_n in zip(decks, carried, strict=True)])
    moves = np.max([abs(np.gradient(flight[f"n1_pct_{engine}"])) for engine in engines], axis=0)
    flies = (flight["mach"] > FLYING_MACH) & (moves < STEADY_PCT_S) & np.isfinite(off_n).all(axis=0)
    load_g = flight.channels.get("accel_z_g", np.ones(len(flight)))
    more_n = installation.aircraft().engine_mass_kg * STANDARD_GRAVITY_M_S2 * np.nan_to_num(load_g - 1.0)
    cant_deg, cant_std_deg = _cants(installation)
    priors = np.radians(cant_std_deg).tolist()
    seen = zip(off_n, priors, strict=True)
    leans = [_lean(np.where(flies, each, np.nan), more_n, q_pa, prior) for each, prior in seen]
    with np.errstate(invalid="ignore", divide="ignore"):
        std_n = np.mean(
            [np.hypot(std, more_n * lean[1]) for (_, std, *_), lean in zip(decks, leans, strict=True)], axis=0
        )
        doubt = np.where(flies & np.isfinite(std_n), std_n / q_pa, np.inf)
    if np.isfinite(doubt).sum() < LEAST_S:
        raise RecordingError(f"{flight.name}: less than {LEAST_S:g} s of steady flight with mounts, fuel and air data")
    used = doubt <= BEST * np.sort(doubt)[int(LEAST_S) - 1]
    n1_pct = float(np.mean([flight[f"n1_pct_{engine}"][used].mean() for engine in engines]))
    level_n = np.mean([each - lean[0] * more_n for each, lean in zip(off_n, leans, strict=True)], axis=0)
    m2, std_m2 = float(np.mean(level_n[used] / q_pa[used])), float(np.mean(doubt[used]))
    more_deg, std_deg = np.degrees(leans).T
    seconds, mach = float(used.sum()), float(flight["mach"][used].mean())
    return FlightDrag(flight.name, m2, std_m2, seconds, mach, n1_pct, (cant_deg + more_deg).tolist(), std_deg.tolist())


def _lean(off_n: Floats, more_n: Floats, q_pa: Floats, prior_rad: float) -> tuple[float, float]:
    """(slope of `off_n` over `more_n`, its sigma), all once a second, rad.

    Who pulls up is fast and who pushes over is slow: drag, or a deck's error over Mach number, changes with it.
    """
    y, x, q = (each[LEAN_S:] - each[:-LEAN_S] for each in (off_n, more_n, q_pa))
    good = np.isfinite(y + x + q)
    columns, noise = np.column_stack((x, q))[good], 1.0
    prior = np.diag([prior_rad**-2.0, DRAG_STD_M2**-2.0])
    for _ in range(3):  # differences of a second and the next share their noise
        covariance = np.linalg.inv(columns.T @ columns / noise + prior)
        slopes = covariance @ (columns.T @ y[good]) / noise
        noise = max(2 * LEAN_S * float(np.mean((y[good] - columns @ slopes) ** 2)), 1.0) if good.any() else 1.0
    return float(slopes[0]), float(covariance[0, 0] ** 0.5)


def without_drag(installation: Installation) -> Installation:
    """As if its calibration held nothing that flights said: mounts lean as the aircraft's file has it."""
    known = installation.calibration()
    if known is None:
        return installation
    level = {
        name: msgspec.structs.replace(mount, lean_deg=0.0, lean_std_deg=None) for name, mount in known.mount.items()
    }
    return installation.calibrated_by(write_calibration(msgspec.structs.replace(known, drag=None, mount=level)))


def with_drag(calibration: Calibration, fit: DragFit, installation: Installation, on: str) -> Calibration:
    """The file with the nacelles' drag, and how the mounts lean: all of it, the aircraft file's cant is in it."""
    mounts, config = dict(calibration.mount), installation.config
    level, more_deg = without_drag(installation), np.array(fit.lean_deg) - _cants(installation)[0]
    for each in config.mount:
        old = mounts.get(each.name, MountCalibration())
        engine = config.aircraft.engines.index(each.engine)
        lean_deg = level.place(each.name).lean_deg + more_deg.item(engine)
        told = {"lean_deg": round(lean_deg, 3), "lean_std_deg": round(fit.lean_std_deg[engine], 3)}
        mounts[each.name] = msgspec.structs.replace(old, **told)
    drag = Drag(on=on, m2=round(fit.m2, 5), std_m2=round(fit.std_m2, 5))
    return msgspec.structs.replace(calibration, on=on, drag=drag, mount=mounts)
