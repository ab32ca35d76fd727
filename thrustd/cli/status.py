"""The verb status: one screen of what the onboard process says about itself, from its health page."""

import argparse
import time
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from thrustd.cli.verb import Verbs, add_json, add_verb, print_json
from thrustd.core.errors import UsageError
from thrustd.installation.folder import configuration_of

if TYPE_CHECKING:
    from rich.console import RenderableType

MAX_PAGE_BYTES = 1_000_000
TIMEOUT_S = 5.0


def add_verbs(verbs: Verbs) -> None:
    status = add_verb(
        verbs, "status", status_verb, "show the state of the running process, refreshed every second",
        "thrustd status deploy/ph-lab.toml",
    )  # fmt: skip
    status.add_argument("config", type=configuration_of, help="configuration of the running process")
    status.add_argument("--once", action="store_true", help="print once and stop")
    add_json(status)


def status_verb(arguments: argparse.Namespace) -> int:
    from thrustd.installation.installation import read_installation

    health = read_installation(arguments.config).config.health
    if health is None:
        raise UsageError(f"{arguments.config}: has no section [health], so the process serves no status")
    url = f"http://127.0.0.1:{health.port}/metrics"
    if arguments.json:
        print_json(read_status(url))
        return 0
    return _show(url, arguments.once)


def _show(url: str, once: bool) -> int:
    from rich.console import Console
    from rich.live import Live

    console = Console(markup=False, highlight=False)
    if once:
        console.print(_screen(read_status(url)))
        return 0
    with Live(_screen(read_status(url)), console=console, screen=console.is_terminal, auto_refresh=False) as live:
        while True:
            time.sleep(1.0)
            try:
                live.update(_screen(read_status(url)), refresh=True)
            except UsageError as problem:  # it may be restarting
                live.update(str(problem), refresh=True)


def read_status(url: str) -> dict[str, Any]:
    """The page as one object: name -> value, or name -> {labels: value}; UsageError when nobody answers."""
    from urllib.error import URLError
    from urllib.request import urlopen  # a thirtieth of every verb's start

    from prometheus_client.parser import text_string_to_metric_families

    try:
        with urlopen(url, timeout=TIMEOUT_S) as answer:
            text = answer.read(MAX_PAGE_BYTES).decode()
        families = list(text_string_to_metric_families(text))
    except (URLError, OSError, ValueError) as problem:
        raise UsageError(f"{url}: no answer ({getattr(problem, 'reason', problem)}): is thrustd running?") from None
    status: dict[str, Any] = defaultdict(dict)
    for family in families:
        for sample in family.samples:
            name = sample.name.removeprefix("thrustd_")
            if sample.labels:
                status[name]["/".join(sample.labels.values())] = sample.value
            else:
                status[name] = sample.value
    return dict(status)


def _screen(status: dict[str, Any]) -> "RenderableType":
    from rich.columns import Columns
    from rich.console import Group
    from rich.table import Table

    columns = "engine", "thrust N", "one sigma N", "mount N", "brochure N", "innovation N", "status"
    engines = Table(*columns, title="thrustd")
    for name in status.get("thrust_newtons", {}):
        values = [_value(status, key, name) for key in ENGINE_COLUMNS]
        words = ", ".join(_words(int(_value(status, "status", name)))) or "healthy"
        engines.add_row(name, *(f"{value:.0f}" for value in values), words)
    inputs = Table("input", "events", "age s", title="inputs")
    for name, count in status.get("events_total", {}).items():
        inputs.add_row(name, f"{count:.0f}", f"{_value(status, 'event_age_seconds', name):.2f}")
    process = Table("process", "", title="process", show_header=False)
    for label, text in _process_rows(status):
        process.add_row(label, text)
    faults = Table("fault", "count", title="faults since the start")
    ordered = sorted(status.get("faults_total", {}).items(), key=lambda row: -row[1])
    for name, count in ordered[:SHOWN_FAULTS]:
        faults.add_row(name, f"{count:.0f}")
    if len(ordered) > SHOWN_FAULTS:
        faults.add_row(f"and {len(ordered) - SHOWN_FAULTS} more, see --json", "")
    return Group(engines, Columns([inputs, process, faults]))


ENGINE_COLUMNS = (
    *("thrust_newtons", "thrust_std_newtons", "mount_newtons", "brochure_newtons"),
    "innovation_newtons",
)
SHOWN_FAULTS = 12


def _value(status: dict[str, Any], name: str, key: str) -> float:
    return float(status.get(name, {}).get(key, float("nan")))


def _words(bits: int) -> list[str]:
    from thrustd.core.types import Status

    return [str(bit.name).lower().replace("_", " ") for bit in Status(bits)]


def _process_rows(status: dict[str, Any]) -> list[tuple[str, str]]:
    latency = status.get("latency_seconds_bucket", {})
    rows = [
        ("up", f"{status['uptime_seconds']:.0f} s"),
        ("latency median, 99 %", f"{_quantile(latency, 0.5)}, {_quantile(latency, 0.99)}"),
        ("queue, shed", f"{status['queue_events']:.0f}, {status['shed_events_total']:.0f}"),
    ]
    if "recording" in status:
        missing = sum(status.get("log_missing_items_total", {}).values())
        word = "yes" if status["recording"] else "NO: nothing is written"
        rows.append(("recording", f"{word}, {missing:.0f} items missing so far"))
        rows.append(("disk left", f"{status.get('log_free_bytes', 0) / 1e9:.1f} GB"))
    if "steady_seconds" in status:
        from thrustd.sinks.live_point import said

        rows.append(("steady for", said(status["steady_seconds"], status["test_point_due_seconds"])))
    if "checkpoint_age_seconds" in status:
        rows.append(("state saved", f"{status['checkpoint_age_seconds']:.1f} s ago"))
    if "process_resident_memory_bytes" in status:
        rows.append(("memory", f"{status['process_resident_memory_bytes'] / 1e6:.0f} MB"))
    return rows


def _quantile(buckets: dict[str, float], fraction: float) -> str:
    """The bucket in which a quantile of a cumulative histogram lies."""
    total = max(buckets.values(), default=0.0)
    for bound, count in buckets.items():
        if total > 0 and count >= fraction * total:
            return f"<= {float(bound) * 1e3:g} ms" if bound != "+Inf" else "above all buckets"
    return "-"
