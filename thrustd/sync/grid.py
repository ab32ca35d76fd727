"""The ADC's instants as the grid: where alignment stands, and the samples that wait for their models."""

from math import nan

import numpy as np

from thrustd.core.columns import MOUNT_STATE, Bytes, Floats, Integers
from thrustd.sync.align import TIME_FIRST, Decoded, Memory, align
from thrustd.sync.hold import Hold
from thrustd.sync.memory import CLOCK, GRID, MOUNT


class Grid:
    """Mutable; all arrays stay the same objects, so that others may keep views of them."""

    __slots__ = (
        "_clock",
        "_memory",
        "channels",
        "mounts",
        "own",
        "place",
        "state",
        "states",
        "unmeasured_s",
        "waiting_mm",
        "waiting_u",
    )

    def __init__(self, n_mounts: int, n_channels: int, samples_per_step: int, hold: Hold, listeners: Integers) -> None:
        """`n_channels`: of the model that reads most; `samples_per_step`: of the ADC, between two fused steps.

        `listeners` (n, 3): slot of `hold`, mount, channel of its model.
        """
        self.state, self.mounts, self.place = np.zeros(1, GRID), np.zeros(n_mounts, MOUNT), np.zeros(4, np.int64)
        self.state["t_ns"] = self.state["sequence"] = self.state["fused_ns"] = -1
        self.state["samples_per_step"] = samples_per_step
        self.states = np.zeros(n_mounts, MOUNT_STATE)  # what the models made of the samples
        self.mounts["watchful"], self.mounts["sequence"], self.mounts["deformation_mm"] = 1, -1, nan
        shape, most = (n_mounts, n_channels), max(2 * samples_per_step, 64)
        self.channels, self.unmeasured_s = np.zeros(shape), np.full(shape, nan)  # for how long not; NaN: it is measured
        self.own = np.zeros(shape, np.bool_)  # channels that are the mount's own deformation
        self.waiting_u, self.waiting_mm = np.zeros((n_mounts, most, n_channels)), np.zeros((n_mounts, most))
        self._clock = np.zeros(1, CLOCK)
        self._memory = Memory(
            self.place, self.state, self._clock, hold.held, hold.heard, listeners, self.mounts, self.channels,
            self.unmeasured_s, self.own, self.waiting_u, self.waiting_mm,
        )  # fmt: skip

    @property
    def clock_rate(self) -> float:
        """By which our clock runs faster than the ADC's crystal, s/s; 0 while two healthy ones differ as much."""
        return float(self._clock["found_rate"].item())

    def begin(self) -> None:
        """Before the first `align` over a batch."""
        self.place[:] = 0, 0, 0, TIME_FIRST

    def align(self, t_ns: Integers, kind: Bytes, readings: Integers, values: Floats, samples: Integers) -> int:
        """Go on through a batch; -> why it stopped. What was met is behind `place`, but for CATCH_UP and FULL."""
        return int(align(Decoded(t_ns, kind, readings, values, samples), self._memory))
