"""A CAN bus as a source: messages stamped with monotonic time on arrival, gathered in our own loop.

python-can opens the bus; a SocketCAN socket is then read directly, every other interface by python-can's `recv`.

python-can's Notifier is not used: an exception in `recv` ends its thread silently (hardbyte/python-can#1667), and its
timestamps follow the wall clock. `interface` is any of python-can's (socketcan onboard).
"""

import errno
import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from select import select
from struct import Struct

import can
from can.interfaces.socketcan import SocketcanBus

from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Frame
from thrustd.sources.merge import Put
from thrustd.sources.worker import Worker, keep_open
from thrustd.wire.can_table import EXTENDED_BIT

CHANNEL = "can"
TIMEOUT_S = 0.1
# between two looks: messages hold until the next sample anyway, and every wake-up costs. In a pull-up of 0.5 g/s the
# longitudinal acceleration is up to 1 mg old by this: 4 N
GATHER_S = 0.002
GATHER_MESSAGES = 256  # at once; SocketCAN keeps about 320
ERROR, REMOTE = 1 << 29, 1 << 30  # flags beside EXTENDED_BIT (linux/can.h)
CAN_FRAME = Struct("=IB3x8s")
ERRORS_IN_A_ROW = 10  # failing receives before the bus is opened again
# SocketCAN says once that its interface went down or away; the socket is silent for good then
GONE = frozenset({errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.EBADF})
TELL_NS = 100_000_000  # error frames are told in bunches, at most so often


class CanBus:
    """A thread that puts `Frame(t_ns, "can", identifier, data)`; also sends, for whoever has something to say."""

    def __init__(
        self,
        interface: str,
        channel: str,
        bitrate: int,
        put: Put,
        clock_ns: Callable[[], int] = time.monotonic_ns,
        where: str = "can",
    ) -> None:
        """ConfigError, from `where`, when python-can knows no such interface; nothing is opened yet."""
        if interface not in can.VALID_INTERFACES:
            names = ", ".join(sorted(can.VALID_INTERFACES))
            raise ConfigError(f"{where}.interface = {interface!r}: expected one of {names}")
        self._interface, self._channel, self._bitrate = interface, channel, bitrate
        self._put = put
        self._clock_ns = clock_ns
        self._worker = Worker("can", self._run)
        self._bus: can.BusABC | None = None
        self._errors = 0  # not told yet
        self._told_ns = 0

    def start(self) -> None:
        self._worker.start()

    def stop(self) -> None:
        self._worker.stop()

    def send(self, ident: int, data: bytes) -> None:
        """Send one message without waiting; OSError when the bus is away or does not take it."""
        bus = self._bus
        if bus is None:
            raise OSError("the bus is not open")
        extended = bool(ident & EXTENDED_BIT)
        message = can.Message(arbitration_id=ident & ~EXTENDED_BIT, data=data, is_extended_id=extended)
        try:
            bus.send(message, timeout=0)
        except Exception as error:  # drivers raise what they like, and this is the loop's own thread
            raise OSError(str(error)) from None

    def _run(self) -> None:
        keep_open(self._worker.stopping, self._open, self._receive, self._tell)

    def _tell(self, kind: str, active: bool = True, count: int = 1) -> None:
        self._put(Fault(self._clock_ns(), CHANNEL, kind, active, count))

    def _open(self) -> can.BusABC:
        bus = can.Bus(interface=self._interface, channel=self._channel, bitrate=self._bitrate)
        if isinstance(bus, SocketcanBus) and (error := _pending_error(bus.socket)):
            bus.shutdown()  # an interface that is down can be bound, and says so once
            raise OSError(error, os.strerror(error))
        return bus

    def _receive(self, bus: can.BusABC) -> None:
        """Put what arrives until the bus fails for good or the thread is stopped; then close it."""
        self._bus = bus
        try:
            self._listen(bus)
        finally:
            self._bus = None
            bus.shutdown()

    def _listen(self, bus: can.BusABC) -> None:
        stopping, failed = self._worker.stopping, 0
        gather = partial(_frames_of, bus.socket) if isinstance(bus, SocketcanBus) else partial(_messages_of, bus)
        while failed < ERRORS_IN_A_ROW and not stopping.is_set():
            heard: list[tuple[int, bytes]] = []
            try:
                gather(heard)
                failed = 0
            except Exception as problem:  # a damaged datagram must not end the reception, a dead bus fails again
                failed += 1
                self._note_error()
                if isinstance(problem, OSError) and problem.errno in GONE:
                    return
            self._hand_over(heard)
            if heard:
                time.sleep(GATHER_S)

    def _hand_over(self, heard: list[tuple[int, bytes]]) -> None:
        put, now_ns = self._put, self._clock_ns()
        for ident, data in heard:
            if ident & (ERROR | REMOTE):
                if ident & ERROR:
                    self._note_error()
            else:
                put(Frame(now_ns, CHANNEL, ident, data))

    def _note_error(self) -> None:
        self._errors += 1
        now_ns = self._clock_ns()
        if now_ns - self._told_ns >= TELL_NS:
            self._tell("bus_error", count=self._errors)
            self._told_ns, self._errors = now_ns, 0


def _pending_error(port: socket.socket) -> int:
    return port.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)


def _messages_of(bus: can.BusABC, heard: list[tuple[int, bytes]]) -> None:
    """Add what has arrived, identifier with flags and data; waits for the first message."""
    message = bus.recv(TIMEOUT_S)
    while message is not None:
        flags = (
            EXTENDED_BIT * message.is_extended_id | ERROR * message.is_error_frame | REMOTE * message.is_remote_frame
        )
        heard.append((message.arbitration_id | flags, bytes(message.data)))
        message = bus.recv(0) if len(heard) < GATHER_MESSAGES else None


def _frames_of(port: socket.socket, heard: list[tuple[int, bytes]]) -> None:
    """The same straight from SocketCAN: a sixth of the time, and one `struct can_frame` is all there is to it."""
    if select([port], [], [], TIMEOUT_S)[0]:
        with suppress(BlockingIOError):
            while len(heard) < GATHER_MESSAGES:
                ident, n_bytes, data = CAN_FRAME.unpack(port.recv(CAN_FRAME.size, socket.MSG_DONTWAIT))
                heard.append((ident, data[:n_bytes]))
