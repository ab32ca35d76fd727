"""What the flight log costs: `python benchmarks/bench_log.py`. Prints one table; medians of five runs, CPU time."""

import io
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.wire.one_by_one import decode_batch, encode_batch
from thrustd.core.types import Estimate, Event, Fault, Frame, MountOutput, Reading, Tick
from thrustd.sinks.mcap_log import LogWriter, new_log
from thrustd.sources.mcap_log import LogFile
from thrustd.wire.adc_frames import encode
from thrustd.wire.log_layout import LogHeader

HEADER = LogHeader(engines=("left", "right"), mounts=("left_upper", "left_lower", "right_upper", "right_lower"))
ESTIMATE = Estimate(
    1, 0, 5012.3456789, 48.123456789, 12.345678, 5001.23456, 61.23456, 4998.7654, 102.3456, -3.456789,
    7.891234, 0.987654, 3.21, 0.0123, 0.512345, 0,
)  # fmt: skip
RUNS = 5


def live_second() -> list[Event]:
    """One second of 1 kHz ADC (4 channels), 3 x 1 kHz accelerations, 10 x 20 Hz engine and air data, 20 Hz ticks."""
    out: list[Event] = []
    for i in range(1000):
        t_ns = i * 1_000_000
        out.append(Frame(t_ns, "adc", 0, encode(i, i * 1000, (i * 17, -i * 23, i * 31, i))))
        out += [Frame(t_ns + k, "can", 300 + k, bytes((1, 2, 0, i & 255, 63, i & 255, k, 0))) for k in range(3)]
        if i % 50 == 0:
            out += [Frame(t_ns + k, "can", 500 + k, bytes((1, 2, 0, i // 50, 70, 20, k, 0))) for k in range(10)]
            out.append(Tick(t_ns))
    return out


def us_each(count: int, work: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times) / count * 1e6


def write_events(events: list[Event], seconds: int) -> LogWriter:
    log = LogWriter(io.BytesIO(), HEADER, sync_s=None)
    number = 0
    for _ in range(seconds):
        for event in events:
            log.write_event(event, number)
            number += 1
    log.close()
    return log


def write_outputs(output: Estimate | MountOutput | Fault | Reading, count: int) -> None:
    log = LogWriter(io.BytesIO(), HEADER, sync_s=None)
    for _ in range(count):
        log.write_output(output)
    log.close()


def main() -> None:
    events, seconds, count = live_second(), 10, 20_000
    batch = encode_batch(0, events[:64])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.mcap"
        with new_log(path, HEADER) as log:
            for _ in range(seconds):
                for event in events:
                    log.write_event(event)
        bytes_per_hour = path.stat().st_size / seconds * 3600
        read_us = us_each(seconds * len(events), lambda: sum(1 for _ in LogFile(path).events()))
    rows = {
        "encode a batch, per event": us_each(64 * 500, lambda: [encode_batch(0, events[:64]) for _ in range(500)]),
        "decode a batch, per event": us_each(64 * 500, lambda: [decode_batch(batch) for _ in range(500)]),
        "write an event to the log": us_each(seconds * len(events), lambda: write_events(events, seconds)),
        "read an event from the log": read_us,
        "write an estimate": us_each(count, lambda: write_outputs(ESTIMATE, count)),
        "write a mount output": us_each(count, lambda: write_outputs(MountOutput(1, 0, 0.5123, 2512.345, 31.5), count)),
        "write a fault": us_each(count, lambda: write_outputs(Fault(1, "adc", "damaged"), count)),
        "offer a reading that is thinned out": us_each(
            count, lambda: write_outputs(Reading(1, "accel_x_g", 0, 0.12345), count)
        ),
    }
    table = Table(title=f"flight log, {len(events)} events per second of flight")
    table.add_column("what")
    table.add_column("us", justify="right")
    for name, value in rows.items():
        table.add_row(name, f"{value:.2f}")
    console = Console()
    console.print(table)
    console.print(f"raw log: {bytes_per_hour / 1e6:.0f} MB per hour")


if __name__ == "__main__":
    main()
