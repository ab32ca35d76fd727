"""Ten times more than can be worked on: estimates go on, what is shed is counted."""

from itertools import chain

from benchmarks.integrity_flight import on_the_wire, whole
from tests.conftest import small_aircraft
from thrustd.core.types import Estimate, Fault, Status
from thrustd.sources.merge import EventQueue, merged
from thrustd.twin.flight import scripted_flight

OVERLOAD = 10
ROOM = 2000  # events


class Flood:
    """Puts ten events for each that was taken: called by the queue's reader between two takes."""

    def __init__(self, queue, events):
        self._queue, self._events = queue, iter(events)
        self.put = 0
        self.ended = False

    def start(self):
        """Everything happens in `pour`."""

    stop = start

    def pour(self, count):
        for event in self._events:
            self._queue.put(event)
            self.put += 1
            count -= 1
            if count <= 0:
                return
        self.ended = True

    def is_set(self):
        """The stop flag: looked at before every take."""
        return self.ended and self._queue.waiting() == 0


def test_at_ten_times_the_rate_estimates_go_on_and_what_is_shed_is_counted():
    installation = small_aircraft()
    pipeline, queue = installation.pipeline(), EventQueue(ROOM)
    flown = on_the_wire(installation, *scripted_flight(40.0, 5), 5)
    flood = Flood(queue, whole(flown, 0, len(flown.wire.t_ns)))
    worked, estimates, told = 0, [], 0
    flood.pour(1)
    for event in chain.from_iterable(merged(queue, (flood,), flood)):
        flood.pour(OVERLOAD)
        worked += not isinstance(event, Fault)
        told += event.count if isinstance(event, Fault) else 0
        estimates += [output for output in pipeline.feed(event) if isinstance(output, Estimate)]
    assert worked + queue.shed_events == flood.put
    assert told == queue.shed_events > 0.5 * flood.put
    assert estimates[-1].t_ns - estimates[0].t_ns > 30e9
    assert any(estimate.status & Status.OVERLOAD for estimate in estimates)
