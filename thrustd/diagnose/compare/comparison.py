"""What a comparison found: one model on one recording, and all of them side by side, as numbers and as a table.

Errors are measured minus model, as in a diagnosis: positive is force that the model lacks. (Estimates of a flight are
judged the other way round, estimate minus truth.)
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.check import Check
from thrustd.diagnose.compare.failures import Failure
from thrustd.diagnose.compare.first_look import FirstLook
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.regions import RegionError
from thrustd.model.artifact import LedgerEntry
from thrustd.records.roles import Roles

ERROR = "measured minus model"
HALF, STRETCHES = 0.5, 10  # of the squared error, in one of so many stretches of time: it happened once
PAST = 1.1  # times: from rest it leaves so much more, which is said


@dataclass(frozen=True, slots=True)
class Comparison:
    """One model on one recording; arrays (n,) are kept for pictures."""

    model: str
    recording: str
    rmse_n: float
    rmse_from_rest_n: float  # the same, the model settled on the first sample
    rmse_in_flight_n: float  # from rest, as samples come in: a late reading can then only be extrapolated
    mae_n: float
    mae_pct_above_2kn: float | None
    bias_n: float  # mean of measured minus model
    fit_pct: float  # 100 (1 - |error| / |reference - its mean|)
    worst_n: float  # measured minus model
    worst_at_s: float
    autocorrelation: dict[str, float]  # of the residual, by lag ("1 s")
    rmse_in_noise: float | None  # RMSE over the load cell's noise, when that is known
    regions: tuple[RegionError, ...]
    where_it_fails: tuple[Failure, ...]
    ledger: tuple[LedgerEntry, ...]
    time_s: Floats
    reference_n: Floats
    model_n: Floats
    channels: dict[str, Floats]  # deformation and every complete column

    roles: Roles  # what the file calls input and output, and their units
    check: Check  # what it is worth as a check of the model

    @property
    def residual_n(self) -> Floats:
        return self.reference_n - self.model_n

    @property
    def nowhere(self) -> str:
        """Of an error that goes with no region: whether it is a constant, or happened once."""
        error = np.where(np.isfinite(self.residual_n), self.residual_n, 0.0)
        total, unit = float(error @ error), self.roles.output_unit
        if self.bias_n**2 > HALF * self.rmse_n**2:
            return f"everywhere alike: measured minus model is {newtons(self.bias_n, '+', unit=unit)} on average"
        once = [float(part @ part) for part in np.array_split(error, STRETCHES)]
        worst = int(np.argmax(once))
        if once[worst] > HALF * total:
            begin, end = self.time_s[[worst * len(error) // STRETCHES, (worst + 1) * len(error) // STRETCHES - 1]]
            return (
                f"once: {100 * once[worst] / total:.0f} % of the squared error between {begin:.1f} and {end:.1f} s;"
                " no region repeats it"
            )
        return "nowhere in particular: the error goes with no region beyond chance"

    def to_json(self) -> dict[str, Any]:
        """The numbers, without arrays."""
        return {
            "model": self.model,
            "recording": self.recording,
            "input": self.roles.input,
            "output": self.roles.output,
            "unit": self.roles.output_unit,
            "rmse_n": self.rmse_n,
            "rmse_from_rest_n": self.rmse_from_rest_n,
            "rmse_in_flight_n": self.rmse_in_flight_n,
            "mae_n": self.mae_n,
            "mae_pct_above_2kn": self.mae_pct_above_2kn,
            "bias_n": self.bias_n,
            "fit_pct": self.fit_pct,
            "worst": {"error_n": self.worst_n, "time_s": self.worst_at_s},
            "autocorrelation": self.autocorrelation,
            "rmse_in_noise": self.rmse_in_noise,
            "regions": [_region_json(region) for region in self.regions],
            "where_it_fails": [_failure_json(failure) for failure in self.where_it_fails],
            "nowhere": "" if self.where_it_fails else self.nowhere,
            "ledger": [msgspec.to_builtins(entry) for entry in self.ledger],
            "check": asdict(self.check),
        }


@dataclass(frozen=True, slots=True)
class CompareReport:
    """Every model on every recording."""

    comparisons: tuple[Comparison, ...]
    first_look: dict[str, FirstLook] = field(default_factory=dict)  # by recording
    records: tuple[str, ...] = ()  # how long each is, and at what rate
    remarks: tuple[str, ...] = ()  # channels taken at rest, checks that are none or contradict a model

    def to_json(self) -> dict[str, Any]:
        looks = [{"recording": name, **look._asdict()} for name, look in self.first_look.items()]
        found = [c.to_json() for c in self.comparisons]
        return {
            "error": ERROR,
            "comparisons": found,
            "first_look": looks,
            "records": list(self.records),
            "remarks": list(self.remarks),
        }

    def print(self, console: Console) -> None:
        """What the records cannot tell, table side by side, then where each model fails, then its error ledger."""
        for line in self.records:
            console.print(line, highlight=False)
        for line in (*(line for look in self.first_look.values() for line in look.lines), *self.remarks):
            console.print(line)
        console.print(_table(self.comparisons))
        for c in self.comparisons:
            console.print(f"\nWhere {c.model} fails on {c.recording}", style="bold")
            for i, failure in enumerate(c.where_it_fails, 1):
                console.print(f"  {i}. {failure.sentence}")
            if not c.where_it_fails:
                console.print(f"  {c.nowhere}")
            if c.rmse_from_rest_n > PAST * c.rmse_n:
                rested = newtons(c.rmse_from_rest_n, unit=c.roles.output_unit)
                console.print(
                    f"  begun at rest it leaves {rested}: the difference is laid to what the mount went through before"
                    " the recording, which an effect that lasts looks like too"
                )
            if c.rmse_in_flight_n != c.rmse_from_rest_n:
                console.print(
                    f"  its reading is not in time, and put back to its time here exactly: sample by sample, as in"
                    f" flight, RMSE {newtons(c.rmse_in_flight_n, unit=c.roles.output_unit)}",
                )
        for c in {c.model: c for c in self.comparisons if c.ledger}.values():
            console.print(f"\nError ledger of {c.model}", style="bold")
            for entry in c.ledger:
                after = newtons(entry.rmse_after_n, unit=c.roles.output_unit)
                fall = f"{newtons(entry.rmse_before_n)} -> {after}"
                console.print(f"  + {entry.added}: {fall}  {entry.data}")


def _region_json(region: RegionError) -> dict[str, Any]:
    return {
        "dimension": region.dimension,
        "region": region.label,
        "rmse_n": region.rmse_n,
        "bias_n": region.bias_n,
        "share_of_time": region.share_of_time,
        "share_of_squared_error": region.share_of_squared_error,
    }


def _failure_json(failure: Failure) -> dict[str, Any]:
    return {
        "sentence": failure.sentence,
        "regions": list(failure.labels),
        "share_of_squared_error": failure.share_of_squared_error,
        "share_of_time": failure.share_of_time,
        "share_explained": failure.explained,
        "rmse_n": failure.rmse_n,
        "bias_n": failure.bias_n,
    }


def _table(comparisons: Sequence[Comparison]) -> Table:
    table = Table(title="Free run against the reference, from the state that the first tenth of it shows")
    table.caption = f"bias and worst: {ERROR}"
    for heading in ("model", "recording"):
        table.add_column(heading)
    (unit, *others) = {c.roles.output_unit for c in comparisons}
    unit = f" {unit}" if unit and not others else ""
    told = any(c.mae_pct_above_2kn is not None for c in comparisons)
    above = ["above 2 kN %"] if told else []
    headings = [
        f"RMSE{unit}",
        f"mean abs{unit}",
        *above,
        f"bias{unit}",
        "fit %",
        f"worst{unit}",
        "at s",
        "autocorr. 1 s",
    ]
    for heading in headings:
        table.add_column(heading, justify="right")
    for c in comparisons:
        pct = "-" if c.mae_pct_above_2kn is None else f"{c.mae_pct_above_2kn:.2f}"
        row = [
            newtons(c.rmse_n),
            newtons(c.mae_n),
            *([pct] if told else []),
            newtons(c.bias_n, "+"),
            f"{c.fit_pct:.2f}",
            newtons(c.worst_n, "+", 0),
        ]
        table.add_row(c.model, c.recording, *row, f"{c.worst_at_s:.1f}", f"{c.autocorrelation.get('1 s', 0.0):.2f}")
    return table
