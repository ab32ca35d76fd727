"""An engine start in front of a recording that begins at idle, as a daemon that is powered first sees it.

The aircraft stands as in the recording's first seconds; the engines are off, then start one after the other and idle.
"""

import numpy as np

from thrustd.core.atmosphere import ZERO_CELSIUS_K
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.engine import spool_rate_pct_s, steady_fuel_kg_s, steady_n2_pct

SIDES = ("left", "right")
OFF_S = 40.0
BETWEEN_S = 12.0  # from one engine's start to the next one's, as in the script
IDLING_S = 20.0  # of the second engine, before the recording begins
FIRST_S = 5.0  # of the recording: how the aircraft stands, and its idle
LOWEST_IDLE_PCT, HIGHEST_IDLE_PCT = 15.0, 45.0
NEAR_PCT = 0.1


def with_engine_start(record: Recording) -> Recording:
    """The recording (no values missing) behind an engine start: its own seconds count from then on that much later."""
    first, hz = slice(0, max(round(FIRST_S * record.sample_hz), 1)), record.sample_hz
    held = {name: float(column[first].mean()) for name, column in record.channels.items()}
    n1_pct = [_spool_up(_idle_pct(record, held, side), hz, number) for number, side in enumerate(SIDES)]
    n = len(n1_pct[-1]) + round(IDLING_S * hz)
    front = {name: np.full(n, value) for name, value in held.items()}
    for side, rising_pct in zip(SIDES, n1_pct, strict=True):
        front |= _engine(held, side, np.append(rising_pct, np.full(n - len(rising_pct), rising_pct[-1])))
    columns = {name: np.concatenate([front[name], column]) for name, column in record.channels.items()}
    columns["time_s"] = np.append(record.time_s[0] + np.arange(n) / hz, record.time_s + n / hz)
    note = f"an engine start of {n / hz:.1f} s was put in front"
    return make_recording(record.name, columns, record.metadata, record.sha256, (*record.notes, note))


def _idle_pct(record: Recording, held: dict[str, float], side: str) -> float:
    idle_pct = held[f"n1_pct_{side}"]
    if not LOWEST_IDLE_PCT < idle_pct < HIGHEST_IDLE_PCT:
        raise RecordingError(
            f"{record.name}: n1_pct_{side} is {idle_pct:.1f} % in the first seconds;"
            f" expected an idle of {LOWEST_IDLE_PCT:g} to {HIGHEST_IDLE_PCT:g} % to start the engines to"
        )
    return idle_pct


def _spool_up(idle_pct: float, hz: float, number: int) -> Floats:
    """N1 [%] from the beginning until engine `number` idles."""
    n1_pct = [0.0] * round((OFF_S + number * BETWEEN_S) * hz)
    while n1_pct[-1] < idle_pct - NEAR_PCT:
        n1_pct.append(n1_pct[-1] + spool_rate_pct_s(n1_pct[-1], idle_pct, 0.0) / hz)
    return np.array([*n1_pct, idle_pct])


def _engine(held: dict[str, float], side: str, n1_pct: Floats) -> dict[str, Floats]:
    """Columns of an engine along N1 (n,): the steady lines, scaled so that they meet the recorded idle."""
    mach, altitude_m, static_k = (
        np.full(len(n1_pct), value)
        for value in (held["mach"], held["pressure_altitude_m"], held["sat_degC"] + ZERO_CELSIUS_K)
    )
    lines = {
        f"n2_pct_{side}": steady_n2_pct(n1_pct, mach, static_k),
        f"fuel_flow_kg_s_{side}": steady_fuel_kg_s(n1_pct, mach, altitude_m, static_k),
    }
    return {
        f"n1_pct_{side}": n1_pct,
        **{name: held[name] * line / line[-1] for name, line in lines.items() if name in held},
    }
