"""ADC frames, version 1 (ICD section 1): payload <-> sample, and the bookkeeping of sequence and device time.

    payload = u8 version | u8 n channels | u16 sequence | u32 device time [us] | n x i32 counts       little-endian

`AdcDecoder` unwraps both counters onto one axis that never runs backwards: after a wrap, a gap or a restart of the
ADC, `sequence` still counts sample instants and `device_time_us` still counts microseconds, so a reader needs only
`this.sequence - last.sequence - 1` to know how many samples are missing.

Rules, with d = sequence step modulo 2^16 and D = device time step modulo 2^32:

    normal      d = 1 and 0 < D < 2 sample periods
    duplicate   d = 0 and D = 0
    late        D is negative by less than the last second and so is d: an old frame once more; dropped
    gap         D agrees with the time that passed on arrival: lost = d - 1 plus the whole wraps of 2^16 in D
    restart     anything else: the counters jump; the gap is taken from the time that passed on arrival
"""

from struct import Struct
from typing import Any, Final

import numba
import numpy as np

from thrustd.core.columns import (
    CHANNEL_FAULT,
    COUNT,
    COUNTS,
    DEVICE_US,
    EVENT,
    GOOD,
    KIND,
    PLACE,
    SEQUENCE,
    Bytes,
    Flags,
    Integers,
)  # fmt: skip
from thrustd.core.jit import compiled
from thrustd.core.types import Fault
from thrustd.wire.framing import Deframer, encode_frame

VERSION = 1
MAX_CHANNELS = 8
COUNTS_HIGH = 2**23 - 1  # 24-bit sample, sign-extended
COUNTS_LOW = -(2**23)
ARRIVAL_SLACK_US = 2_000_000  # how far a stalled reader may shift arrival against device time
RATE_FACTOR = 20  # an ADC faster than configured by more than this is a sequence that jumped
LATE_US = 1_000_000  # an old frame repeated is younger than this
_HEADER_BYTES = 8
_SEQUENCE_WRAP, _TIME_WRAP = 1 << 16, 1 << 32
_LAYOUTS = {n: Struct(f"<BBHI{n}i") for n in range(1, MAX_CHANNELS + 1)}

# what a fault's row says, by its kind: `kind` and `active` of the Fault
KINDS: Final = (
    ("damaged", True), ("foreign", True), ("lost", True), ("late", True), ("reset", True),
    ("rate", True), ("rate", False), ("open", True), ("open", False),
)  # fmt: skip
_DAMAGED, _FOREIGN, _LOST, _LATE, _RESET, _RATE, _RATE_OVER, _OPEN, _OPEN_OVER = range(1, 10)  # 1 + place in KINDS
_MOST_PER_PIECE = 4 + MAX_CHANNELS  # a sample, two faults of its counters, one of each channel
_STATE = np.dtype(
    [
        ("started", np.int64),
        ("watchful", np.int64),  # the next step is not to be taken for granted
        ("t_ns", np.int64),
        ("raw_sequence", np.int64),
        ("raw_time_us", np.int64),
        ("sequence", np.int64),
        ("device_time_us", np.int64),
        ("late_run", np.int64),  # late frames in a row
        ("off_rate", np.int64),
        ("period_us", np.float64),
        ("found", np.int64),  # rows
    ]
)


def encode(sequence: int, device_time_us: int, counts: tuple[int, ...]) -> bytes:
    """One frame as the ADC sends it, delimiter included; both counters wrap as on the wire."""
    layout = _LAYOUTS[len(counts)]
    return encode_frame(
        layout.pack(VERSION, len(counts), sequence % _SEQUENCE_WRAP, device_time_us % _TIME_WRAP, *counts)
    )


class AdcDecoder:
    """Serial chunks in, samples and faults out."""

    def __init__(self, n_channels: int, sample_hz: float, where: str = "adc") -> None:
        self._deframer = Deframer()
        self._where = where
        self._state = np.zeros(1, _STATE)
        self._state["watchful"], self._state["period_us"] = 1, 1e6 / sample_hz
        self._open_samples = np.zeros(n_channels, np.int64)  # without a value, per channel, since it failed
        self._found = np.empty((0, COUNTS + n_channels), np.int64)

    def decode(self, t_ns: Integers, data: Bytes, ends: Integers, left_out: Flags) -> Integers:
        """What chunks complete that arrived at t_ns; chunk i ends before data[ends[i]]. Never raises.

        -> (n, COUNTS + n_channels) rows in the order of the bytes, good until the next call.
        """
        pieces = self._deframer.cut(data, ends, left_out)
        n = len(pieces.chunk)
        if n * _MOST_PER_PIECE > len(self._found):
            self._found = np.empty((n * _MOST_PER_PIECE, self._found.shape[1]), np.int64)
        return self._found[: _decode(*pieces, t_ns, self._state, self._open_samples, self._found)]

    def fault(self, t_ns: int, row: Integers) -> Fault:
        """A row of `decode` that is no sample."""
        channel = row.item(PLACE)
        where = self._where if channel < 0 else f"{self._where}[{channel}]"
        return Fault(t_ns, where, *KINDS[row.item(KIND) - 1], row.item(COUNT))


@compiled
def _tell(s: Any, found: Integers, chunk: int, kind: int, channel: int, count: int) -> None:
    row = found[s.found]
    row[EVENT], row[KIND], row[PLACE], row[COUNT] = chunk, kind, channel, count
    s.found += 1


@compiled
def _unsigned(payload: Bytes, at: int, n: int) -> Any:
    value = np.int64(0)
    for i in range(n):
        value |= np.int64(payload[at + i]) << 8 * i
    return value


@compiled
def _misfit(payload: Bytes, length: int) -> int:
    """Why a payload is not the frame we expect."""
    whole = length >= _HEADER_BYTES and length == _HEADER_BYTES + 4 * payload[1]
    return _FOREIGN if payload[0] != VERSION or whole else _DAMAGED


@compiled
def _judge_rate(s: Any, found: Integers, chunk: int, advance: int, step_us: int) -> None:
    """Report a rate off by more than half a period per sample once, and when it is right again."""
    off = abs(step_us / advance - s.period_us) > 0.5 * s.period_us
    if off != (s.off_rate != 0):
        _tell(s, found, chunk, _RATE if off else _RATE_OVER, -1, 1)
    s.off_rate = off


@compiled
def _advance(s: Any, found: Integers, chunk: int, advance: int, step_us: int) -> None:
    if advance > 1:
        _tell(s, found, chunk, _LOST, -1, advance - 1)
    _judge_rate(s, found, chunk, advance, step_us)
    s.sequence += advance
    s.device_time_us += step_us


@compiled
def _restart(s: Any, found: Integers, chunk: int, elapsed_us: int) -> None:
    _tell(s, found, chunk, _RESET, -1, 1)
    advance = max(1, round(elapsed_us / s.period_us))
    if advance > 1:
        _tell(s, found, chunk, _LOST, -1, advance - 1)
    s.sequence += advance
    s.device_time_us += max(elapsed_us, round(s.period_us))


@compiled
def _is_late(s: Any, step: int, step_us: int) -> bool:
    back_us, back = _TIME_WRAP - step_us, _SEQUENCE_WRAP - step
    agree = abs(back_us - back * s.period_us) <= 0.5 * s.period_us * (back + 1)
    if not (0 < back_us <= LATE_US and back < _SEQUENCE_WRAP // 2 and agree):
        return False
    s.late_run += 1
    return s.late_run * s.period_us <= LATE_US  # longer than that it is a restart after all


@compiled
def _irregular(s: Any, found: Integers, chunk: int, t_ns: int, step: int, step_us: int) -> bool:
    """Judge a step that is not the normal one; False when the frame is to be dropped."""
    if step == 0 and step_us == 0:
        _tell(s, found, chunk, _LATE, -1, 1)
        return False
    elapsed_us = (t_ns - s.t_ns) // 1000
    if _is_late(s, step, step_us):
        _tell(s, found, chunk, _LATE, -1, 1)
        return False
    whole_us = step_us + round((elapsed_us - step_us) / _TIME_WRAP) * _TIME_WRAP
    slack_us = ARRIVAL_SLACK_US + elapsed_us // 1000  # crystals agree to better than 0.1 %
    wraps = max(0, round((whole_us / s.period_us - step) / _SEQUENCE_WRAP))
    advance = step + wraps * _SEQUENCE_WRAP
    on_time = whole_us > 0 and abs(whole_us - elapsed_us) <= slack_us
    if on_time and 0 < advance * s.period_us <= RATE_FACTOR * whole_us:
        _advance(s, found, chunk, advance, whole_us)
    else:
        _restart(s, found, chunk, max(elapsed_us, 0))
    return True


@compiled
def _step(s: Any, found: Integers, chunk: int, t_ns: int, raw_sequence: int, raw_time_us: int) -> bool:
    """Advance the axis; False when the frame is to be dropped."""
    step = (raw_sequence - s.raw_sequence) % _SEQUENCE_WRAP
    step_us = (raw_time_us - s.raw_time_us) % _TIME_WRAP
    if not s.started:
        s.started, s.watchful = 1, 0
        s.sequence, s.device_time_us = raw_sequence, raw_time_us
    elif step == 1 and not s.watchful and 0.5 * s.period_us <= step_us < 2 * s.period_us:
        s.sequence += 1
        s.device_time_us += step_us
        return True
    elif step == 1 and 0 < step_us < 2 * s.period_us:
        _advance(s, found, chunk, 1, step_us)
    elif not _irregular(s, found, chunk, t_ns, step, step_us):
        s.watchful = 1
        return False
    s.watchful, s.late_run = s.off_rate, 0
    return True


@compiled
def _take_counts(s: Any, found: Integers, chunk: int, payload: Bytes, open_samples: Integers) -> None:
    """The sample behind the faults of its channels; CHANNEL_FAULT wherever counts leave 24 bit."""
    n, sample = len(open_samples), found[s.found + len(open_samples)]  # as many faults come before it at most
    for channel in range(n):
        at = _HEADER_BYTES + 4 * channel
        counts: Any = np.int64(np.int32(_unsigned(payload, at, 4)))
        if not COUNTS_LOW <= counts <= COUNTS_HIGH:
            if open_samples[channel] == 0:
                _tell(s, found, chunk, _OPEN, channel, 1)
            open_samples[channel] += 1
            counts = CHANNEL_FAULT
        elif open_samples[channel]:
            _tell(s, found, chunk, _OPEN_OVER, channel, open_samples[channel])
            open_samples[channel] = 0
        sample[COUNTS + channel] = counts
    row = found[s.found]
    row[COUNTS:] = sample[COUNTS:]
    row[EVENT], row[KIND], row[SEQUENCE], row[DEVICE_US] = chunk, GOOD, s.sequence, s.device_time_us
    s.found += 1


def _decode_pieces(
    chunks: Integers, lengths: Integers, payloads: Bytes, t_ns: Integers, state: Any, open_samples: Integers,
    found: Integers,
) -> int:  # fmt: skip
    s = state[0]
    s.found = 0
    expected = _HEADER_BYTES + 4 * len(open_samples)
    for i in range(len(chunks)):
        chunk, length, payload = chunks[i], lengths[i], payloads[i]
        if length < 0:
            _tell(s, found, chunk, _DAMAGED, -1, 1)
        elif payload[0] != VERSION or length != expected or payload[1] != len(open_samples):
            _tell(s, found, chunk, _misfit(payload, length), -1, 1)
        else:
            raw_sequence, raw_time_us = _unsigned(payload, 2, 2), _unsigned(payload, 4, 4)
            if _step(s, found, chunk, t_ns[chunk], raw_sequence, raw_time_us):
                s.t_ns, s.raw_sequence, s.raw_time_us = t_ns[chunk], raw_sequence, raw_time_us
                _take_counts(s, found, chunk, payload, open_samples)
    return s.found


_ROW, _TABLE = numba.int64[::1], numba.int64[:, ::1]
_decode: Any = compiled(
    _decode_pieces,
    numba.int64(_ROW, _ROW, numba.uint8[:, ::1], _ROW, numba.from_dtype(_STATE)[::1], _ROW, _TABLE),
)
