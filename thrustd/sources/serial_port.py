"""The serial ADC as a source: bytes as they come, stamped on arrival; unplugged and back is a fault, not an end.

pyserial opens and sets up the port; a device is then read with `select` and `os.read`, which return what is there at
once (pyserial's `read(n)` waits for n bytes or its timeout, and its `in_waiting` costs another call into the kernel).
`port` is a device path or any pyserial URL (`socket://`, `rfc2217://`, `loop://`, `spy://` ...).
"""

import os
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from select import select
from typing import Any

import serial

from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Frame
from thrustd.sources.merge import Put
from thrustd.sources.worker import Worker, keep_open

CHANNEL = "adc"
TIMEOUT_S = 0.1  # how long a silent port delays the end of the thread
URL_TIMEOUT_S = 0.002  # ports behind a URL cannot say how much waits: read what comes within this time
URL_READ_BYTES = 1024
MAX_READ_BYTES = 4096


class SerialPort:
    """A thread that puts `Frame(t_ns, "adc", 0, bytes)` while the port is there and looks for it while it is not."""

    def __init__(self, port: str, baud: int, put: Put, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        try:
            serial.serial_for_url(port, do_not_open=True)
        except ValueError as error:
            raise ConfigError(f"adc.port = {port!r}: {error}, expected a device path or a pyserial URL") from None
        self._name = port
        self._baud = baud
        self._put = put
        self._clock_ns = clock_ns
        self._worker = Worker("serial", self._run)
        self._is_url = "://" in port

    def start(self) -> None:
        self._worker.start()

    def stop(self) -> None:
        self._worker.stop()

    def _run(self) -> None:
        keep_open(self._worker.stopping, self._open, self._receive, self._tell)

    def _tell(self, kind: str, active: bool) -> None:
        self._put(Fault(self._clock_ns(), CHANNEL, kind, active))

    def _open(self) -> Any:
        only_us = None if self._is_url else True  # two readers of one device would each get half of the bytes
        port = serial.serial_for_url(self._name, baudrate=self._baud, timeout=URL_TIMEOUT_S, exclusive=only_us)
        with suppress(Exception):  # a pty or a URL has no such mode
            port.set_low_latency_mode(True)  # FTDI adapters hold bytes for 16 ms otherwise
        return port

    def _receive(self, port: Any) -> None:
        """Put what arrives until the port fails or the thread is stopped."""
        stopping, put, clock_ns = self._worker.stopping, self._put, self._clock_ns
        read = partial(port.read, URL_READ_BYTES) if self._is_url else partial(_read_device, port.fileno())
        try:
            while not stopping.is_set():
                data = read()
                if data:
                    put(Frame(clock_ns(), CHANNEL, 0, data))
        finally:
            port.close()


def _read_device(descriptor: int) -> bytes:
    """What is there, at once when something is; empty after a silent TIMEOUT_S. OSError when unplugged."""
    ready, _, _ = select([descriptor], [], [], TIMEOUT_S)
    if not ready:
        return b""
    data = os.read(descriptor, MAX_READ_BYTES)
    if not data:
        raise OSError("readable without data: the device is gone")
    return data
