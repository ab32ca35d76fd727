"""Once a second from the estimation loop itself: alive, state saved, clock looked at. A hung loop is silent.

The loop's own events are the clock, so what beats is the loop and not a thread beside it.
"""

from collections.abc import Callable
from functools import reduce
from operator import or_

import sdnotify

from thrustd.core.types import Event, Fault, Status
from thrustd.onboard.checkpoint import Clocks
from thrustd.sinks.health_counts import HealthCounts

PERIOD_NS = 1_000_000_000
CLOCK_STEP_NS = 100_000_000  # a slewed clock moves by 0.5 ms per second at most
TROUBLES = (
    Status.NOT_RECORDING | Status.LINK_LOST | Status.OVERLOAD | Status.NO_CHECKPOINT
    | Status.DISAGREE | Status.SENSOR_EXCLUDED | Status.MOUNT_FAILED | Status.BROCHURE_FAILED
)  # fmt: skip


class ServiceManager:
    """systemd, when it started us; never waits for it."""

    def __init__(self) -> None:
        self._notifier = sdnotify.SystemdNotifier()
        if self._notifier.socket is not None:
            self._notifier.socket.setblocking(False)

    def say(self, message: str) -> None:
        self._notifier.notify(message)


def status_line(counts: HealthCounts, engines: tuple[str, ...], point: Callable[[], str]) -> str:
    """One line for `systemctl status`; `point`: of a test point, in words, or nothing."""
    latest = sorted(counts.latest.items())
    thrusts = [f"{engines[e]} {estimate.thrust_n:.0f} +- {estimate.thrust_std_n:.0f} N" for e, estimate in latest]
    bits = reduce(or_, (estimate.status for _, estimate in latest), 0)
    troubles = [str(bit.name).lower().replace("_", " ") for bit in Status(bits) & TROUBLES]
    degraded = [f"degraded: {', '.join(troubles)}"] if troubles else []
    return "; ".join([", ".join(thrusts) or "no estimate yet", *filter(None, [point()]), *degraded])


class Heartbeat:
    """Called after every batch of events; acts once a second of event time."""

    def __init__(
        self,
        service: ServiceManager,
        words: Callable[[], str],
        clocks: Callable[[], Clocks],
        put: Callable[[Event], None],
        save: Callable[[Clocks], None],
    ) -> None:
        """`words`: the status; `put`: faults into the event stream; `save`: the state, with the time it is of."""
        self._service, self._words, self._clocks, self._put, self._save = service, words, clocks, put, save
        self._offset_ns: int | None = None  # calendar minus monotonic
        self._due_ns = 0

    def take_time(self, t_ns: int) -> None:
        """Of the events that were worked on just now."""
        if t_ns < self._due_ns:
            return
        self._due_ns = t_ns + PERIOD_NS
        now = self._clocks()
        self._watch_clock(now)
        self._service.say(f"WATCHDOG=1\nSTATUS={self._words()}")
        self._save(now)

    def _watch_clock(self, now: Clocks) -> None:
        offset_ns = now.utc_ns - now.monotonic_ns
        step_ns = 0 if self._offset_ns is None else offset_ns - self._offset_ns
        self._offset_ns = offset_ns
        if abs(step_ns) > CLOCK_STEP_NS:
            self._put(Fault(now.monotonic_ns, "clock", "clock_step", count=max(1, abs(step_ns) // 1_000_000)))
