"""How samples become events: encoding, wire delay, a reader that jitters, frames in pieces.

Every stream turns the samples of one block into events stamped with their arrival, in order. Arrival = sample time +
time on the wire + an exponential delay of the reader; now and then the reader stalls for some milliseconds and a few
events arrive together.
"""

from typing import Final

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.types import Frame, Tick
from thrustd.twin.sensors import IntArray
from thrustd.wire.adc_frames import encode
from thrustd.wire.can_frames import CanEncoder

SERIAL_DELAY_S = 0.0004  # some 30 bytes at 921 600 baud, and the ADC's own filter
CAN_DELAY_S = 0.00015
READER_S = 0.00008  # mean of the exponential delay
STALL_ODDS = 0.0005
STALL_S = 0.006
SPLIT_ODDS = 0.02  # frames that arrive in two pieces
SPLIT_NS = 60_000
CRYSTAL = 1 + 20e-6  # the ADC's clock against ours
_new: Final = tuple.__new__  # half the time of calling a NamedTuple


class Arrivals:
    """Arrival times of one stream, never running backwards."""

    def __init__(self, delay_s: float, origin_ns: int, rng: np.random.Generator) -> None:
        self._delay_s = delay_s
        self._origin_ns = origin_ns
        self._rng = rng
        self._last_ns = -(2**62)

    def of(self, sample_s: Floats) -> list[int]:
        """Monotonic nanoseconds (n,) at which samples taken at `sample_s` (n,) are read."""
        late_s = self._rng.exponential(READER_S, len(sample_s))
        late_s += STALL_S * (self._rng.random(len(sample_s)) < STALL_ODDS)
        arrival_ns = self._origin_ns + np.rint((sample_s + self._delay_s + late_s) * 1e9).astype(np.int64)
        arrival_ns = np.maximum(np.maximum.accumulate(arrival_ns), self._last_ns)
        if len(arrival_ns):
            self._last_ns = int(arrival_ns[-1])
        times: list[int] = arrival_ns.tolist()
        return times


class AdcStream:
    """LVDT counts -> serial chunks on channel "adc"."""

    def __init__(self, origin_ns: int, rng: np.random.Generator) -> None:
        self._arrivals = Arrivals(SERIAL_DELAY_S, origin_ns, rng)
        self._rng = rng
        self._sequence = int(rng.integers(0, 2**16))
        self._device_us = int(rng.integers(0, 2**32))

    def block(self, sample_s: Floats, counts: IntArray) -> list[Frame]:
        """`counts` (n, n_channels) at `sample_s` (n,)."""
        device_us = (self._device_us + np.rint(sample_s * 1e6 * CRYSTAL).astype(np.int64)).tolist()
        split = (self._rng.random(len(sample_s)) < SPLIT_ODDS).tolist()
        arrivals = self._arrivals.of(sample_s)
        following = [*arrivals[1:], *arrivals[-1:]]
        out: list[Frame] = []
        for t_ns, next_ns, time_us, row, two in zip(
            arrivals, following, device_us, counts.tolist(), split, strict=True
        ):
            data = encode(self._sequence, time_us, tuple(row))
            self._sequence += 1
            if two:
                out.append(_new(Frame, (t_ns, "adc", 0, data[:11])))
                t_ns, data = min(t_ns + SPLIT_NS, next_ns), data[11:]  # bytes never overtake bytes
            out.append(_new(Frame, (t_ns, "adc", 0, data)))
        return out


class CanStream:
    """One catalogue signal -> messages on channel "can"."""

    def __init__(self, signal: str, index: int, encoder: CanEncoder, origin_ns: int, rng: np.random.Generator) -> None:
        self._signal = signal
        self._index = index
        self._encoder = encoder
        self._arrivals = Arrivals(CAN_DELAY_S, origin_ns, rng)

    def block(self, sample_s: Floats, values: Floats) -> list[Frame]:
        """`values` (n,) at `sample_s` (n,); NaN = nothing is sent."""
        arrivals, said = self._arrivals.of(sample_s), values.tolist()
        if np.isnan(values).any():
            sent = [(t_ns, value) for t_ns, value in zip(arrivals, said, strict=True) if value == value]
            arrivals, said = [t_ns for t_ns, _ in sent], [value for _, value in sent]
        ident, data = self._encoder.encode_all(self._signal, self._index, said)
        return [_new(Frame, (t_ns, "can", ident, each)) for t_ns, each in zip(arrivals, data, strict=True)]


class TickStream:
    """The step clock of the process that listens."""

    def __init__(self, origin_ns: int, rng: np.random.Generator) -> None:
        self._arrivals = Arrivals(0.0, origin_ns, rng)

    def block(self, sample_s: Floats) -> list[Tick]:
        return [_new(Tick, (t_ns,)) for t_ns in self._arrivals.of(sample_s)]
