"""The door of a page: a burst of clients waits for it, nobody is turned away."""

import socket
from contextlib import ExitStack, suppress
from threading import Event as Flag

from thrustd.sinks.door import Door

BURST = 150  # more than the hundred that asyncio lets wait by itself


async def _nothing(*_: object) -> None:
    pass


def test_a_burst_of_clients_is_connected_while_the_door_is_busy():
    door, ends = Door("test", "127.0.0.1", 0, _nothing), Flag()
    try:
        door._loop.call_soon_threadsafe(ends.wait)
        with ExitStack() as waiting:  # one that finds no room hangs until the system asks again
            where = "127.0.0.1", door.port
            clients = [waiting.enter_context(socket.create_connection(where, timeout=60.0)) for _ in range(BURST)]
            ends.set()
            for client in clients:
                with suppress(ConnectionError):  # the one that has asked longest may be left for another
                    client.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    assert client.recv(1) == b""
    finally:
        ends.set()
        door.close()
