"""Hardware in the loop: events on a real pseudo-terminal and a real CAN bus, so that an unchanged daemon flies.

The frames are those of a log or of the twin. A full pty or a failing bus loses the frame, as the wire would; the loss
is counted.
"""

import os
import time
import tty
from collections.abc import Iterable
from pathlib import Path
from select import POLLHUP, POLLOUT, poll

import can
import msgspec

from thrustd.core.errors import UsageError
from thrustd.core.types import Event, Fault, Frame

PATIENCE_S = 60.0
LOOK_S = 0.02
SETTLE_S = 0.2  # pyserial throws away what came while it was opening


class HilReport(msgspec.Struct):
    """What was put on the wires."""

    serial_chunks: int = 0
    serial_lost: int = 0
    can_messages: int = 0
    can_lost: int = 0
    sent_s: float = 0.0  # flight time played


class Bench:
    """The two wires. `port`: where the daemon finds the ADC, a symbolic link to the pty."""

    def __init__(self, port: Path, interface: str, channel: str, wait_s: float = 0.0) -> None:
        """`wait_s`: how long a full pty is waited for; faster than life a late reader is no fault of the wire."""
        if port.exists() and not port.is_symlink():
            raise UsageError(f"{port}: exists and is not a link; expected a free name for the ADC's port")
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self._slave, self._port, self._wait_s = slave, port, wait_s
        try:
            port.unlink(missing_ok=True)
            port.symlink_to(os.ttyname(slave))
            self._bus = can.Bus(interface=interface, channel=channel)
        except (OSError, can.CanError, ValueError) as problem:
            self._close_pty()
            raise UsageError(f"cannot set up {port} and CAN {interface} {channel}: {problem}") from None
        self.report = HilReport()

    def wait_for_reader(self, patience_s: float = PATIENCE_S) -> None:
        """Return when somebody reads the port: what is written before goes nowhere. UsageError when nobody comes."""
        name = os.ttyname(self._slave)
        os.close(self._slave)  # as long as nobody has that side open, ours says "hung up"
        watch, ends_s, alone = poll(), time.monotonic() + patience_s, True
        watch.register(self._master, 0)
        while alone and time.monotonic() < ends_s:
            alone = any(state & POLLHUP for _, state in watch.poll(0))
            time.sleep(LOOK_S if alone else SETTLE_S)
        self._slave = os.open(name, os.O_RDWR | os.O_NOCTTY)
        if alone:
            raise UsageError(f"{self._port}: nobody opened it in {patience_s:g} s, expected `thrustd run`")

    def play(self, events: Iterable[Event | Fault]) -> HilReport:
        """Put every frame on its wire, as fast as `events` hands them out."""
        first_ns = -1
        for event in events:
            first_ns = event.t_ns if first_ns < 0 else first_ns
            self.report.sent_s = (event.t_ns - first_ns) * 1e-9
            if isinstance(event, Frame):
                (self._can if event.channel == "can" else self._serial)(event)
        return self.report

    def close(self) -> None:
        self._bus.shutdown()
        self._close_pty()

    def _close_pty(self) -> None:
        os.close(self._master)
        os.close(self._slave)
        self._port.unlink(missing_ok=True)

    def _serial(self, frame: Frame) -> None:
        self.report.serial_chunks += 1
        written = self._write(frame.data)
        if self._wait_s and written < len(frame.data):
            room = poll()
            room.register(self._master, POLLOUT)
            while written < len(frame.data) and room.poll(self._wait_s * 1000):
                written += self._write(frame.data[written:])
        self.report.serial_lost += written < len(frame.data)

    def _write(self, data: bytes) -> int:
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def _can(self, frame: Frame) -> None:
        self.report.can_messages += 1
        try:
            self._bus.send(can.Message(arbitration_id=frame.ident, data=frame.data, is_extended_id=False))
        except (can.CanError, OSError):
            self.report.can_lost += 1
