"""Playback speed as a wrapper: the same events, handed out no earlier than their time says."""

import time
from collections.abc import Callable, Iterable, Iterator

from thrustd.types import Event


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
