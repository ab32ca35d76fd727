"""Order and number of segments by held-out blocks (`--order auto`).

Every choice is fitted to the first three quarters of each record and judged on the free run over the whole, counting
the last quarter only. The smallest model within 2 % of the best wins: a knot that removes less is not worth having.
Short records are not asked for more knots than their samples can place.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from rich.table import Table

from thrustd.identify.hw_fit import HwSettings, Progress, fit_segments
from thrustd.identify.hw_spec import spec_of
from thrustd.identify.segments import Segment, head, segments_of
from thrustd.identify.sensitivity import residuals
from thrustd.records.recording import Recording

ORDERS = (1, 2, 3, 4, 6)
SEGMENTS = (1, 3, 6, 10)
FEWEST, ROWS_PER_SEGMENT = 3, 100  # segments that are always tried, samples that each further one asks for
TRAIN_SHARE = 0.75
WORTH_IT = 1.02


@dataclass(frozen=True, slots=True)
class Choice:
    """One line of the table."""

    order: int
    segments: int
    train_rmse_n: float
    held_out_rmse_n: float


@dataclass(frozen=True, slots=True)
class Chosen:
    settings: HwSettings
    choices: tuple[Choice, ...]

    def to_json(self) -> list[dict[str, float]]:
        return [asdict(choice) for choice in self.choices]

    def table(self, unit: str = "N") -> Table:
        """`unit` of the output, empty when nobody knows it."""
        table = Table(title="order and segments by held-out blocks")
        told = f", {unit}" if unit else ""
        for name in ("order", "segments", f"train{told}", f"held out{told}", ""):
            table.add_column(name, justify="right")
        for c in self.choices:
            mark = "chosen" if (c.order, c.segments) == (self.settings.order, self.settings.input_segments) else ""
            table.add_row(str(c.order), str(c.segments), f"{c.train_rmse_n:.4g}", f"{c.held_out_rmse_n:.4g}", mark)
        return table


def choose_order(
    records: Sequence[Recording], base: HwSettings | None = None, progress: Progress | None = None
) -> Chosen:
    """First the segments at the largest order, then the order at those segments."""
    settings, whole = base or HwSettings(), segments_of(records)
    most, rows = max(ORDERS), TRAIN_SHARE * sum(map(len, whole))
    counts = [n for n in SEGMENTS if n <= max(FEWEST, rows / ROWS_PER_SEGMENT)]
    choices = [_judged(whole, _with(settings, most, count), progress) for count in counts]
    count = _smallest(choices, [c.segments for c in choices])
    by_order = [_judged(whole, _with(settings, order, count), progress) for order in ORDERS if order != most]
    by_order.append(next(c for c in choices if c.segments == count))
    order = _smallest(by_order, [c.order for c in by_order])
    return Chosen(_with(settings, order, count), tuple(dict.fromkeys([*choices, *by_order])))


def _with(settings: HwSettings, order: int, segments: int) -> HwSettings:
    return replace(settings, order=order, input_segments=segments, output_segments=segments)


def _judged(whole: Sequence[Segment], settings: HwSettings, progress: Progress | None) -> Choice:
    cuts = [round(TRAIN_SHARE * len(segment)) for segment in whole]
    first = [head(segment, cut) for segment, cut in zip(whole, cuts, strict=True)]
    fit = fit_segments(first, settings, progress)
    spec = spec_of(fit, "choice")
    late = [residuals(spec, segment)[cut:] for segment, cut in zip(whole, cuts, strict=True)]
    held_out = float(np.sqrt(np.nanmean(np.concatenate(late) ** 2)))
    return Choice(settings.order, settings.input_segments, fit.rmse, held_out)


def _smallest(choices: Sequence[Choice], sizes: Sequence[int]) -> int:
    best = min(choice.held_out_rmse_n for choice in choices)
    return min(size for c, size in zip(choices, sizes, strict=True) if c.held_out_rmse_n <= WORTH_IT * best)
