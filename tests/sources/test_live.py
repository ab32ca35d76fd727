"""Live sources: a pty, a virtual bus, a bounded queue. Waiting is on queues with generous limits, never timed."""

import errno
import os
import pty
import socket
import termios
import tty
import uuid
from collections.abc import Callable, Iterator
from itertools import chain, count
from pathlib import Path
from threading import Event as Flag
from time import monotonic
from typing import Any

import can
import pytest
import serial
from can.interfaces.socketcan import SocketcanBus

from tests.wire.one_by_one import AdcSample, adc_items
from thrustd.core.errors import ConfigError
from thrustd.core.types import Event, Fault, Frame, Tick
from thrustd.sources.can_bus import CAN_FRAME, CanBus
from thrustd.sources.merge import TAKE_EVENTS, EventQueue, merged
from thrustd.sources.paced import at_baud, paced
from thrustd.sources.serial_port import SerialPort
from thrustd.sources.ticker import Ticker
from thrustd.wire.adc_frames import AdcDecoder, encode
from thrustd.wire.can_table import EXTENDED_BIT

LIMIT_S = 20.0


def take_until(queue: EventQueue, done: Callable[[list[Event]], bool]) -> list[Event]:
    """Events until `done`; an empty queue for LIMIT_S ends it."""
    found: list[Event] = []
    while not done(found):
        events = queue.take(LIMIT_S)
        if not events:
            break
        found += events
    return found


def faults(events: list[Event]) -> list[str]:
    return [event.kind + " over" * (not event.active) for event in events if isinstance(event, Fault)]


def greet(terminal: "Terminal", queue: EventQueue) -> list[Event]:
    """Delimiters until one arrives: pyserial throws away what was written before it opened the port."""
    for _ in range(1000):
        os.write(terminal.ours, b"\0")
        events = queue.take(0.05)
        if any(isinstance(event, Frame) for event in events):
            return events
    pytest.fail("the port did not open")


class Terminal:
    """A pseudo terminal behind a stable name, like a serial adapter behind its udev link."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    def plug(self) -> None:
        self.ours, theirs = pty.openpty()
        tty.setraw(theirs)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(theirs))
        self._theirs = theirs

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self.ours)
        os.close(self._theirs)


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    made = Terminal(tmp_path / "ttyADC")
    yield made
    made.unplug()


def test_serial_bytes_arrive_whole_and_in_order(terminal: Terminal) -> None:
    queue = EventQueue()
    port = SerialPort(str(terminal.link), 921_600, queue.put)
    port.start()
    greet(terminal, queue)
    sent = b"".join(encode(n, n * 1000, (n, -n)) for n in range(300))  # a pty holds about 20 kB
    os.write(terminal.ours, sent)
    events = take_until(queue, lambda found: sent[-20:] in b"".join(e.data for e in found if isinstance(e, Frame)))
    port.stop()
    assert b"".join(event.data for event in events if isinstance(event, Frame)).lstrip(b"\0") == sent
    decoder = AdcDecoder(2, 1000)
    items = [item for e in events if isinstance(e, Frame) for item in adc_items(decoder, e.t_ns, e.data)]
    assert [item.counts for item in items if isinstance(item, AdcSample)] == [(n, -n) for n in range(300)]
    times = [event.t_ns for event in events]
    assert times == sorted(times)


def test_a_serial_port_may_go_and_come_back(terminal: Terminal) -> None:
    queue = EventQueue()
    port = SerialPort(str(terminal.link), 921_600, queue.put)
    port.start()
    first = greet(terminal, queue)
    terminal.unplug()
    gone = take_until(queue, lambda found: "unplugged" in faults(found))
    terminal.plug()
    back = take_until(queue, lambda found: "unplugged over" in faults(found))
    greet(terminal, queue)
    os.write(terminal.ours, b"after")
    last = take_until(queue, lambda found: any(b"a" in event.data for event in found if isinstance(event, Frame)))
    port.stop()
    assert faults([*first, *gone, *back, *last]) == ["unplugged", "unplugged over"]
    assert b"".join(event.data for event in last if isinstance(event, Frame)).strip(b"\0")[:1] == b"a"


def test_a_serial_port_is_not_shared(terminal: Terminal) -> None:
    first, second = EventQueue(), EventQueue()
    owner = SerialPort(str(terminal.link), 921_600, first.put)
    owner.start()
    greet(terminal, first)
    guest = SerialPort(str(terminal.link), 921_600, second.put)
    guest.start()
    assert faults(second.take(LIMIT_S)) == ["unplugged"]
    owner.stop()
    assert "unplugged over" in faults(take_until(second, lambda found: "unplugged over" in faults(found)))
    guest.stop()


def test_a_serial_port_that_was_never_there_is_said_once(tmp_path: Path) -> None:
    queue = EventQueue()
    port = SerialPort(str(tmp_path / "nothing"), 921_600, queue.put)
    port.start()
    assert faults(queue.take(LIMIT_S)) == ["unplugged"]
    port.stop()
    assert queue.take(0.01) == []


def test_a_port_that_goes_while_it_is_opened_is_tried_again(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts = [termios.error(errno.EIO, "Input/output error")]
    really_open = serial.serial_for_url

    def open_port(name: str, **more: Any) -> Any:
        if not more.get("do_not_open") and attempts:
            raise attempts.pop()  # pyserial lets it through from tcgetattr; it is no OSError
        return really_open(name, **more)

    monkeypatch.setattr(serial, "serial_for_url", open_port)
    queue = EventQueue()
    port = SerialPort(str(terminal.link), 921_600, queue.put)
    port.start()
    events = take_until(queue, lambda found: "unplugged over" in faults(found))
    port.stop()
    assert faults(events) == ["unplugged", "unplugged over"]


def test_a_pyserial_url_works_and_a_wrong_one_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"adc\.port = 'nonsense://x'"):
        SerialPort("nonsense://x", 9600, EventQueue().put)
    port = SerialPort("loop://", 9600, EventQueue().put)
    port.start()
    port.stop()


def test_can_messages_arrive_in_order_with_their_identifiers() -> None:
    queue, channel = EventQueue(), uuid.uuid4().hex
    with can.Bus(interface="virtual", channel=channel) as sender:
        source = CanBus("virtual", channel, 1_000_000, queue.put)
        source.start()
        await_open(source)
        for n in range(100):
            sender.send(can.Message(arbitration_id=300, data=[n], is_extended_id=False))
        sender.send(can.Message(arbitration_id=300, is_remote_frame=True, is_extended_id=False))
        sender.send(can.Message(arbitration_id=0x1ABCDEF, data=b"", is_extended_id=True))
        events = take_until(queue, lambda found: len(found) >= 101)
        source.stop()
    frames = [event for event in events if isinstance(event, Frame)]
    assert [frame.data for frame in frames[:100]] == [bytes([n]) for n in range(100)]
    assert {frame.ident for frame in frames[:100]} == {300}
    assert frames[100][1:] == ("can", 0x1ABCDEF | EXTENDED_BIT, b"")


def await_open(source: CanBus) -> None:
    """Sending works from the moment the bus is open."""
    end_s = monotonic() + LIMIT_S
    while monotonic() < end_s:
        try:
            source.send(1, b"")
        except OSError:
            os.sched_yield()
        else:
            return
    pytest.fail("the bus did not open")


def test_what_we_send_reaches_the_bus() -> None:
    channel = uuid.uuid4().hex
    with can.Bus(interface="virtual", channel=channel) as listener:
        source = CanBus("virtual", channel, 1_000_000, EventQueue().put)
        with pytest.raises(OSError, match="not open"):
            source.send(1850, b"\1")
        source.start()
        await_open(source)
        source.send(1850, b"\1\2")
        received = [listener.recv(LIMIT_S), listener.recv(LIMIT_S)]
        source.stop()
    assert received[1] is not None
    assert (received[1].arbitration_id, bytes(received[1].data)) == (1850, b"\1\2")


@pytest.mark.parametrize("error", [can.CanOperationError("full"), OSError(errno.EBADF, "gone"), TypeError("closed")])
def test_whatever_a_driver_raises_on_sending_is_an_oserror(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise error

    source = CanBus("virtual", uuid.uuid4().hex, 1_000_000, EventQueue().put)
    source.start()
    await_open(source)
    monkeypatch.setattr("can.interfaces.virtual.VirtualBus.send", refuse)
    with pytest.raises(OSError):
        source.send(1850, b"\1")
    monkeypatch.undo()
    source.stop()


class BrokenBus:
    """A driver on its worst day: every `recv` raises, then error frames, then silence."""

    def __init__(self, script: list[object]) -> None:
        self.script = script
        self.shut = False

    def recv(self, timeout: float) -> can.Message | None:
        step = self.script.pop(0) if self.script else None
        if isinstance(step, Exception):
            raise step
        return step if isinstance(step, can.Message) else None

    def shutdown(self) -> None:
        self.shut = True


def test_a_failing_driver_is_counted_reopened_and_never_fatal(monkeypatch: pytest.MonkeyPatch) -> None:
    good = can.Message(arbitration_id=5, data=b"x", is_extended_id=False)
    dead = BrokenBus([KeyError("what"), *[OSError(errno.EIO, "again")] * 10])
    alive = BrokenBus([can.Message(is_error_frame=True), good])
    attempts: list[object] = [dead, can.CanInitializationError("not yet"), alive]

    def fake_bus(**_: object) -> object:
        step = attempts.pop(0)
        if isinstance(step, Exception):
            raise step
        return step

    monkeypatch.setattr(can, "Bus", fake_bus)
    queue = EventQueue()
    source = CanBus("virtual", "x", 1, queue.put, clock_ns=count(10**9, 10**9).__next__)
    source.start()
    events = take_until(queue, lambda found: any(isinstance(event, Frame) for event in found))
    source.stop()
    kinds = faults(events)
    assert kinds[-2:] == ["unplugged over", "bus_error"]
    assert kinds.count("unplugged") == 1
    assert sum(e.count for e in events if isinstance(e, Fault) and e.kind == "bus_error") == 11
    assert dead.shut


class SocketPairCan(SocketcanBus):
    """SocketCAN on a pair of sockets: what is written to `far` arrives as frames of the bus."""

    def __init__(self) -> None:
        self.socket, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)

    def shutdown(self) -> None:
        self.socket.close()
        self.far.close()

    def __del__(self) -> None:
        """Nothing to say: the bus behind it was never opened."""


def test_socketcan_frames_are_read_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = SocketPairCan()
    frames = [
        (300, b"12345678"),
        (EXTENDED_BIT | 0x1ABCDEF, b""),
        (1 << 30 | 300, b""),
        (1 << 29 | 4, b"x"),
        (5, b"ab"),
    ]
    for ident, data in frames:
        bus.far.send(CAN_FRAME.pack(ident, len(data), data))
    bus.far.send(b"a torn frame")
    bus.far.send(CAN_FRAME.pack(6, 0, b""))
    monkeypatch.setattr(can, "Bus", lambda **_: bus)
    queue = EventQueue()
    source = CanBus("socketcan", "can0", 1_000_000, queue.put)
    source.start()
    events = take_until(queue, lambda found: any(isinstance(event, Frame) and event.ident == 6 for event in found))
    source.stop()
    heard = [(event.ident, event.data) for event in events if isinstance(event, Frame)]
    assert heard == [(300, b"12345678"), (EXTENDED_BIT | 0x1ABCDEF, b""), (5, b"ab"), (6, b"")]
    assert "bus_error" in faults(events)


class VanishingSocket:
    """What SocketCAN does when its interface goes: it says so once, and never again."""

    def __init__(self, port: socket.socket, error: int) -> None:
        self._port, self._errors = port, [error]
        self.close = port.close

    def fileno(self) -> int:
        return self._port.fileno()

    def getsockopt(self, *_: int) -> int:
        return 0

    def recv(self, *_: int) -> bytes:
        if self._errors:
            raise OSError(self._errors.pop(), "said once")
        raise BlockingIOError


@pytest.mark.parametrize("error", [errno.ENETDOWN, errno.ENODEV])
def test_an_interface_that_vanished_is_opened_again(monkeypatch: pytest.MonkeyPatch, error: int) -> None:
    gone, away, back = SocketPairCan(), SocketPairCan(), SocketPairCan()
    for bus in (gone, back):
        bus.far.send(CAN_FRAME.pack(7, 2, b"ab"))
    gone.socket = VanishingSocket(gone.socket, error)  # type: ignore[assignment]
    down = VanishingSocket(away.socket, 0)
    down.getsockopt = lambda *_: errno.ENETDOWN  # type: ignore[method-assign]
    away.socket = down  # type: ignore[assignment]
    buses = [gone, away, back]
    monkeypatch.setattr(can, "Bus", lambda **_: buses.pop(0))
    queue = EventQueue()
    source = CanBus("socketcan", "can0", 1_000_000, queue.put)
    source.start()
    events = take_until(queue, lambda found: any(isinstance(event, Frame) for event in found))
    source.stop()
    assert faults(events) == ["bus_error", "unplugged", "unplugged over"]


def test_what_is_left_in_the_queue_wakes_nobody_but_comes_with_the_next_event_in_order() -> None:
    queue = EventQueue()
    frames: list[Event] = [Frame(n, "can", 1, b"") for n in range(TAKE_EVENTS + 5)]
    for frame in frames:
        queue.leave(frame)
    queue.put(Tick(9))
    assert [*queue.take(LIMIT_S), *queue.take(LIMIT_S)] == [*frames, Tick(9)]
    queue.leave(frames[0])
    assert queue.take(0.001) == [frames[0]]  # nobody rang, the time was over


def test_before_anything_is_due_only_ticks_and_faults_wake_the_reader() -> None:
    queue, early, due = EventQueue(), Frame(5, "adc", 0, b"x"), Frame(10, "adc", 0, b"y")
    queue.quiet_until_ns = 10
    for waking in (due, Tick(6), Fault(6, "adc", "unplugged")):
        queue.put(early)
        assert queue.take(0.001) == [early]  # nobody rang, the time was over
        queue.put(early)
        queue.put(waking)
        assert queue.take(LIMIT_S) == [early, waking]


def test_an_unknown_can_interface_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"can\.interface = 'tin-can': expected one of .*socketcan"):
        CanBus("tin-can", "0", 1, EventQueue().put)


def test_the_queue_sheds_the_oldest_but_never_a_fault() -> None:
    queue, stopped = EventQueue(max_events=10), Flag()
    queue.put(Fault(0, "adc", "unplugged"))
    for n in range(1, 101):
        queue.put(Frame(n, "adc", 0, b"x"))
    stream = chain.from_iterable(merged(queue, [], stopped))
    events = [next(stream)]
    stopped.set()
    events += stream
    overrun, rest = events[0], events[1:]
    assert isinstance(overrun, Fault)
    assert overrun.kind == "overrun"
    assert overrun.count + sum(isinstance(event, Frame) for event in rest) == 100
    assert [event for event in rest if isinstance(event, Fault)] == [Fault(0, "adc", "unplugged")]
    assert [event.t_ns for event in rest if isinstance(event, Frame)] == list(range(92, 101))


def test_merged_starts_and_stops_its_receivers() -> None:
    queue, stopped = EventQueue(), Flag()
    stream = chain.from_iterable(merged(queue, [Ticker(100, queue.put)], stopped))
    ticks = [next(stream) for _ in range(3)]
    assert all(isinstance(tick, Tick) for tick in ticks)
    stopped.set()
    list(stream)
    queue.take(0.01)
    assert queue.take(0.05) == []


def test_pacing_waits_for_the_time_of_each_event_and_keeps_the_order() -> None:
    now_s, waits = [100.0], list[float]()

    def sleep(seconds: float) -> None:
        waits.append(round(seconds, 6))
        now_s[0] += seconds

    flight: list[Event] = [Tick(0), Tick(10**9), Tick(5 * 10**8), Tick(3 * 10**9)]
    assert list(paced(flight, 2.0, lambda: now_s[0], sleep)) == flight
    assert waits == [0.5, 1.0]


def test_who_was_held_up_catches_up_no_faster_than_the_wire():
    waits, now_s = [], [100.0]

    def sleep(seconds: float) -> None:
        waits.append(seconds)
        now_s[0] += seconds

    chunk, message = Frame(0, "adc", 0, bytes(100)), Frame(0, "can", 300, bytes(8))
    burst: list[Event] = [chunk, message, chunk, Tick(0), chunk]
    assert list(at_baud(burst, 1000.0, lambda: now_s[0], sleep)) == burst
    assert waits == [1.0, 1.0]  # ten bits per byte
    now_s[0] += 5.0
    assert list(at_baud([chunk], 1000.0, lambda: now_s[0], sleep)) == [chunk]
    assert len(waits) == 2
