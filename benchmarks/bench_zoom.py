"""Zooming in the workbench: `python -m benchmarks bench_zoom`. Latency and payload over HTTP, as the page asks.

A real workbench serves a record of 1 and 10 million samples (CSV and npz). First page: from the question for the page
to the first window of lines, with nothing prepared and with the pyramid on the disk. Zooms: 300 random windows of four
channels and a full HD page's 1600 columns.
"""

import http.client
import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from rich.console import Console
from rich.table import Table

from tests.workbench.served import workbench
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

SIZES = (1_000_000, 10_000_000)
CHANNELS = ("deformation_mm", "force_N", "accel_x_g", "temperature_degC")
ZOOMS = 300
COLUMNS = 1600


class Page:
    """What a browser would ask, on one connection."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self._path = parts.path
        self._connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=120)

    def get(self, path: str, method: str = "GET", body: str | None = None) -> bytes:
        self._connection.request(method, self._path + path, body)
        answer = self._connection.getresponse()
        content = answer.read()
        if answer.status != 200:
            raise RuntimeError(content.decode())
        return content

    def state(self) -> dict[str, Any]:
        return dict(json.loads(self.get("api/state")))

    def window(self, name: str, start_s: float, stop_s: float) -> int:
        """Bytes of one answer."""
        channels = "".join(f"&channel={channel}" for channel in CHANNELS)
        query = f"recording={name}{channels}&from={start_s}&to={stop_s}&buckets={COLUMNS}"
        return len(self.get(f"api/lines?{query}"))


def write_record(path: Path, samples: int) -> None:
    """Four channels at 100 Hz."""
    rng = np.random.default_rng(1)
    time_s = np.arange(samples) / 100.0
    deformation = np.round(0.5 + 0.4 * np.sin(time_s / 300) + 1e-3 * rng.standard_normal(samples), 6)
    columns = {
        "deformation_mm": deformation,
        "force_N": np.round(5000 * deformation + 12 * rng.standard_normal(samples), 2),
        "accel_x_g": np.round(0.05 * rng.standard_normal(samples), 4),
        "temperature_degC": np.round(20 + time_s / 5000, 3),
    }
    write_recording(make_recording(path.stem, {"time_s": np.round(time_s, 3), **columns}), path)


def first_page(page: Page, name: str) -> float:
    """Seconds from asking for the page to the first lines; reads and prepares the record when it must."""
    began = time.perf_counter()
    page.get("")
    if page.state()["recordings"][0]["meta"] is None:
        page.get("api/jobs", "POST", json.dumps({"kind": "prepare", "recording": name}))
        while (meta := page.state()["recordings"][0]["meta"]) is None:
            time.sleep(0.02)
    else:
        meta = page.state()["recordings"][0]["meta"]
    page.window(name, meta["start_s"], meta["stop_s"])
    return time.perf_counter() - began


def zooms(page: Page, name: str, length_s: float) -> tuple[list[float], int]:
    """Milliseconds of random windows from a second to the whole record, and the largest answer in bytes."""
    rng = np.random.default_rng(2)
    took_ms, largest = [], 0
    for _ in range(ZOOMS):
        span_s = length_s * 10 ** rng.uniform(-5, 0)
        start_s = rng.uniform(0, length_s - span_s)
        began = time.perf_counter()
        largest = max(largest, page.window(name, start_s, start_s + span_s))
        took_ms.append(1e3 * (time.perf_counter() - began))
    return took_ms, largest


def measure(folder: Path, samples: int, kind: str) -> tuple[str, ...]:
    name = f"record.{kind}"
    write_record(folder / name, samples)
    with workbench(folder) as served:
        page = Page(served.url)
        first_s, cached_s = first_page(page, name), first_page(page, name)
        took_ms, largest = zooms(page, name, samples / 100.0)
    took_ms.sort()
    late = took_ms[int(0.99 * len(took_ms))]
    return (
        f"{samples:,}", kind, f"{first_s:.2f}", f"{cached_s:.2f}", f"{statistics.median(took_ms):.1f}", f"{late:.1f}",
        f"{largest / 1000:.0f}",
    )  # fmt: skip


def main() -> None:
    table = Table(title=f"Workbench: {len(CHANNELS)} channels, {COLUMNS} columns, {ZOOMS} random windows")
    heads = ("samples", "file", "first page s", "cached s", "zoom median ms", "99 % ms", "largest answer kB")
    for head in heads:
        table.add_column(head, justify="right")
    for samples in SIZES:
        for kind in ("npz", "csv"):
            with tempfile.TemporaryDirectory() as folder:
                table.add_row(*measure(Path(folder), samples, kind))
    Console().print(table)


if __name__ == "__main__":
    main()
