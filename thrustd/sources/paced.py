"""Playback speed as a wrapper: the same events, handed out no earlier than their time says."""

import time
from collections.abc import Callable, Iterable, Iterator

from thrustd.core.types import Event, Frame

BUS = "can"  # all other frames are serial bytes
WIRE_BITS_PER_BYTE = 10  # 8N1: start bit, eight data bits, stop bit


def paced(
    events: Iterable[Event],
    speed: float,
    clock_s: Callable[[], float] = time.monotonic,
    sleep_s: Callable[[float], None] = time.sleep,
) -> Iterator[Event]:
    """`events` at `speed` x real time (1 = as flown). Late events follow at once; order never changes."""
    start_s, start_ns = clock_s(), None
    for event in events:
        if start_ns is None:
            start_ns = event.t_ns
        ahead_s = (event.t_ns - start_ns) / 1e9 / speed - (clock_s() - start_s)
        if ahead_s > 0:
            sleep_s(ahead_s)
        yield event


def at_baud(
    events: Iterable[Event],
    baud: float,
    clock_s: Callable[[], float] = time.monotonic,
    sleep_s: Callable[[float], None] = time.sleep,
) -> Iterator[Event]:
    """`events`, serial bytes no faster than a UART sends them: whoever was held up does not catch up in one burst."""
    free_s = 0.0
    for event in events:
        if isinstance(event, Frame) and event.channel != BUS:
            now_s = clock_s()
            if free_s > now_s:
                sleep_s(free_s - now_s)
            free_s = max(free_s, now_s) + len(event.data) * WIRE_BITS_PER_BYTE / baud
        yield event
