"""A CAN bus as a source: messages stamped with monotonic time on arrival, by python-can's `recv` in our own loop.

python-can's Notifier is not used: an exception in `recv` ends its thread silently (hardbyte/python-can#1667), and its
timestamps follow the wall clock. `interface` is any of python-can's (socketcan onboard, `virtual` and
`udp_multicast` in tests).
"""

import time
from collections.abc import Callable
from contextlib import suppress

import can

from thrustd.errors import ConfigError
from thrustd.sources.merge import Put
from thrustd.sources.worker import Worker, keep_open
from thrustd.types import Fault, Frame
from thrustd.wire.can_table import EXTENDED_BIT

CHANNEL = "can"
TIMEOUT_S = 0.1
ERRORS_IN_A_ROW = 10  # failing receives before the bus is opened again
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
    ) -> None:
        if interface not in can.VALID_INTERFACES:
            names = ", ".join(sorted(can.VALID_INTERFACES))
            raise ConfigError(f"can.interface = {interface!r}, expected one of {names}")
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
        except can.CanError as error:
            raise OSError(str(error)) from None

    def _run(self) -> None:
        keep_open(self._worker.stopping, self._open, self._receive, self._tell)

    def _tell(self, kind: str, count: int = 1) -> None:
        self._put(Fault(self._clock_ns(), CHANNEL, kind, count))

    def _open(self) -> can.BusABC | None:
        try:
            return can.Bus(interface=self._interface, channel=self._channel, bitrate=self._bitrate)
        except Exception:  # drivers raise what they like; whatever it is, the bus is not there
            return None

    def _receive(self, bus: can.BusABC) -> None:
        """Put what arrives until the bus fails for good or the thread is stopped; then close it."""
        self._bus = bus
        self._listen(bus)
        self._bus = None
        with suppress(Exception):  # it may be gone already
            bus.shutdown()

    def _listen(self, bus: can.BusABC) -> None:
        stopping, put, clock_ns, failed = self._worker.stopping, self._put, self._clock_ns, 0
        while failed < ERRORS_IN_A_ROW and not stopping.is_set():
            try:
                message = bus.recv(TIMEOUT_S)
            except Exception:  # a damaged datagram must not end the reception, a dead bus fails again at once
                failed += 1
                self._note_error()
                continue
            failed = 0
            if message is None:
                continue
            if message.is_error_frame:
                self._note_error()
            elif not message.is_remote_frame:
                ident = message.arbitration_id | (EXTENDED_BIT if message.is_extended_id else 0)
                put(Frame(clock_ns(), CHANNEL, ident, bytes(message.data)))

    def _note_error(self) -> None:
        self._errors += 1
        now_ns = self._clock_ns()
        if now_ns - self._told_ns >= TELL_NS:
            self._tell("bus_error", self._errors)
            self._told_ns, self._errors = now_ns, 0
