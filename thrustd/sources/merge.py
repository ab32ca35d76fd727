"""Many receivers, one stream: whatever arrives goes through one bounded queue in arrival order.

Each receiver is a thread that stamps monotonic time and puts events; the reader takes them. When the reader is too
slow the oldest frames are shed and counted (fresh data is worth more than old), and the count travels as a fault.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Event as Flag
from threading import Lock
from typing import Protocol

from thrustd.types import Event, Fault

MAX_EVENTS = 20_000  # about 5 s of 1 kHz ADC and 3 kHz CAN
TAKE_EVENTS = 256  # at most so many between two looks at the stop flag
POLL_S = 0.1

Put = Callable[[Event], None]


class Receiver(Protocol):
    """A thread that puts events until it is stopped."""

    def start(self) -> None: ...

    def stop(self) -> None:
        """Return when nothing more will be put."""


class EventQueue:
    """Bounded; the oldest frames and ticks go first, faults stay. `put` may be called from any thread."""

    __slots__ = ("_counting", "_max_events", "_queue", "shed_events")

    def __init__(self, max_events: int = MAX_EVENTS) -> None:
        self._queue: SimpleQueue[Event] = SimpleQueue()
        self._max_events = max_events
        self._counting = Lock()
        self.shed_events = 0  # since the start

    def put(self, event: Event) -> None:
        self._queue.put(event)
        if self._queue.qsize() > self._max_events:
            self._shed()

    def waiting(self) -> int:
        """Events that nobody has taken yet."""
        return self._queue.qsize()

    def take(self, timeout_s: float = POLL_S) -> list[Event]:
        """What has arrived, waiting up to `timeout_s` for the first event."""
        events: list[Event] = []
        with suppress(Empty):
            events.append(self._queue.get(timeout=timeout_s))
            for _ in range(min(self._queue.qsize(), TAKE_EVENTS)):
                events.append(self._queue.get_nowait())
        return events

    def _shed(self) -> None:
        """Throw the oldest event away; faults go round to the back, at most once each."""
        with suppress(Empty):
            oldest = self._queue.get_nowait()
            for _ in range(self._max_events):
                if not isinstance(oldest, Fault):
                    break
                self._queue.put(oldest)
                oldest = self._queue.get_nowait()
            with self._counting:
                self.shed_events += 1


def merged(queue: EventQueue, receivers: Sequence[Receiver], stopped: Flag, poll_s: float = POLL_S) -> Iterator[Event]:
    """Start `receivers`, yield what they put until `stopped` is set, then stop them."""
    told = 0
    try:
        for receiver in receivers:
            receiver.start()
        while not stopped.is_set():
            events = queue.take(poll_s)
            shed = queue.shed_events
            if events and shed > told:
                yield Fault(events[0].t_ns, "queue", "queue_overrun", shed - told)
                told = shed
            yield from events
    finally:
        for receiver in receivers:
            receiver.stop()
