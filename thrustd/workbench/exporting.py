"""The visible window as CSV, every sample of it, in canonical columns."""

from collections.abc import Iterator, Sequence

import numpy as np

from thrustd.workbench.lines import Line

ROWS = 20_000  # per part


def window_csv(lines: Sequence[Line], start_s: float, stop_s: float) -> Iterator[bytes]:
    """Header, then rows with start_s <= time_s <= stop_s at the shortest digits that read back exactly."""
    time_s = lines[0].columns.time_s
    first, last = np.searchsorted(time_s, start_s, "left"), np.searchsorted(time_s, stop_s, "right")
    yield (",".join(["time_s", *(line.label for line in lines)]) + "\n").encode()
    columns = [time_s, *(line.columns.column(line.channel) for line in lines)]
    for begin in range(int(first), int(last), ROWS):
        part = [column[begin : min(begin + ROWS, int(last))].tolist() for column in columns]
        yield "".join(",".join(map(_cell, row)) + "\n" for row in zip(*part, strict=True)).encode()


def _cell(value: float) -> str:
    return "" if value != value else repr(value)
