"""The health page, the heartbeat and the status bits."""

import ast
import socket
import threading
from contextlib import ExitStack
from math import nan
from pathlib import Path
from urllib.request import urlopen

import pytest

import thrustd
from docs import build_interfaces as interfaces
from thrustd.cli.status import read_status
from thrustd.core.errors import ConfigError, UsageError
from thrustd.core.faults import FAULT_KINDS, UNTIL_OVER
from thrustd.core.types import Estimate, Fault, Frame, Status
from thrustd.onboard.checkpoint import Clocks
from thrustd.onboard.heartbeat import Heartbeat, status_line
from thrustd.pipeline.fault_status import FaultStatus
from thrustd.sensors import signal_watch
from thrustd.sinks.health_counts import HealthCounts
from thrustd.sinks.health_page import HealthPage, Watched
from thrustd.wire import adc_frames, can_decoder
from thrustd.wire.event_batch import EventBatch

S = 1_000_000_000


def estimate(t_ns, engine=0, thrust_n=5000.0, status=0):
    values = (thrust_n, 80.0, 0.0, 5010.0, 60.0, nan, nan, 12.0, nan, 1.5, 3.0, 0.01, 0.5, status)
    return Estimate(t_ns, engine, *values)


def watched(folder):
    return Watched(("left", "right"), {"aircraft": 'P"H'}, lambda: 7, lambda: 3, folder, lambda: None,
                   lambda: (1, 2), lambda: None, lambda: (12.0, 18.0))  # fmt: skip


@pytest.fixture
def page(tmp_path):
    now = [0]
    counts = HealthCounts(lambda: now[0])
    page = HealthPage(counts, watched(tmp_path), 0)
    yield now, counts, page
    page.close()


def test_the_page_tells_what_was_counted(page):
    now, counts, server = page
    for k in range(10):
        times_ns = (
            (k * S - 900_000, "can"),
            (k * S + 100_000, "can"),
            (k * S + 2_000_000, "adc"),
        )  # of a sample of k * S
        counts.take_batch(EventBatch.of([Frame(t_ns, wire, 0, b"x") for t_ns, wire in times_ns]))
        now[0] = k * S + 2_300_000
        counts.write_output(estimate(k * S))
    counts.write_output(Fault(0, "adc", "lost", count=5))
    counts.write_output(Fault(0, "adc", "lost", count=2))
    counts.write_output(Fault(0, "adc", "unplugged"))
    counts.write_output(Fault(1, "adc", "unplugged", active=False))  # its end is no second one
    status = read_status(f"http://127.0.0.1:{server.port}/metrics")
    assert status["events_total"] == {"adc": 10, "can": 20}
    assert status["faults_total"] == {"lost/adc": 7, "unplugged/adc": 1}
    assert status["thrust_newtons"] == {"left": 5000}
    assert status["latency_seconds_bucket"]["0.0002"] == 0
    assert status["latency_seconds_bucket"]["0.0005"] == 10
    assert status["nis_count"] == 10
    assert (status["queue_events"], status["shed_events_total"]) == (7, 3)
    assert status["log_missing_items_total"] == {"slow": 1, "refused": 2}
    assert (status["steady_seconds"], status["test_point_due_seconds"]) == (12, 18)
    assert status["recording"] == 0
    assert status["log_free_bytes"] > 0


def test_anything_else_is_not_found_and_a_second_page_cannot_have_the_port(page, tmp_path):
    _, counts, server = page
    with pytest.raises(Exception, match="404"):
        urlopen(f"http://127.0.0.1:{server.port}/etc/passwd")
    with pytest.raises(ConfigError, match="cannot be bound"):
        HealthPage(counts, watched(tmp_path), server.port)


def asked(port, head):
    with socket.create_connection(("127.0.0.1", port), timeout=20) as client:
        client.sendall(head.encode())
        return client.makefile("rb").readline()


@pytest.mark.parametrize(
    "head, status",
    [
        ("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1:9105\r\n\r\n", b"200"),
        ("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n", b"200"),
        ("GET /metrics HTTP/1.1\r\nHost: [::1]:9105\r\n\r\n", b"200"),
        ("GET /metrics HTTP/1.1\r\nHost: example.org:9105\r\n\r\n", b"403"),
        ("GET /metrics HTTP/1.1\r\nHost: localhost\r\nOrigin: http://example.org\r\n\r\n", b"403"),
        ("POST /metrics HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n", b"404"),
        ("GET /metrics HTTP/1.1\r\n\r\n", b""),  # HTTP asks for a Host
        ("nonsense\r\n\r\n", b""),
        ("GET /" + "x" * 20_000, b""),
    ],
)
def test_only_who_asks_this_machine_from_no_other_page_is_answered(page, head, status):
    assert asked(page[2].port, head)[9:12] == status


def test_three_hundred_slow_clients_cost_no_thread_and_keep_nobody_out(page):
    url, threads = f"http://127.0.0.1:{page[2].port}/metrics", threading.active_count()
    with ExitStack() as slow:
        for _ in range(300):
            client = slow.enter_context(socket.create_connection(("127.0.0.1", page[2].port), timeout=20))
            client.sendall(b"GET /metrics HTTP/1.1\r\nHost:")
        assert read_status(url)["queue_events"] == 7
        assert threading.active_count() == threads


def test_nobody_there_is_one_clear_line():
    with pytest.raises(UsageError, match="is thrustd running"):
        read_status("http://127.0.0.1:1/metrics")


class Service:
    def __init__(self):
        self.said = []

    def say(self, message):
        self.said.append(message)


@pytest.fixture
def heart():
    service, faults, saved, utc = Service(), [], [], [1000 * S]
    counts = HealthCounts(lambda: 0)
    seconds = [0]

    def clocks():
        seconds[0] += 1
        return Clocks("boot", seconds[0] * S, utc[0] + seconds[0] * S)

    return (
        Heartbeat(service, lambda: status_line(counts, ("left", "right"), str), clocks, faults.append, saved.append),
        service,
        faults,
        saved,
        utc,
        counts,
    )


def test_it_beats_once_a_second_of_events_and_saves_as_often(heart):
    beating, service, faults, saved, *_ = heart
    for k in range(1000):
        beating.take_time(S + k * 10_000_000)
    assert len(service.said) == len(saved) == 10
    assert all(word.startswith("WATCHDOG=1\nSTATUS=") for word in service.said)
    assert faults == []


def test_a_hung_loop_is_silent(heart):
    assert heart[1].said == []


def test_a_calendar_that_jumps_is_a_fault_with_its_size(heart):
    beating, _, faults, _, utc, _ = heart
    beating.take_time(1 * S)
    utc[0] -= 3600 * S
    beating.take_time(2 * S)
    beating.take_time(3 * S)
    assert [(fault.where, fault.kind, fault.count) for fault in faults] == [("clock", "clock_step", 3_600_000)]


def test_the_service_manager_hears_thrust_and_troubles(heart):
    counts = heart[-1]
    assert status_line(counts, ("left", "right"), str) == "no estimate yet"
    counts.write_output(estimate(0, 1, status=int(Status.NOT_RECORDING | Status.LINK_LOST)))
    assert status_line(counts, ("left", "right"), str) == "right 5000 +- 80 N; degraded: link lost, not recording"


OURS = {word: kind for word, kind in FAULT_KINDS.items() if not kind.of_engine}


@pytest.mark.parametrize("kind", sorted(word for word, kind in OURS.items() if kind.shows_s != UNTIL_OVER))
def test_a_momentary_fault_shows_for_a_moment(kind):
    status = FaultStatus(2, {"left_lower": 0})
    status.take(Fault(5 * S, "somewhere", kind))
    assert status.bits(5 * S).tolist() == [FAULT_KINDS[kind].status] * 2
    assert status.bits(16 * S).tolist() == [0, 0]


@pytest.mark.parametrize("kind", sorted(word for word, kind in OURS.items() if kind.shows_s == UNTIL_OVER))
def test_a_fault_with_an_end_shows_until_then_at_every_place(kind):
    status = FaultStatus(2, {"left_lower": 0})
    for where in ("a", "b"):
        status.take(Fault(0, where, kind))
    status.take(Fault(1, "a", kind, active=False))
    assert status.bits(1000 * S).tolist() == [FAULT_KINDS[kind].status] * 2
    status.take(Fault(2, "b", kind, active=False))
    assert status.bits(1000 * S).tolist() == [0, 0]


@pytest.mark.parametrize("kind", [*sorted({*FAULT_KINDS} - {*OURS}), "a word of another version"])
def test_what_the_fusion_shows_by_engine_is_not_shown_twice(kind):
    status = FaultStatus(2, {"left_lower": 0})
    status.take(Fault(0, "left_upper", kind))
    assert status.bits(0).tolist() == [0, 0]


def test_no_fault_is_reported_by_another_word():
    root = Path(thrustd.__file__).parent
    trees = [ast.parse(path.read_text()) for path in root.rglob("*.py")]
    faults = [n for tree in trees for n in ast.walk(tree) if isinstance(n, ast.Call) and ast.unparse(n.func) == "Fault"]
    kinds = {n.args[2].value for n in faults if len(n.args) > 2 and isinstance(n.args[2], ast.Constant)}
    kinds |= {kind for kind, _ in adc_frames.KINDS} | {*can_decoder.KINDS}
    assert {"clock_step", "overrun", "cold"} <= kinds  # the search finds them
    assert kinds | set(signal_watch.KINDS[1:]) <= set(FAULT_KINDS)


def test_the_page_of_all_faults_and_bits_is_that_of_this_code():
    assert interfaces.page() == Path(interfaces.__file__).with_name("interfaces.md").read_text()
