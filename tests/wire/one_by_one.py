"""Decoders asked for one thing at a time: what tests look at, and what the everyday columns of a batch hide."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import COUNTS, DEVICE_US, GOOD, KIND, SEQUENCE, SLOT
from thrustd.core.types import Event, Fault, Frame, Reading
from thrustd.wire.adc_frames import AdcDecoder
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.event_batch import EventBatch, Messages
from thrustd.wire.framing import Deframer

NONE_OUT = np.zeros(1, np.bool_)


class AdcSample(NamedTuple):
    """All channels of one sample instant, counters unwrapped."""

    t_ns: int  # arrival
    sequence: int
    device_time_us: int
    counts: tuple[int, ...]  # CHANNEL_FAULT where a channel has no value


def deframed(deframer: Deframer, data: bytes) -> list[bytes | None]:
    """What `data` completes, in order: the payload of a good frame, None of a damaged one."""
    pieces = deframer.cut(np.frombuffer(bytearray(data), np.uint8), np.array([len(data)]), NONE_OUT)
    return [
        payload[:length].tobytes() if length >= 0 else None
        for length, payload in zip(pieces.length.tolist(), pieces.payload, strict=True)
    ]


def adc_items(decoder: AdcDecoder, t_ns: int, data: bytes) -> list[AdcSample | Fault]:
    """What the chunk `data`, arrived at `t_ns`, completes."""
    one = np.array([t_ns], np.int64), np.frombuffer(bytearray(data), np.uint8), np.array([len(data)], np.int64)
    return [
        AdcSample(t_ns, row.item(SEQUENCE), row.item(DEVICE_US), tuple(row[COUNTS:].tolist()))
        if row[KIND] == GOOD
        else decoder.fault(t_ns, row)
        for row in decoder.decode(*one, NONE_OUT)
    ]


def can_items(decoder: CanDecoder, frame: Frame) -> list[Reading | Fault]:
    """What one message says."""
    t_ns, _, ident, data = frame
    one = np.array([[t_ns], [ident], [len(data)]], np.int64)
    rows, values = decoder.decode(one[0], one[1], np.frombuffer(bytearray(data), np.uint8), one[2], NONE_OUT)
    found: list[Reading | Fault] = []
    for row, value in zip(rows, values.tolist(), strict=True):
        if row[KIND] == GOOD:
            signal, index = decoder.slots[row.item(SLOT)]
            found.append(Reading(t_ns, signal, index, value))
        else:
            found.append(decoder.fault(t_ns, row))
    return found


def decode_batch(payload: bytes) -> tuple[int, Sequence[Event]]:
    """Number of the first event, and the events of one message."""
    messages = Messages([payload])
    return messages.first_numbers[0], messages.batch.events()


def encode_batch(first_number: int, events: Sequence[Event]) -> bytes:
    """`events` as one message."""
    return EventBatch.of(events).encode(first_number)
