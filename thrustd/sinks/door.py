"""The door of a page: one thread for all clients, none of whom can hold up another; strangers stay outside.

Host is checked against DNS rebinding (somebody's name that points at this machine), Origin against pages of other
sites: a browser tells both, and no script in it can change them.
"""

import asyncio
import socket
from collections.abc import Awaitable, Callable, Collection
from contextlib import suppress
from ipaddress import ip_address
from threading import Event as Flag
from threading import Thread
from typing import NamedTuple

import h11

HEAD_BYTES = 8192
ASK_S = 5.0  # a client that does not finish its question is left
MOST_ASKING = 64  # at once; the one that has been asking longest goes first
BACKLOG = 512
JOIN_S = 5.0


class Question(NamedTuple):
    """What was asked, and the bytes in which it was."""

    method: str
    path: str
    raw: bytes


Answer = Callable[[Question, asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class Door:
    """OSError when the address cannot be bound. Port 0 = any free one, see `port`."""

    def __init__(
        self, name: str, host: str, port: int, answer: Answer, origins: Collection[str] = (),
        refused: Callable[[str], None] = lambda word: None,
    ) -> None:  # fmt: skip
        """`answer` is given a question from nearby; `origins`: pages that may ask; `refused` is told who may not."""
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.create_server((host, port), family=family, backlog=BACKLOG)
        self.port: int = self._socket.getsockname()[1]
        self._host, self._answer, self._origins, self._refused = host, answer, frozenset(origins), refused
        self._asking: dict[asyncio.Task[None], None] = {}  # in the order of their coming
        self._inside: set[asyncio.Task[None]] = set()  # asking or being answered
        self._open = Flag()
        self._thread = Thread(target=lambda: asyncio.run(self._serve()), name=name, daemon=True)
        self._thread.start()
        self._open.wait()

    def close(self) -> None:
        """Send everybody away."""
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(JOIN_S)

    async def _serve(self) -> None:
        self._loop, self._ending = asyncio.get_running_loop(), asyncio.Event()
        self._loop.set_exception_handler(lambda *_: None)  # a client that went away is not worth a traceback
        server = await asyncio.start_server(self._meet, sock=self._socket, limit=HEAD_BYTES, backlog=BACKLOG)
        self._open.set()
        await self._ending.wait()
        self._loop.remove_reader(self._socket)  # nobody else is let in; asyncio forgets whom it has not met by a close
        for task in self._inside:
            task.cancel()
        while others := asyncio.all_tasks() - {asyncio.current_task()}:
            await asyncio.wait(others)
        server.close()
        await asyncio.sleep(0)  # until the last one's socket is closed

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if (me := asyncio.current_task()) is None or self._ending.is_set():
            return writer.transport.abort()
        self._inside.add(me)
        self._asking[me] = None
        if len(self._asking) > MOST_ASKING:
            oldest = next(iter(self._asking))
            del self._asking[oldest]
            oldest.cancel()
        try:
            async with asyncio.timeout(ASK_S):
                question, refusal = self._judge(await reader.readuntil(b"\r\n\r\n"))
            self._asking.pop(me, None)
            if refusal:
                self._refused(refusal)
                await respond(writer, 403, refusal.encode() + b"\n")
            else:
                await self._answer(question, reader, writer)
        except (OSError, TimeoutError, asyncio.LimitOverrunError, asyncio.IncompleteReadError, h11.ProtocolError):
            pass  # it went away, asks too slowly, too much, or no HTTP
        finally:
            self._asking.pop(me, None)
            self._inside.discard(me)
            writer.transport.abort() if self._ending.is_set() else writer.close()

    def _judge(self, raw: bytes) -> tuple[Question, str]:
        """The question, and why it is not answered."""
        connection = h11.Connection(h11.SERVER)
        connection.receive_data(raw)
        request = connection.next_event()
        if not isinstance(request, h11.Request):
            raise h11.RemoteProtocolError("no request")
        headers = {name: value.decode("latin-1") for name, value in request.headers}
        question = Question(request.method.decode(), request.target.decode("latin-1"), raw)
        host, origin = headers.get(b"host", ""), headers.get(b"origin")
        if not self._is_ours(host):
            return question, f"Host is {host!r}, expected this machine's address"
        if origin is not None and origin not in self._origins and origin != f"http://{host}":
            return question, f"a page of {origin!r} asked, expected {' or '.join(sorted(self._origins)) or 'no page'}"
        return question, ""

    def _is_ours(self, host: str) -> bool:
        """An address, which nobody else can point here, or a name of our own."""
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdecimal() else host
        if name.lower() in ("localhost", self._host):
            return True
        with suppress(ValueError):
            return bool(ip_address(name.strip("[]")))
        return False


async def respond(writer: asyncio.StreamWriter, status: int, body: bytes) -> None:
    """One whole answer; a client that does not take it in time is left."""
    connection = h11.Connection(h11.SERVER)
    headers = [
        ("Content-Type", "text/plain; version=0.0.4; charset=utf-8"),
        ("Content-Length", str(len(body))),
        ("Connection", "close"),
    ]
    writer.write(connection.send(h11.Response(status_code=status, headers=headers)) or b"")
    writer.write(body)
    async with asyncio.timeout(ASK_S):
        await writer.drain()
