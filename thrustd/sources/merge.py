"""Many receivers, one stream: whatever arrives goes through one bounded queue in arrival order.

Each receiver is a thread that stamps monotonic time and puts events; the reader takes them. What completes nothing
wakes nobody: CAN messages, which hold until the next sample anyway, and frames that arrive before the reader said that
something is due. At 1 kHz that leaves one context switch in thirty. When the reader is too slow the oldest frames are
shed and counted (fresh data is worth more than old), and the count travels as a fault.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from threading import Event as Flag
from threading import Lock
from typing import Protocol

from thrustd.core.types import Event, Fault, Frame

MAX_EVENTS = 20_000  # about 5 s of 1 kHz ADC and 3 kHz CAN
TAKE_EVENTS = 256  # at most so many between two looks at the stop flag
POLL_S = 0.1

Put = Callable[[Event], None]
Quiet = Callable[[], int]  # frames stamped before this [ns] may wait


class Receiver(Protocol):
    """A thread that puts events until it is stopped."""

    def start(self) -> None: ...

    def stop(self) -> None:
        """Return when nothing more will be put."""


class EventQueue:
    """Bounded; the oldest frames and ticks go first, faults stay. One thread takes, any thread puts."""

    __slots__ = ("_bell", "_counting", "_events", "_max_events", "_more", "quiet_until_ns", "shed_events")

    def __init__(self, max_events: int = MAX_EVENTS) -> None:
        self._events: deque[Event] = deque()
        self._bell = Lock()  # free = there is something to do; taken = the reader may sleep
        self._bell.acquire()
        self._max_events = max_events
        self._more = False  # left over from the last `take`
        self._counting = Lock()
        self.quiet_until_ns = 0
        self.shed_events = 0  # since the start

    def put(self, event: Event) -> None:
        """Append, and wake the reader; for a frame not before `quiet_until_ns`."""
        self._events.append(event)
        early = type(event) is Frame and event[0] < self.quiet_until_ns
        if not early and self._bell.locked():
            with suppress(RuntimeError):  # another thread was faster
                self._bell.release()
        if len(self._events) > self._max_events:
            self._shed()

    def leave(self, event: Event) -> None:
        """Append without waking anybody: for what changes nothing until the next sample or tick."""
        self._events.append(event)
        if len(self._events) > self._max_events:
            self._shed()

    def waiting(self) -> int:
        """Events that nobody has taken yet."""
        return len(self._events)

    def take(self, timeout_s: float = POLL_S) -> list[Event]:
        """What has arrived, when something was put or after `timeout_s`."""
        events = self._events
        if not self._more and self._bell.acquire(timeout=timeout_s) and not events:
            self._bell.acquire(timeout=timeout_s)  # that ring was for events already taken
        taken: list[Event] = []
        with suppress(IndexError):  # shed meanwhile
            for _ in range(min(len(events), TAKE_EVENTS)):
                taken.append(events.popleft())
        self._more = len(taken) == TAKE_EVENTS
        return taken

    def _shed(self) -> None:
        """Throw the oldest event away; faults go round to the back, at most once each."""
        with suppress(IndexError):
            oldest = self._events.popleft()
            for _ in range(self._max_events):
                if not isinstance(oldest, Fault):
                    break
                self._events.append(oldest)
                oldest = self._events.popleft()
            with self._counting:
                self.shed_events += 1


def merged(
    queue: EventQueue, receivers: Sequence[Receiver], stopped: Flag, poll_s: float = POLL_S, quiet: Quiet = lambda: 0
) -> Iterator[list[Event]]:
    """Start `receivers`, yield what they put until `stopped` is set, then stop them. `quiet`: see `EventQueue.put`."""
    told = 0
    try:
        for receiver in receivers:
            receiver.start()
        while not stopped.is_set():
            queue.quiet_until_ns = quiet()
            events = queue.take(poll_s)
            shed = queue.shed_events
            if events and shed > told:
                events.insert(0, Fault(events[0].t_ns, "queue", "overrun", count=shed - told))
                told = shed
            if events:
                yield events
    finally:
        for receiver in receivers:
            receiver.stop()
