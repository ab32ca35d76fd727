"""What the journal says of faults: once each, and never in the way."""

import sys
from errno import EIO
from threading import Event as Flag

import pytest

from thrustd.core.types import Fault
from thrustd.sinks.journal import MOST_WAITING, OVER_NS, Journal, say


def told(faults):
    lines = []
    journal = Journal(lines.append)
    for fault in faults:
        journal.write_output(fault)
    journal.close()
    return lines


def test_a_fault_is_told_once_with_its_place_and_what_it_means():
    lines = told([Fault(n, "adc", "unplugged") for n in range(5)])
    assert lines == ["adc: unplugged: a port or bus disappeared or refuses to open"]


def test_it_is_told_again_when_it_was_over_for_long():
    lasting = [Fault(n * OVER_NS // 2, "adc", "damaged") for n in range(6)]
    assert len(told(lasting)) == 1
    assert len(told([*lasting, Fault(10 * OVER_NS, "adc", "damaged")])) == 2


def test_the_end_of_one_that_was_told_is_told_once():
    back = [
        fault for n in range(5) for fault in (Fault(n, "log", "not_recorded"), Fault(n, "log", "not_recorded", False))
    ]
    began, over = told([Fault(0, "adc", "unplugged", False), *back])
    assert began.startswith("log: not_recorded: ") and over == "log: not_recorded: over"


def test_places_and_kinds_are_told_apart():
    lines = told([Fault(0, "adc", "damaged"), Fault(0, "can", "unplugged"), Fault(0, "adc", "unplugged")])
    assert [line.split(":")[0] for line in lines] == ["adc", "can", "adc"]


def test_a_terminal_that_takes_nothing_holds_up_nobody():
    stuck, lines = Flag(), []

    def write(line):
        stuck.wait()
        lines.append(line)

    journal = Journal(write)
    for n in range(10 * MOST_WAITING):
        journal.write_output(Fault(n, f"place {n}", "damaged"))
    stuck.set()
    journal.close()
    assert 0 < len(lines) <= MOST_WAITING + 1


class Gone:
    def __init__(self, error):
        self._error = error

    def write(self, _):
        raise self._error


@pytest.mark.parametrize("stream", [None, Gone(BrokenPipeError()), Gone(OSError(EIO, "hung up")), Gone(ValueError())])
def test_nobody_has_to_be_there_to_read_it(monkeypatch, stream):
    monkeypatch.setattr(sys, "stderr", stream)
    say("a word")
