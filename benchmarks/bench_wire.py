"""What a byte costs from the wire to a value: `python benchmarks/bench_wire.py`. Medians of five runs, CPU time."""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.wire.one_by_one import adc_items, can_items, deframed
from thrustd.core.types import Frame
from thrustd.wire.adc_frames import AdcDecoder, encode
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS, CanEncoder
from thrustd.wire.can_table import CanTable, CanUnits
from thrustd.wire.framing import Deframer

DBC = Path(__file__).parents[1] / "deploy" / "canaerospace.dbc"
COUNT = 100_000
RUNS = 5


def us_each(work: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times) / COUNT * 1e6


def deframe(chunks: list[bytes]) -> None:
    deframer = Deframer()
    for chunk in chunks:
        deframed(deframer, chunk)


def decode_adc(chunks: list[bytes], chunk_ns: int) -> None:
    decoder = AdcDecoder(4, 1000)
    for number, chunk in enumerate(chunks):
        adc_items(decoder, number * chunk_ns, chunk)


def decode_can(table: CanTable, frames: list[Frame]) -> None:
    decoder = CanDecoder(table)
    for frame in frames:
        can_items(decoder, frame)


def main() -> None:
    frames = [encode(n, n * 1000, (n, -n, 3 * n, 7)) for n in range(COUNT)]
    tens = [b"".join(frames[n : n + 10]) for n in range(0, COUNT, 10)]
    stream = b"".join(frames)
    halves = [stream[n : n + 13] for n in range(0, len(stream), 13)]
    start = time.process_time()
    table = CanTable.from_dbc(DBC.read_text(), ICD_INPUT_ROWS, CanUnits())
    load_ms = (time.process_time() - start) * 1e3
    encoder = CanEncoder(table, 1)
    messages = [Frame(n * 333_000, "can", *encoder.encode("accel_x_g", 0, n * 1e-5)) for n in range(COUNT)]
    rows = {
        "deframe, one frame per chunk": us_each(lambda: deframe(frames)),
        "ADC frame (4 channels) to sample, one per chunk": us_each(lambda: decode_adc(frames, 1_000_000)),
        "ADC frame to sample, ten per chunk": us_each(lambda: decode_adc(tens, 10_000_000)),
        "ADC frame to sample, cut every 13 bytes": us_each(lambda: decode_adc(halves, 500_000)),
        "ADC frame encoded": us_each(lambda: [encode(n, n, (1, 2, 3, 4)) for n in range(COUNT)]),
        "CANaerospace message to reading": us_each(lambda: decode_can(table, messages)),
    }
    shown = Table(title="wire")
    shown.add_column("what")
    shown.add_column("us", justify="right")
    for name, value in rows.items():
        shown.add_row(name, f"{value:.2f}")
    shown.add_row("DBC read and compiled, once [ms]", f"{load_ms:.1f}")
    Console().print(shown)


if __name__ == "__main__":
    main()
