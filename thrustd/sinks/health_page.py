"""The health page: Prometheus text on loopback, computed when somebody asks."""

import os
from asyncio import StreamReader, StreamWriter
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from thrustd.core.errors import ConfigError
from thrustd.sinks.door import Door, Question, respond
from thrustd.sinks.health_counts import HealthCounts, Histogram

HOST = "127.0.0.1"
Labels = tuple[tuple[str, str], ...]


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
    steady_s: Callable[[], tuple[float, float]] = lambda: (0.0, nan)  # how long steady, how long still to a test point


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
        estimates = {names[e]: n for e, n in dict(counts.estimates).items()}
        yield _counter("thrustd_estimates", "estimates", "engine", estimates)
        yield from self._estimates(names)
        yield _histogram("thrustd_latency_seconds", "event in to estimate out", counts.latency_s)
        yield _histogram("thrustd_nis", "normalised innovation squared of what was trusted", counts.nis)
        yield _gauge("thrustd_queue_events", "events waiting", {(): watched.queue_events()})
        yield _counter("thrustd_shed_events", "events shed for lack of speed", "", {"": watched.shed_events()})
        steady_s, due_s = watched.steady_s()
        yield _gauge("thrustd_steady_seconds", "how long everything is steady", {(): steady_s})
        yield _gauge("thrustd_test_point_due_seconds", "how long still until it is a test point", {(): due_s})
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
    """Serves `GET /metrics` on loopback; ConfigError when the port is taken. Port 0 = any free one."""

    def __init__(self, counts: HealthCounts, watched: Watched, port: int) -> None:
        self._registry = CollectorRegistry()
        self._registry.register(HealthCollector(counts, watched))
        ProcessCollector(registry=self._registry)
        try:
            self._door = Door("health", HOST, port, self._answer)
        except OSError as problem:
            raise ConfigError(f"health.port = {port}: cannot be bound: {problem.strerror}") from None
        self.port = self._door.port

    def close(self) -> None:
        self._door.close()

    async def _answer(self, question: Question, reader: StreamReader, writer: StreamWriter) -> None:
        found = (question.method, question.path) == ("GET", "/metrics")
        body = generate_latest(self._registry) if found else b"only GET /metrics\n"
        await respond(writer, 200 if found else 404, body)


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
