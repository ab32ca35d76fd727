"""The live view: outputs on a WebSocket in Foxglove's protocol, bound to loopback unless told otherwise.

foxglove-sdk sends from its own threads and keeps a bounded backlog per client, oldest dropped first, so a client that
does not read costs nobody anything. Topics and JSON are those of the flight log.
"""

from collections.abc import Callable
from typing import Final

import foxglove
import msgspec

from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Output
from thrustd.wire.log_layout import TopicKind, Topics, json_schema

WHERE: Final = "live_view"
BACKLOG_MESSAGES = 1024  # per client


class LiveView:
    """A sink that shows outputs, thinned to `rate_hz` per topic; faults are all shown."""

    def __init__(
        self,
        engines: tuple[str, ...],
        mounts: tuple[str, ...],
        report: Callable[[Fault], None],
        host: str = "127.0.0.1",
        port: int = 8765,
        rate_hz: float = 10.0,
        epoch_offset_ns: int = 0,
    ) -> None:
        """ConfigError when the address cannot be bound. Port 0 = any free one, see `port`."""
        self.failed_outputs = 0
        self._context = foxglove.Context()
        self._topics = Topics(engines, mounts)
        self._report = report
        self._period_ns = round(1e9 / rate_hz)
        self._offset_ns = epoch_offset_ns
        self._channels: dict[str, foxglove.Channel] = {}
        self._shown_ns: dict[str, int] = {}
        try:
            self._server = foxglove.start_server(
                name="thrustd", host=host, port=port, context=self._context, message_backlog_size=BACKLOG_MESSAGES
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise ConfigError(f"live_view = {host}:{port}: cannot be bound: {error}") from None
        for place in self._topics.fixed():
            self._channel(place)

    @property
    def port(self) -> int:
        return self._server.port

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
                self._report(Fault(output.t_ns, WHERE, "live_view"))

    def close(self) -> None:
        """Disconnect everybody."""
        self._server.stop()

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
