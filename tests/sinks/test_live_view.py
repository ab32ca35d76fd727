"""The live view: on loopback, in Foxglove's protocol, indifferent to clients that do not read."""

import json
import re
import socket
import threading
from contextlib import ExitStack
from time import monotonic
from typing import Any

import pytest

from thrustd.core import config
from thrustd.core.errors import ConfigError
from thrustd.core.types import Estimate, Fault, MountOutput
from thrustd.sinks import live_view
from thrustd.sinks.live_view import LiveView
from thrustd.wire.log_layout import LogHeader

HELLO = (
    "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
)
LIMIT_S = 20.0


HEADER = LogHeader(engines=("left", "right"), mounts=("left_upper",))
ANY_PORT = config.LiveView(port=0)


def view(faults: list[Fault], wish: config.LiveView = ANY_PORT, **more: Any) -> LiveView:
    return LiveView(wish, HEADER, faults.append, **more)


def estimate(t_ns: int) -> Estimate:
    return Estimate(t_ns, 1, 5000.0, 42.0, *[0.0] * 11, status=0)


def test_a_client_is_told_the_topics_of_the_log() -> None:
    faults: list[Fault] = []
    live = view(faults)
    with socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S) as client:
        client.sendall(HELLO.encode())
        heard = b""
        while b"/mount/left_upper" not in heard or b"/estimate/right" not in heard:
            heard += client.recv(65536)
    assert heard.startswith(b"HTTP/1.1 101")
    live.write_output(estimate(0))
    live.close()
    assert faults == []


def test_a_client_that_does_not_read_holds_up_nobody() -> None:
    faults: list[Fault] = []
    live = view(faults, rate_hz=1e6)
    with socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S) as client:
        client.sendall(HELLO.encode())
        client.recv(100)
        for step in range(20_000):
            live.write_output(MountOutput(step * 20_000_000, 0, 0.5, 2500.0, 30.0))
    live.close()
    assert live.failed_outputs == 0
    assert faults == []


def answer_to(live: LiveView, *headers: str) -> bytes:
    """The first line of the answer to a client with these headers."""
    with socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S) as client:
        hello = HELLO.replace("Host: localhost\r\n", "".join(f"{header}\r\n" for header in headers))
        client.sendall(hello.encode())
        return client.recv(100).partition(b"\r\n")[0]


def test_a_strange_page_does_not_read_along() -> None:
    said: list[str] = []
    live = view([], say=said.append)
    here = f"Host: 127.0.0.1:{live.port}"
    for headers in ((here,), (here, "Origin: https://app.foxglove.dev"), (f"Host: localhost:{live.port}",)):
        assert answer_to(live, *headers).startswith(b"HTTP/1.1 101"), headers
    for strange in ((here, "Origin: https://example.org"), ("Host: rebound.example.org",), (here, "Origin: null"), ()):
        assert answer_to(live, *strange)[9:12] in (b"403", b""), strange
    live.close()
    assert said == [
        "live_view: a page of 'https://example.org' asked, expected https://app.foxglove.dev"
        " (live_view.origins lists the pages that may)"
    ]


def test_three_hundred_slow_clients_cost_no_thread_and_keep_nobody_out() -> None:
    live = view([])
    answer_to(live, "Host: localhost")
    threads = threading.active_count()
    with ExitStack() as slow:
        for _ in range(300):
            client = slow.enter_context(socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S))
            client.sendall(b"GET / HTTP/1.1\r\nHost:")
        assert answer_to(live, "Host: localhost").startswith(b"HTTP/1.1 101")
        assert threading.active_count() <= threads + 4  # the server's own, as they first say something
    live.close()


def test_so_many_look_on_and_no_more() -> None:
    live = view([])
    with ExitStack() as looking:
        for _ in range(live_view.MOST_CLIENTS):
            client = looking.enter_context(socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S))
            client.sendall(HELLO.encode())
            assert client.recv(100).startswith(b"HTTP/1.1 101")
        assert answer_to(live, "Host: localhost").startswith(b"HTTP/1.1 503")
    while answer_to(live, "Host: localhost").startswith(b"HTTP/1.1 503"):
        pass  # until it has noticed that they went
    live.close()


def subscribe(client: socket.socket) -> None:
    """To what the mount says: a client's frame, masked with nothing."""
    heard = b""
    while not (found := re.search(rb'"id":(\d+),"topic":"/mount/left_upper"', heard)):
        heard += client.recv(65536)
    asked = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": int(found[1])}]}
    text = json.dumps(asked).encode().ljust(126)
    client.sendall(b"\x81" + bytes([0x80 | 126]) + len(text).to_bytes(2, "big") + bytes(4) + text)


@pytest.mark.parametrize(
    ("silent_s", "take_s", "subscribed"),
    [(0.3, 1e6, False), (0.3, 1e6, True), (1e6, 0.5, True)],
    ids=["who asked for nothing", "who asked", "without anyone who waits"],
)
def test_who_reads_nothing_loses_his_place_and_others_get_in(
    monkeypatch: pytest.MonkeyPatch, silent_s: float, take_s: float, subscribed: bool
) -> None:
    monkeypatch.setattr(live_view, "SILENT_S", silent_s)
    monkeypatch.setattr(live_view, "TAKE_S", take_s)
    live = view([], rate_hz=1e6)
    until = monotonic() + LIMIT_S
    with ExitStack() as silent:
        for _ in range(live_view.MOST_CLIENTS):
            client = silent.enter_context(socket.create_connection(("127.0.0.1", live.port), timeout=LIMIT_S))
            client.sendall(HELLO.encode())
            assert client.recv(100).startswith(b"HTTP/1.1 101")
            if subscribed:
                subscribe(client)
        assert answer_to(live, "Host: localhost").startswith(b"HTTP/1.1 503")
        while not answer_to(live, "Host: localhost").startswith(b"HTTP/1.1 101"):
            assert monotonic() < until, "nobody was sent away"
            for step in range(200):
                live.write_output(MountOutput(step * 20_000_000, 0, 0.5, 2500.0, 30.0))
    live.close()


def test_a_taken_port_is_refused_in_one_line() -> None:
    first = view([])
    with pytest.raises(ConfigError, match=f"live_view = 127.0.0.1:{first.port}"):
        view([], config.LiveView(port=first.port))
    first.close()


def test_it_binds_to_loopback_unless_told_otherwise() -> None:
    live = view([])
    with pytest.raises(OSError):
        socket.create_connection((_outer_address(), live.port), timeout=LIMIT_S).close()
    live.close()


def _outer_address() -> str:
    """An address of this machine that is not loopback's first; connecting a datagram socket sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
        except OSError:
            return "127.0.0.2"
        return str(probe.getsockname()[0])
