"""Transients of the engines: spool-ups and -downs with time, overshoot and rate; flame-out and surge candidates.

    throttle    N1 moves faster than MOVING_PCT_S, by LEAST_PCT or more; time until 95 % of the change, overshoot beyond
                the level that it settles at, largest rate
    flame-out   in the air: N1 falls below every idle, or the fuel is a fifth of what the fan speed stands for
    surge       the thrust steps away from what N1 explains while N1 itself does not move: the change of F - F_deck(N1)
                within half a second is beyond SIGMAS of its usual size in this flight and LEAST_SURGE of the largest

F is the mounts' thrust. Where there is none nothing measures the thrust: no surge is looked for, and thrust changes are
the fuel flow's. A candidate is a place to look at, not a verdict.
"""

from collections.abc import Iterator

import msgspec
import numpy as np
from scipy.ndimage import median_filter

from thrustd.brochure.deck import Deck
from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import RecordingError
from thrustd.flighttest.flight import AIR, Flight, deck_thrust
from thrustd.records.recording import Recording
from thrustd.records.rows import Row

MOVING_PCT_S, LEAST_PCT = 1.0, 5.0
JOINED_S = 2.0  # pauses of the throttle shorter than this are one movement
SETTLE_S = 4.0  # after it: the level that it settles at
OUT_PCT, RUNNING_PCT = 20.0, 25.0  # N1
STARVED, STARVED_S = 0.2, 3.0  # fuel flow's thrust over N1's; a cut throttle starves an engine for a second or two
FLYING_MACH = 0.1
SIGMAS, LEAST_SURGE = 8.0, 0.05
QUIET_S = 5.0  # around a movement of the throttle nothing is called a surge
HALF_S = 0.5
MAD_SIGMA = 1.4826
SLOWEST_HZ = 0.9


class Transient(msgspec.Struct, frozen=True):
    """One event; what does not apply to its kind is NaN."""

    engine: str
    kind: str  # spool up, spool down, flame-out candidate, surge candidate
    start_s: float
    seconds: float  # until 95 % of the change; of a candidate, how long it lasted
    n1_from_pct: float
    n1_to_pct: float
    overshoot_pct: float  # of N1, beyond where it settles
    largest_rate_pct_s: float
    thrust_change_n: float


class Transients(msgspec.Struct, frozen=True):
    flight: str
    events: list[Transient]
    missing_s: dict[str, int]  # seconds without a value, by channel: an event there may be missed

    @property
    def candidates(self) -> list[Transient]:
        return [event for event in self.events if "candidate" in event.kind]

    def rows(self) -> list[Row]:
        return [{"flight": self.flight, **msgspec.to_builtins(event)} for event in self.events]


def find_transients(flight: Flight, deck: Deck) -> Transients:
    """Every event of a flight in order of time; RecordingError when it is sampled too slowly."""
    record = flight.record
    if record.sample_hz < SLOWEST_HZ:
        raise RecordingError(f"{flight.name}: {record.sample_hz:g} Hz; transients need a sample a second or more")
    events = [
        event
        for number, engine in enumerate(flight.engines)
        for event in _engine(record, engine, number, deck, flight.fused)
    ]
    needed = *AIR, *(f"{name}_{engine}" for name in ("n1_pct", "fuel_flow_kg_s") for engine in flight.engines)
    missing_s = flight.missing_s(name for name in needed if name in record)
    return Transients(flight.name, sorted(events, key=lambda event: event.start_s), missing_s)


def movements(time_s: Floats, n1_pct: Floats) -> list[tuple[int, int]]:
    """First and last sample of every movement of a throttle."""
    return _stretches(time_s, abs(_rate(time_s, n1_pct)) > MOVING_PCT_S, JOINED_S)


def _engine(record: Recording, engine: str, number: int, deck: Deck, fused: bool) -> Iterator[Transient]:
    time_s, n1_pct = record.time_s, record[f"n1_pct_{engine}"]
    rate = _rate(time_s, n1_pct)
    said = deck_thrust(record, deck, number, engine)
    by_fuel_n, by_n1_n = said.fuel_flow_n, said.n1_n
    thrust_n = record[f"mount_N_{engine}"] if fused and f"mount_N_{engine}" in record else by_fuel_n
    moves = movements(time_s, n1_pct)
    for first, last in moves:
        event = _movement(record, engine, n1_pct, rate, thrust_n, first, last)
        if event is not None:
            yield event
    flying = record["mach"] > FLYING_MACH
    fuel = record.channels.get(f"fuel_flow_kg_s_{engine}", by_fuel_n)  # no fuel is no thrust, which no deck holds
    starved = flying & (n1_pct > RUNNING_PCT) & ((by_fuel_n < STARVED * by_n1_n) | (fuel <= 0.0))
    out = flying & (n1_pct < OUT_PCT) & (np.maximum.accumulate(np.nan_to_num(n1_pct)) > RUNNING_PCT)
    for flags in (starved, out):
        for first, last in _stretches(time_s, flags, STARVED_S):
            if time_s[last] - time_s[first] >= STARVED_S:
                yield _candidate("flame-out candidate", engine, time_s, n1_pct, thrust_n, first, last)
    if not fused:
        return
    still = flying & ~_near(time_s, moves)
    for first, last in _stretches(time_s, _surging(time_s, thrust_n - by_n1_n, still, thrust_n), JOINED_S):
        yield _candidate("surge candidate", engine, time_s, n1_pct, thrust_n, first, last)


def _movement(
    record: Recording, engine: str, n1_pct: Floats, rate: Floats, thrust_n: Floats, first: int, last: int
) -> Transient | None:
    """None when it is too small to be one."""
    time_s = record.time_s
    until = int(np.searchsorted(time_s, time_s[last] + SETTLE_S))
    rest = int(np.searchsorted(time_s, time_s[last] + SETTLE_S / 2))
    settled = _median(n1_pct[rest : until + 1] if rest <= until and rest < len(n1_pct) else n1_pct[last:])
    begun = float(n1_pct[max(first - 1, 0)])
    change = settled - begun
    if not abs(change) >= LEAST_PCT:
        return None
    travelled = (n1_pct[first : until + 1] - begun) / change
    there = np.flatnonzero(travelled >= 0.95)
    seconds = float(time_s[first + int(there[0])] - time_s[first]) if len(there) else float("nan")
    overshoot = max(float(np.nanmax(travelled)) - 1.0, 0.0) * abs(change)
    kind = "spool up" if change > 0 else "spool down"
    fastest = float(np.nanmax(abs(rate[first : last + 1])))
    thrust = _median(thrust_n[last : until + 1]) - float(thrust_n[max(first - 1, 0)])
    return Transient(engine, kind, float(time_s[first]), seconds, begun, settled, overshoot, fastest, thrust)


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def _candidate(
    kind: str, engine: str, time_s: Floats, n1_pct: Floats, thrust_n: Floats, first: int, last: int
) -> Transient:
    nothing = float("nan")
    before = max(first - 1, 0)
    step = float(thrust_n[min(last, len(thrust_n) - 1)] - thrust_n[before])
    lasted = float(time_s[last] - time_s[first])
    return Transient(
        engine, kind, float(time_s[first]), lasted, float(n1_pct[before]), float(n1_pct[last]), nothing, nothing, step
    )


def _surging(time_s: Floats, unexplained_n: Floats, still: Flags, thrust_n: Floats) -> Flags:
    """Where the thrust that N1 does not explain steps; nothing steps where it is not known."""
    half = max(round(HALF_S / float(np.median(np.diff(time_s)))), 1)
    there = np.isfinite(unexplained_n)
    known = still & there
    if known.sum() < 10 * half:
        return np.zeros(len(time_s), bool)
    calm_n = median_filter(np.interp(time_s, time_s[there], unexplained_n[there]), 2 * (half // 2) + 1)
    step_n = np.zeros(len(calm_n))
    step_n[half:-half] = abs(calm_n[2 * half :] - calm_n[: -2 * half])
    known[half:-half] &= there[2 * half :] & there[: -2 * half]
    known[half:-half] &= time_s[2 * half :] - time_s[: -2 * half] < 4.0 * HALF_S
    usual = MAD_SIGMA * float(np.median(step_n[known]))  # steps are as often up as down
    most = float(np.nanquantile(abs(thrust_n[known]), 0.99))
    return np.asarray(known & (step_n > max(SIGMAS * usual, LEAST_SURGE * most)))


def _rate(time_s: Floats, n1_pct: Floats) -> Floats:
    """Per second, over a second around each sample."""
    after, before = (np.interp(time_s + shift, time_s, n1_pct) for shift in (HALF_S, -HALF_S))
    return np.asarray(after - before)


def _near(time_s: Floats, moves: list[tuple[int, int]]) -> Flags:
    near = np.zeros(len(time_s), bool)
    for first, last in moves:
        near |= (time_s > time_s[first] - QUIET_S) & (time_s < time_s[last] + QUIET_S)
    return near


def _stretches(time_s: Floats, on: Flags, joined_s: float) -> list[tuple[int, int]]:
    """First and last sample of every stretch of true, shorter pauses bridged."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], on.astype(int), [0]))))
    found: list[tuple[int, int]] = []
    for first, behind in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if found and time_s[first] - time_s[found[-1][1]] < joined_s:
            found[-1] = found[-1][0], behind - 1
        else:
            found.append((first, behind - 1))
    return found
