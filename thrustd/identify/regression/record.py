"""One stretch of data as the regression reads it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.terms import Seen
from thrustd.identify.segments import DEFORMATION

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Record:
    """One stretch of data; `before`: the input at which everything had settled when it begins."""

    d: Floats  # (n,) input
    y: Floats  # (n,) output in units of the shape's scale, NaN: not known
    dt_s: float
    before: float
    channels: Mapping[str, Floats] = field(default_factory=dict)  # (n,) each, what effects read
    place: int | None = None  # among the records of which a point knows how they begin
    kept: dict[Any, Any] | None = None  # where few samples count: columns that no pass changes, made once

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


def head_of(record: Record, n: int, before: float) -> Record:
    """Its first n samples, begun at another input."""
    channels = {name: column[:n] for name, column in record.channels.items()}
    return replace(record, d=record.d[:n], y=record.y[:n], before=before, channels=channels, kept=None)
