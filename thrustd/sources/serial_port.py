"""The serial ADC as a source: bytes as they come, stamped on arrival; unplugged and back is a fault, not an end.

Reads are as small as what is there, so that a byte waits for nobody (a fixed read size would wait for its timeout).
`port` is a device path or any pyserial URL (`socket://`, `rfc2217://`, `loop://`, `spy://` ...).
"""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import serial

from thrustd.errors import ConfigError
from thrustd.sources.merge import Put
from thrustd.sources.worker import Worker, keep_open
from thrustd.types import Fault, Frame

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

    def _tell(self, kind: str) -> None:
        self._put(Fault(self._clock_ns(), CHANNEL, kind))

    def _open(self) -> Any | None:
        timeout_s = URL_TIMEOUT_S if self._is_url else TIMEOUT_S
        try:
            port = serial.serial_for_url(self._name, baudrate=self._baud, timeout=timeout_s)
        except (OSError, ValueError):  # SerialException is an OSError
            return None
        with suppress(OSError, ValueError, NotImplementedError, AttributeError):  # a pty or a URL has no such mode
            port.set_low_latency_mode(True)  # FTDI adapters hold bytes for 16 ms otherwise
        return port

    def _receive(self, port: Any) -> None:
        """Put what arrives until the port fails or the thread is stopped."""
        stopping, put, clock_ns = self._worker.stopping, self._put, self._clock_ns
        with suppress(OSError, TypeError):  # unplugging raises either, also from `in_waiting`
            while not stopping.is_set():
                wanted = URL_READ_BYTES if self._is_url else min(port.in_waiting or 1, MAX_READ_BYTES)
                data = port.read(wanted)
                if data:
                    put(Frame(clock_ns(), CHANNEL, 0, data))
        with suppress(OSError):  # it may be gone already
            port.close()
