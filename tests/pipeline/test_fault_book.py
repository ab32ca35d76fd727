"""Faults are thinned, never lost: what goes out adds up to what came in."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from thrustd.core.types import Fault
from thrustd.pipeline.fault_book import REPEAT_AFTER_NS, FaultBook

STEPS = st.lists(st.tuples(st.integers(0, 400_000_000), st.sampled_from("ab"), st.integers(1, 5)), max_size=80)


@given(STEPS)
def test_counts_add_up_and_no_kind_goes_out_twice_a_second(steps):
    book, t_ns, sent, came = FaultBook(), 0, [], 0
    for dt_ns, kind, count in steps:
        t_ns += dt_ns
        sent += book.due(t_ns)
        came += count
        now = book.take(Fault(t_ns, "adc", kind, count=count))
        sent += [now] if now else []
    sent += book.due(t_ns + REPEAT_AFTER_NS)
    assert sum(fault.count for fault in sent) == came
    for kind in "ab":
        times = [fault.t_ns for fault in sent if fault.kind == kind]
        assert all(later - earlier >= REPEAT_AFTER_NS for earlier, later in pairwise(times))


def test_the_first_of_a_kind_goes_out_at_once():
    assert FaultBook().take(Fault(0, "adc", "damaged")) == Fault(0, "adc", "damaged")


@given(st.lists(st.integers(0, 700_000_000), min_size=1, max_size=60))
def test_what_went_out_last_is_how_it_is(steps):
    """A fault that begins and ends in turn, whenever it likes."""
    book, t_ns, sent, active = FaultBook(), 0, [], False
    for dt_ns in steps:
        t_ns, active = t_ns + dt_ns, not active
        sent += book.due(t_ns)
        now = book.take(Fault(t_ns, "n1_pct[0]", "stale", active))
        sent += [now] if now else []
    for late_ns in range(0, 2 * REPEAT_AFTER_NS + 1, REPEAT_AFTER_NS // 10):
        sent += book.due(t_ns + late_ns)
    assert sent[-1].active == active
    assert sum(fault.count for fault in sent) == len(steps)
