"""What a bus has as a whole is said of the bus, what one message has of that message."""

from thrustd.core.types import Fault
from thrustd.pipeline.fault_book import FaultBook
from thrustd.pipeline.wires import Wires

S = 1_000_000_000


def said(faults, places=None):
    """What goes out of these, and what is left when all are over."""
    wires, book, out = Wires(places or {}), FaultBook(), []
    for fault in faults:
        out += [told for one in wires.take(fault) if (told := book.take(one)) is not None] + book.due(fault.t_ns)
    return [*out, *book.due(faults[-1].t_ns + 10 * S)]


def test_a_bus_full_of_foreign_messages_is_one_line_that_counts():
    came = [Fault(k * S // 1000, f"can[Message{k % 100}]", "foreign") for k in range(10_000)]
    lines = said(came)
    assert {fault.where for fault in lines} == {"can[Message0]", "can"}
    assert sum(fault.count for fault in lines) == len(came)
    assert len(lines) < 15


def test_one_message_that_is_foreign_is_named():
    assert {fault.where for fault in said([Fault(k * S, "can[Mach]", "foreign") for k in range(5)])} == {"can[Mach]"}


def test_messages_that_fail_one_after_the_other_are_named():
    came = [Fault(10 * k * S, f"can[Message{k}]", "lost", count=2) for k in range(1, 4)]
    assert [fault.where for fault in said(came)] == [fault.where for fault in came]


def test_channels_of_the_adc_are_named_each():
    came = [Fault(k, f"adc[{k}]", "open") for k in range(4)]
    assert said(came) == came


def test_an_open_channel_is_one_line_and_its_mount_is_said_where_it_stays_dead():
    places = {"left_lower": ("adc", "adc[1]"), "left_upper": ("adc", "adc[0]")}
    opened, dead = Fault(5 * S, "adc[1]", "open"), Fault(6 * S, "left_lower", "dead")
    closed, alive = (fault._replace(t_ns=t * S, active=False) for t, fault in ((9, opened), (10, dead)))
    assert said([opened, dead, closed, alive], places) == [opened, closed]
    other = Fault(7 * S, "left_upper", "dead")
    assert said([opened, dead, other], places) == [opened, other]
    wires = Wires(places)
    assert [wires.take(fault) for fault in (opened, dead, closed)] == [[opened], [], [closed]]
    assert wires.due(10 * S) == []
    assert wires.due(13 * S) == [dead._replace(t_ns=13 * S)]
