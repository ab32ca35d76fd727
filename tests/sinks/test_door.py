"""The door of a page: a burst of clients waits for it, nobody is turned away."""

import gc
import socket
from contextlib import ExitStack, suppress
from threading import Event as Flag

import pytest

from thrustd.sinks import door as doors
from thrustd.sinks.door import Door

BURST = 150  # more than the hundred that asyncio lets wait by itself
ASKING = 100  # more than may ask at once


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


def _is_open(client: socket.socket) -> bool:
    client.setblocking(False)
    try:
        return client.recv(1) != b""
    except BlockingIOError:
        return True


def test_of_those_that_never_finish_asking_the_oldest_goes_for_one_more(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(doors, "ASK_S", 600.0)  # nobody goes because of the time
    door = Door("test", "127.0.0.1", 0, _nothing)
    try:
        with ExitStack() as asking:
            where = "127.0.0.1", door.port
            clients = [asking.enter_context(socket.create_connection(where, timeout=20.0)) for _ in range(ASKING)]
            assert clients[0].recv(1) == b""
            assert _is_open(clients[-1]) and _is_open(clients[ASKING // 2])
    finally:
        door.close()


def test_who_comes_while_it_closes_is_sent_away_and_nothing_stays_open():
    door, ends = Door("test", "127.0.0.1", 0, _nothing), Flag()
    door._loop.call_soon_threadsafe(ends.wait)
    with ExitStack() as coming:
        where = "127.0.0.1", door.port
        clients = [coming.enter_context(socket.create_connection(where, timeout=20.0)) for _ in range(ASKING)]
        door._loop.call_soon_threadsafe(door._ending.set)
        ends.set()
        door.close()
        for client in clients:
            with suppress(ConnectionError):
                assert client.recv(1) == b""
    gc.collect()  # an open end that is forgotten warns, and pytest says it here
