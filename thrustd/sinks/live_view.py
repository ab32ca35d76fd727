"""The live view: outputs on a WebSocket in Foxglove's protocol, bound to loopback unless told otherwise.

    client -> door: Host and Origin judged -> foxglove-sdk's server, at a loopback address nobody else knows

foxglove-sdk asks nobody where he comes from, so a page of any site could read along: hence the door. It sends from its
own threads and keeps a bounded backlog per client, oldest dropped first. A client that takes nothing of what it is sent
is left, and where all places are taken the one goes that has shown no sign of life for the longest. Topics and JSON are
those of the flight log.
"""

import logging
import socket
from asyncio import CancelledError, StreamReader, StreamWriter, Task, current_task, gather, open_connection, timeout
from collections.abc import Callable
from secrets import randbelow
from time import monotonic
from typing import Final

import foxglove
import msgspec

from thrustd.core import config
from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Output
from thrustd.sinks.door import Door, Question, respond
from thrustd.wire.log_layout import LogHeader, TopicKind, Topics, json_schema

WHERE: Final = "live_view"
logging.getLogger("foxglove").addHandler(logging.NullHandler())  # a client that goes is no news
BACKLOG_MESSAGES = 1024  # per client
MOST_CLIENTS = 32
PIECE_BYTES = 65536
TAKE_S = 10.0  # for what it was sent
SILENT_S = 2.0  # nothing said and nothing taken for so long: its place may be another's


async def _pass_on(reader: StreamReader, writer: StreamWriter, passed: Callable[[], None]) -> None:
    """Until one side goes; TimeoutError when this one takes nothing: meanwhile its backlog is the server's."""
    try:
        while piece := await reader.read(PIECE_BYTES):
            writer.write(piece)
            async with timeout(TAKE_S):
                await writer.drain()
            passed()
    except (TimeoutError, CancelledError):
        writer.transport.abort()  # what it was sent will never be gone
        raise
    finally:
        writer.close()


class LiveView:
    """A sink that shows outputs, thinned to `rate_hz` per topic; faults are all shown."""

    def __init__(
        self,
        wish: config.LiveView,
        header: LogHeader,
        report: Callable[[Fault], None],
        say: Callable[[str], None] = lambda words: None,
        rate_hz: float = 10.0,
    ) -> None:
        """ConfigError when the address cannot be bound. Port 0 = any free one, see `port`.

        `say` is told once of a page that may not read along.
        """
        self.failed_outputs = 0
        self._context = foxglove.Context()
        self._topics = Topics(header.engines, header.mounts)
        self._report = report
        self._period_ns = round(1e9 / rate_hz)
        self._offset_ns = header.epoch_offset_ns
        self._channels: dict[str, foxglove.Channel] = {}
        self._shown_ns: dict[str, int] = {}
        self._say = say
        self._alive_s: dict[Task[None], float] = {}  # by client: the last sign of life
        self._inside = ".".join(["127", *(str(1 + randbelow(254)) for _ in range(3))])
        try:
            self._server = foxglove.start_server(
                name="thrustd", host=self._inside, port=0, context=self._context, message_backlog_size=BACKLOG_MESSAGES
            )
            self._door = Door("live view", wish.host, wish.port, self._let_in, wish.origins, self._refused)
        except (OSError, RuntimeError, ValueError) as error:
            said = getattr(error, "strerror", None) or error
            raise ConfigError(f"live_view = {wish.host}:{wish.port}: cannot be bound: {said}") from None
        for place in self._topics.fixed():
            self._channel(place)

    @property
    def port(self) -> int:
        return self._door.port

    def write_output(self, output: Output) -> None:
        """Show `output` when its topic is due; never waits, never raises."""
        try:
            place = self._topics.of(output)
            if self._is_due(place.topic, output):
                log_ns = max(0, output.t_ns + self._offset_ns)
                self._channel(place).log(self._topics.encode(output), log_time=log_ns)
        except Exception:  # whatever the server does, the flight goes on
            self.failed_outputs += 1
            if self.failed_outputs == 1:
                self._report(Fault(output.t_ns, WHERE, "not_sent"))

    def close(self) -> None:
        """Disconnect everybody."""
        self._door.close()
        self._server.stop()

    def _refused(self, why: str) -> None:
        say, self._say = self._say, lambda words: None
        say(f"live_view: {why} (live_view.origins lists the pages that may)")

    async def _let_in(self, question: Question, reader: StreamReader, writer: StreamWriter) -> None:
        if (me := current_task()) is None or not self._has_room():
            return await respond(writer, 503, f"{MOST_CLIENTS} clients look on already\n".encode())

        def passed() -> None:
            self._alive_s[me] = monotonic()

        passed()
        try:
            outside: socket.socket = writer.get_extra_info("socket")
            outside.setsockopt(
                socket.SOL_SOCKET, socket.SO_SNDBUF, PIECE_BYTES
            )  # else megabytes hide who reads nothing
            answers, inside = await open_connection(self._inside, self._server.port)
            inside.write(question.raw)
            await gather(_pass_on(reader, inside, passed), _pass_on(answers, writer, passed))
        finally:
            self._alive_s.pop(me, None)

    def _has_room(self) -> bool:
        """For one more client, in the place of a silent one if need be."""
        if len(self._alive_s) < MOST_CLIENTS:
            return True
        silent = min(self._alive_s, key=lambda client: self._alive_s[client])
        if monotonic() - self._alive_s[silent] < SILENT_S:
            return False
        del self._alive_s[silent]
        return silent.cancel()

    def _is_due(self, topic: str, output: Output) -> bool:
        if isinstance(output, Fault):
            return True
        shown_ns = self._shown_ns.get(topic)
        if shown_ns is not None and 0 <= output.t_ns - shown_ns < self._period_ns:
            return False
        self._shown_ns[topic] = output.t_ns
        return True

    def _channel(self, place: TopicKind) -> foxglove.Channel:
        channel = self._channels.get(place.topic)
        if channel is None:
            schema = msgspec.json.decode(json_schema(place.kind))
            channel = foxglove.Channel(place.topic, schema=schema, message_encoding="json", context=self._context)
            self._channels[place.topic] = channel
        return channel
