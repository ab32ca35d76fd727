"""The bench's wires, without a daemon."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from thrustd.core.errors import UsageError
from thrustd.core.types import Frame
from thrustd.twin.hil import Bench


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(tmp_path / "adc", "fifo", str(tmp_path / "can"))
    yield bench
    bench.close()


def test_nothing_is_played_before_somebody_reads(bench: Bench, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="nobody opened it"):
        bench.wait_for_reader(0.05)
    reader = os.open(tmp_path / "adc", os.O_RDWR | os.O_NOCTTY)
    bench.wait_for_reader()
    report = bench.play([Frame(0, "adc", 0, b"abc\0"), Frame(1, "adc", 0, b"def\0")])
    assert (report.serial_chunks, report.serial_lost) == (2, 0)
    os.set_blocking(reader, False)
    assert os.read(reader, 4) == b"abc\0"
    os.close(reader)
