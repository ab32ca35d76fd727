"""One stretch of data as the regression reads it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.first_state import Beginning, first_level
from thrustd.identify.regression.noise import Lasting
from thrustd.identify.regression.terms import Seen
from thrustd.identify.segments import DEFORMATION

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Record:
    """One stretch of data, with the past that suits it in front (`after`)."""

    d: Floats  # (n,) input
    y: Floats  # (n,) output in units of the shape's scale, NaN: not known
    dt_s: float
    before: float  # the input at which everything had settled before the first sample
    channels: Mapping[str, Floats] = field(default_factory=dict)  # (n,) each, what effects read
    place: int | None = None  # among the records of which a point knows how they begin
    kept: dict[Any, Any] | None = None  # where few samples count: columns that no pass changes, made once
    stood: int = 0  # samples in front of the data, without output
    lasting: Lasting | None = None  # of the noise of y; none: it is white
    step_share: float = 1.0  # of the noise of y, see `records.grid.Grid`

    def __len__(self) -> int:
        return len(self.d)

    @property
    def seen(self) -> Seen:
        return Seen(self.d, {**self.channels, DEFORMATION: self.d}, self.dt_s, self.before, self.kept)

    @property
    def known(self) -> Indices:
        """Samples whose output is known."""
        if self.kept is None:
            return np.flatnonzero(np.isfinite(self.y))
        if "known" not in self.kept:
            self.kept["known"] = np.flatnonzero(np.isfinite(self.y))
        found: Indices = self.kept["known"]
        return found

    @property
    def beginning(self) -> Beginning:
        return Beginning(self.before, self.stood)

    def after(self, beginning: Beginning) -> "Record":
        """The same data with another past."""
        if beginning.stood == self.stood:  # nothing else changes: no column is made again
            return replace(self, before=beginning.before)
        own = self.d[self.stood :]
        stood = np.full(beginning.stood, first_level(own, self.dt_s))
        unknown = np.full(beginning.stood, np.nan)

        def behind(column: Floats) -> Floats:
            return np.concatenate((np.full(beginning.stood, column[0]), column[self.stood :]))

        return replace(
            self,
            d=np.concatenate((stood, own)),
            y=np.concatenate((unknown, self.y[self.stood :])),
            before=beginning.before,
            channels={name: behind(column) for name, column in self.channels.items()},
            kept=None if self.kept is None else {},
            stood=beginning.stood,
        )


def head_of(record: Record, n: int) -> Record:
    """Its past and the first n samples of its data."""
    n += record.stood
    channels = {name: column[:n] for name, column in record.channels.items()}
    return replace(record, d=record.d[:n], y=record.y[:n], channels=channels, kept=None)
