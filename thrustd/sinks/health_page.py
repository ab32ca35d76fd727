"""The health page: Prometheus text on loopback, computed when somebody asks."""

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from thrustd.core.errors import ConfigError
from thrustd.sinks.health_counts import HealthCounts, Histogram

HOST = "127.0.0.1"
Labels = tuple[tuple[str, str], ...]
ASK_TIMEOUT_S = 5.0  # a client that does not finish its question is left


class Watched(NamedTuple):
    """What the page shows besides the counts, asked when it is read; None = there is no such part."""

    engines: tuple[str, ...]
    about: dict[str, str]
    queue_events: Callable[[], int]
    shed_events: Callable[[], int]
    log_folder: Path | None
    log_path: Callable[[], Path | None]
    log_missing: Callable[[], tuple[int, int]]  # items dropped for lack of speed, items lost with a file
    checkpoint_ns: Callable[[], int | None]  # when it was last written


class HealthCollector(Collector):
    """Counts -> metric families."""

    def __init__(self, counts: HealthCounts, watched: Watched) -> None:
        self._counts, self._watched = counts, watched

    def collect(self) -> Iterator[Metric]:
        counts, watched = self._counts, self._watched
        yield _gauge("thrustd_info", "what flies", {tuple(watched.about.items()): 1})
        yield _gauge("thrustd_uptime_seconds", "since the start", {(): (counts.clock_ns() - counts.started_ns) * 1e-9})
        yield _counter("thrustd_events", "events in", "channel", dict(counts.events))
        ages: dict[Labels, float] = {(("channel", channel),): counts.age_s(channel) for channel in dict(counts.last_ns)}
        yield _gauge("thrustd_event_age_seconds", "since the last event", ages)
        faults = CounterMetricFamily("thrustd_faults", "faults by place and kind", labels=("where", "kind"))
        for place, count in dict(counts.faults).items():
            faults.add_metric(place, count)
        yield faults
        names = dict(enumerate(watched.engines))
        yield _counter("thrustd_estimates", "estimates", "engine", {names[e]: n for e, n in counts.estimates.items()})
        yield from self._estimates(names)
        yield _histogram("thrustd_latency_seconds", "event in to estimate out", counts.latency_s)
        yield _histogram("thrustd_nis", "normalised innovation squared of what was believed", counts.nis)
        yield _gauge("thrustd_queue_events", "events waiting", {(): watched.queue_events()})
        yield _counter("thrustd_shed_events", "events shed for lack of speed", "", {"": watched.shed_events()})
        yield from self._disk()

    def _estimates(self, names: dict[int, str]) -> Iterator[Metric]:
        latest: dict[Labels, Any] = {
            (("engine", names[e]),): estimate for e, estimate in dict(self._counts.latest).items()
        }
        for field, unit in (
            *(("thrust_n", "thrust_newtons"), ("thrust_std_n", "thrust_std_newtons"), ("mount_n", "mount_newtons")),
            *(("brochure_n", "brochure_newtons"), ("innovation_n", "innovation_newtons")),
            *(("brochure_innovation_n", "brochure_innovation_newtons"), ("mount_bias_n", "mount_bias_newtons")),
            *(("brochure_bias", "brochure_bias_ratio"), ("status", "status")),
        ):
            values: dict[Labels, float] = {
                labels: float(getattr(estimate, field)) for labels, estimate in latest.items()
            }
            yield _gauge(f"thrustd_{unit}", f"latest {field}", values)

    def _disk(self) -> Iterator[Metric]:
        watched = self._watched
        if watched.log_folder is not None:
            yield _gauge("thrustd_recording", "1 while a log is written", {(): float(watched.log_path() is not None)})
            dropped, lost = watched.log_missing()
            missing = {"slow": dropped, "refused": lost}
            yield _counter("thrustd_log_missing_items", "items not in the log", "disk", missing)
            with suppress(OSError):
                disk = os.statvfs(watched.log_folder)
                yield _gauge("thrustd_log_free_bytes", "left on the disk", {(): disk.f_bavail * disk.f_frsize})
        written_ns = watched.checkpoint_ns()
        if written_ns is not None:
            age_s = (self._counts.clock_ns() - written_ns) * 1e-9
            yield _gauge("thrustd_checkpoint_age_seconds", "since the state was saved", {(): age_s})


class HealthPage:
    """Serves `GET /metrics` from a thread; ConfigError when the port is taken. Port 0 = any free one."""

    def __init__(self, counts: HealthCounts, watched: Watched, port: int) -> None:
        registry = CollectorRegistry()
        registry.register(HealthCollector(counts, watched))
        ProcessCollector(registry=registry)

        class Answer(BaseHTTPRequestHandler):
            timeout = ASK_TIMEOUT_S

            def do_GET(self) -> None:
                found = self.path == "/metrics"
                body = generate_latest(registry) if found else b"only /metrics\n"
                self.send_response(200 if found else 404)
                self.send_header("Content-Type", "text/plain; version=0.0.4; charset=utf-8")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                """Nobody wants to read that."""

        try:
            self._server = _Server((HOST, port), Answer)
        except OSError as problem:
            raise ConfigError(f"health.port = {port}: cannot be bound: {problem.strerror}") from None
        self.port: int = self._server.server_address[1]
        self._thread = Thread(target=self._server.serve_forever, name="health", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """A client that went away is not worth a traceback."""


def _gauge(name: str, meaning: str, values: dict[Labels, float]) -> Metric:
    labels = [label for label, _ in next(iter(values), ())]
    family = GaugeMetricFamily(name, meaning, labels=labels)
    for key, value in values.items():
        family.add_metric([text for _, text in key], value)
    return family


def _counter(name: str, meaning: str, label: str, values: dict[str, int]) -> Metric:
    family = CounterMetricFamily(name, meaning, labels=[label] if label else [])
    for key, value in values.items():
        family.add_metric([key] if label else [], value)
    return family


def _histogram(name: str, meaning: str, histogram: Histogram) -> Metric:
    family = HistogramMetricFamily(name, meaning)
    total, buckets = 0, []
    for bound, count in zip((*histogram.bounds, float("inf")), histogram.counts, strict=True):
        total += count
        buckets.append(("+Inf" if bound == float("inf") else str(bound), float(total)))
    family.add_metric([], buckets, histogram.sum)
    return family
