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
from typing import Final, NamedTuple

from thrustd.types import Fault
from thrustd.wire.framing import Deframer, encode_frame

VERSION = 1
MAX_CHANNELS = 8
CHANNEL_FAULT: Final = 0x7FFFFFFF  # counts of an open or shorted transducer
COUNTS_HIGH = 2**23 - 1  # 24-bit sample, sign-extended
COUNTS_LOW = -(2**23)
ARRIVAL_SLACK_US = 2_000_000  # how far a stalled reader may shift arrival against device time
RATE_FACTOR = 20  # an ADC faster than configured by more than this is a sequence that jumped
LATE_US = 1_000_000  # an old frame repeated is younger than this
_HEADER_BYTES = 8
_SEQUENCE_MASK = 0xFFFF
_TIME_MASK = 0xFFFFFFFF
_new: Final = tuple.__new__  # half the time of calling a NamedTuple
_LAYOUTS = {n: Struct(f"<BBHI{n}i") for n in range(1, MAX_CHANNELS + 1)}


class AdcSample(NamedTuple):
    """All channels of one sample instant, counters unwrapped."""

    t_ns: int  # arrival
    sequence: int
    device_time_us: int
    counts: tuple[int, ...]  # CHANNEL_FAULT where a channel has no value


def encode(sequence: int, device_time_us: int, counts: tuple[int, ...]) -> bytes:
    """One frame as the ADC sends it, delimiter included; both counters wrap as on the wire."""
    layout = _LAYOUTS[len(counts)]
    return encode_frame(
        layout.pack(VERSION, len(counts), sequence & _SEQUENCE_MASK, device_time_us & _TIME_MASK, *counts)
    )


def _misfit(payload: bytes) -> str:
    """Why a payload is not the frame we expect."""
    if payload[0] != VERSION:
        return "version"
    whole = len(payload) >= _HEADER_BYTES and len(payload) == _HEADER_BYTES + 4 * payload[1]
    return "channel_count" if whole else "length"


class AdcDecoder:
    """Serial chunks in, samples and faults out."""

    def __init__(self, n_channels: int, sample_hz: float, where: str = "adc") -> None:
        self._deframer = Deframer()
        self._n_channels = n_channels
        self._layout = _LAYOUTS[n_channels]
        self._period_us = 1e6 / sample_hz
        self._short_us, self._long_us = 0.5 * self._period_us, 2 * self._period_us  # of a normal step
        self._where = where
        self._started = False
        self._watchful = True  # the next step is not to be taken for granted
        self._t_ns = self._raw_sequence = self._raw_time_us = self._sequence = self._device_time_us = 0
        self._late_run = 0  # late frames in a row
        self._off_rate = False
        self._open_samples = [0] * n_channels  # samples without a value, per channel, since it failed
        self._any_open = False

    def feed(self, t_ns: int, data: bytes) -> list[AdcSample | Fault]:
        """What the chunk `data`, arrived at `t_ns`, completes. Never raises."""
        out: list[AdcSample | Fault] = []
        for item in self._deframer.feed(data):
            if isinstance(item, bytes):
                self._payload(t_ns, item, out)
            else:
                out.append(Fault(t_ns, self._where, item))
        return out

    def _payload(self, t_ns: int, payload: bytes, out: list[AdcSample | Fault]) -> None:
        if payload[0] != VERSION or len(payload) != self._layout.size or payload[1] != self._n_channels:
            out.append(Fault(t_ns, self._where, _misfit(payload)))
            return
        fields = self._layout.unpack(payload)
        raw_sequence, raw_time_us, counts = fields[2], fields[3], fields[4:]
        step = raw_sequence - self._raw_sequence & _SEQUENCE_MASK
        step_us = raw_time_us - self._raw_time_us & _TIME_MASK
        if step == 1 and self._short_us <= step_us < self._long_us and not self._watchful:
            self._sequence += 1
            self._device_time_us += step_us
        elif not self._step(t_ns, raw_sequence, raw_time_us, out):
            return
        self._t_ns, self._raw_sequence, self._raw_time_us = t_ns, raw_sequence, raw_time_us
        if max(counts) > COUNTS_HIGH or min(counts) < COUNTS_LOW or self._any_open:
            counts = self._mark_open_channels(t_ns, counts, out)
        out.append(_new(AdcSample, (t_ns, self._sequence, self._device_time_us, counts)))

    def _step(self, t_ns: int, raw_sequence: int, raw_time_us: int, out: list[AdcSample | Fault]) -> bool:
        """Advance the axis by anything but the plain normal step; False when the frame is to be dropped."""
        step = raw_sequence - self._raw_sequence & _SEQUENCE_MASK
        step_us = raw_time_us - self._raw_time_us & _TIME_MASK
        if not self._started:
            self._started, self._watchful = True, False
            self._sequence, self._device_time_us = raw_sequence, raw_time_us
        elif step == 1 and 0 < step_us < self._long_us:
            self._advance(t_ns, 1, step_us, out)
        elif not self._irregular(t_ns, step, step_us, out):
            self._watchful = True
            return False
        self._watchful, self._late_run = self._off_rate, 0
        return True

    def _irregular(self, t_ns: int, step: int, step_us: int, out: list[AdcSample | Fault]) -> bool:
        """Judge a step that is not the normal one; False when the frame is to be dropped."""
        if step == 0 and step_us == 0:
            out.append(Fault(t_ns, self._where, "duplicate"))
            return False
        elapsed_us = (t_ns - self._t_ns) // 1000
        if self._is_late(step, step_us):
            out.append(Fault(t_ns, self._where, "late"))
            return False
        whole_us = step_us + round((elapsed_us - step_us) / (_TIME_MASK + 1)) * (_TIME_MASK + 1)
        slack_us = ARRIVAL_SLACK_US + elapsed_us // 1000  # crystals agree to better than 0.1 %
        wraps = max(0, round((whole_us / self._period_us - step) / (_SEQUENCE_MASK + 1)))
        advance = step + wraps * (_SEQUENCE_MASK + 1)
        on_time = whole_us > 0 and abs(whole_us - elapsed_us) <= slack_us
        if on_time and 0 < advance * self._period_us <= RATE_FACTOR * whole_us:
            self._advance(t_ns, advance, whole_us, out)
        else:
            self._restart(t_ns, max(elapsed_us, 0), out)
        return True

    def _is_late(self, step: int, step_us: int) -> bool:
        back_us, back = _TIME_MASK + 1 - step_us, _SEQUENCE_MASK + 1 - step
        agree = abs(back_us - back * self._period_us) <= 0.5 * self._period_us * (back + 1)
        if not (0 < back_us <= LATE_US and back <= _SEQUENCE_MASK // 2 and agree):
            return False
        self._late_run += 1
        return self._late_run * self._period_us <= LATE_US  # longer than that it is a restart after all

    def _advance(self, t_ns: int, advance: int, step_us: int, out: list[AdcSample | Fault]) -> None:
        if advance > 1:
            out.append(Fault(t_ns, self._where, "lost", advance - 1))
        self._judge_rate(t_ns, advance, step_us, out)
        self._sequence += advance
        self._device_time_us += step_us

    def _restart(self, t_ns: int, elapsed_us: int, out: list[AdcSample | Fault]) -> None:
        out.append(Fault(t_ns, self._where, "adc_reset"))
        advance = max(1, round(elapsed_us / self._period_us))
        if advance > 1:
            out.append(Fault(t_ns, self._where, "lost", advance - 1))
        self._sequence += advance
        self._device_time_us += max(elapsed_us, round(self._period_us))

    def _judge_rate(self, t_ns: int, advance: int, step_us: int, out: list[AdcSample | Fault]) -> None:
        """Report a rate off by more than half a period per sample once, until it is right again."""
        off = abs(step_us / advance - self._period_us) > 0.5 * self._period_us
        if off and not self._off_rate:
            out.append(Fault(t_ns, self._where, "sample_rate"))
        self._off_rate = off

    def _mark_open_channels(self, t_ns: int, counts: tuple[int, ...], out: list[AdcSample | Fault]) -> tuple[int, ...]:
        """`counts` with CHANNEL_FAULT wherever they leave 24 bit; a fault when a channel fails and when it is back."""
        marked = list(counts)
        for channel, value in enumerate(counts):
            where = f"{self._where}[{channel}]"
            if not COUNTS_LOW <= value <= COUNTS_HIGH:
                if self._open_samples[channel] == 0:
                    out.append(Fault(t_ns, where, "channel_fault"))
                self._open_samples[channel] += 1
                marked[channel] = CHANNEL_FAULT
            elif self._open_samples[channel]:
                out.append(Fault(t_ns, where, "channel_recovered", self._open_samples[channel]))
                self._open_samples[channel] = 0
        self._any_open = any(self._open_samples)
        return tuple(marked)
