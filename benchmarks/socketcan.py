"""python-can's SocketCAN receiver where the kernel has no vcan: `python -m benchmarks.socketcan VERB ...` = `thrustd`.

`SocketcanBus` is python-can's own, select, recvmsg, kernel time stamp and all; only its socket is replaced: datagrams
on loopback that hold a `struct can_frame` each. The first who opens a channel (a port number) listens, whoever comes
later talks to him.
"""

import socket
import sys
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus, constants

from thrustd.__main__ import main

HOST = "127.0.0.1"
ROOM_BYTES = 4_000_000


class DatagramSocketcan(SocketcanBus):
    """One member."""

    def __init__(self, channel: str, **_: Any) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM_BYTES)
        self.socket.setsockopt(socket.SOL_SOCKET, constants.SO_TIMESTAMPNS, 1)
        place = (HOST, int(channel))
        try:
            self.socket.bind(place)
        except OSError:  # somebody listens there
            self.socket.connect(place)
        self.channel, self.channel_info = channel, f"datagrams {HOST}:{channel}"
        self._bcm_sockets: dict[str, socket.socket] = {}
        self._is_filtered = False
        can.BusABC.__init__(self, channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """The listener's own estimates have nobody to go to."""
        try:
            self.socket.getpeername()
        except OSError:
            return
        super().send(msg, timeout)


if __name__ == "__main__":
    can.interfaces.BACKENDS["socketcan"] = (__name__, DatagramSocketcan.__name__)
    sys.exit(main())
