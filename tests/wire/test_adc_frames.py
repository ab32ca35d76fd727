"""ADC frames: round trip, wraps, gaps, repeats, restarts and bad channels."""

import struct
from collections.abc import Iterable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.one_by_one import AdcSample, adc_items
from thrustd.core.columns import CHANNEL_FAULT
from thrustd.core.types import Fault
from thrustd.wire.adc_frames import COUNTS_HIGH, COUNTS_LOW, AdcDecoder, encode
from thrustd.wire.framing import encode_frame

HZ = 1000
PERIOD_US = 1000
COUNTS = (1, -2, 300, -40000)


def frame(number: int, counts: tuple[int, ...] = COUNTS, start_us: int = 0) -> tuple[int, bytes]:
    """(arrival, bytes) of sample instant `number` of a perfect ADC."""
    device_us = start_us + number * PERIOD_US
    return device_us * 1000, encode(number, device_us, counts)


def decode(frames: Iterable[tuple[int, bytes]], n_channels: int = 4) -> list[AdcSample | Fault]:
    decoder = AdcDecoder(n_channels, HZ)
    return [item for t_ns, data in frames for item in adc_items(decoder, t_ns, data)]


def samples(items: list[AdcSample | Fault]) -> list[int]:
    return [item.sequence for item in items if isinstance(item, AdcSample)]


def faults(items: list[AdcSample | Fault]) -> list[tuple[str, str, int]]:
    found = [item for item in items if isinstance(item, Fault)]
    return [(item.where, item.kind + " over" * (not item.active), item.count) for item in found]


@given(
    st.integers(0, 65535),
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(COUNTS_LOW, COUNTS_HIGH), min_size=1, max_size=8).map(tuple),
)
def test_round_trip_whole_and_byte_by_byte(sequence: int, time_us: int, counts: tuple[int, ...]) -> None:
    data = encode(sequence, time_us, counts)
    expected = [AdcSample(7, sequence, time_us, counts)]
    assert adc_items(AdcDecoder(len(counts), HZ), 7, data) == expected
    decoder = AdcDecoder(len(counts), HZ)
    assert [item for byte in data for item in adc_items(decoder, 7, bytes([byte]))] == expected


def test_the_wire_layout_is_the_one_of_the_icd() -> None:
    payload = struct.pack("<BBHIi", 1, 1, 0x1234, 0x89ABCDEF, -5)
    assert encode(0x1234, 0x89ABCDEF, (-5,)) == encode_frame(payload)


def test_both_counters_unwrap() -> None:
    start_us = 2**32 - 70_000 * PERIOD_US
    numbers = range(65_530, 70_005)
    items = decode(frame(n, start_us=start_us) for n in numbers)
    assert faults(items) == []
    assert samples(items) == list(numbers)
    times = [item.device_time_us for item in items if isinstance(item, AdcSample)]
    assert times[-1] == start_us + 70_004 * PERIOD_US > 2**32


@pytest.mark.parametrize("gap", [2, 50, 65_535, 65_536, 65_537, 300_000, 6_000_000])
def test_a_gap_is_counted_exactly_even_over_wraps_of_both_counters(gap: int) -> None:
    items = decode(frame(n) for n in (0, 1, 1 + gap, 2 + gap))
    assert faults(items) == [("adc", "lost", gap - 1)]
    assert samples(items) == [0, 1, 1 + gap, 2 + gap]


def test_duplicates_and_old_frames_are_dropped_by_name() -> None:
    items = decode([frame(0), frame(1), frame(1), frame(2), frame(3), frame(1), frame(2), frame(4)])
    assert faults(items) == [("adc", kind, 1) for kind in ("late", "late", "late")]
    assert samples(items) == [0, 1, 2, 3, 4]


def test_a_restart_continues_the_time_axis() -> None:
    before = [frame(n, start_us=5_000_000) for n in range(30_000, 30_010)]
    last_ns = before[-1][0]
    after = [(last_ns + 3_000_000_000 + n * 1_000_000, encode(n, n * PERIOD_US, COUNTS)) for n in range(5)]
    items = decode([*before, *after])
    assert faults(items) == [("adc", "reset", 1), ("adc", "lost", 2999)]
    assert samples(items) == [*range(30_000, 30_010), *range(33_009, 33_014)]


def test_a_restart_right_after_the_start_heals_within_a_second() -> None:
    first = [frame(n) for n in range(500)]
    again = [(first[-1][0] + (n + 1) * 1_000_000, encode(n, n * PERIOD_US, COUNTS)) for n in range(1500)]
    items = decode([*first, *again])
    assert {kind for _, kind, _ in faults(items)} <= {"late", "lost", "reset"}
    assert len(samples(items)) >= 1000


def test_arrival_in_bursts_does_not_look_like_a_gap() -> None:
    items = decode((n // 500 * 500_000_000, frame(n)[1]) for n in range(3000))
    assert faults(items) == []
    assert samples(items) == list(range(3000))


def test_a_wrong_rate_is_said_once_and_samples_go_on() -> None:
    items = decode((n * 10_000_000, encode(n, n * 10 * PERIOD_US, COUNTS)) for n in range(50))
    assert faults(items) == [("adc", "rate", 1)]
    assert samples(items) == list(range(50))


def test_a_rate_that_is_right_again_is_said_too() -> None:
    wrong_us = [n * 10 * PERIOD_US for n in range(50)]
    times_us = [*wrong_us, *(wrong_us[-1] + n * PERIOD_US for n in range(1, 50))]
    items = decode((us * 1000, encode(n, us, COUNTS)) for n, us in enumerate(times_us))
    assert faults(items) == [("adc", "rate", 1), ("adc", "rate over", 1)]


def test_a_failing_channel_is_named_when_it_fails_and_when_it_is_back() -> None:
    bad = (1, CHANNEL_FAULT, 3, COUNTS_HIGH + 1)
    items = decode([frame(0), frame(1, bad), frame(2, bad), frame(3)])
    assert faults(items) == [
        ("adc[1]", "open", 1), ("adc[3]", "open", 1),
        ("adc[1]", "open over", 2), ("adc[3]", "open over", 2),
    ]  # fmt: skip
    counts = [item.counts for item in items if isinstance(item, AdcSample)]
    assert counts == [COUNTS, (1, CHANNEL_FAULT, 3, CHANNEL_FAULT), (1, CHANNEL_FAULT, 3, CHANNEL_FAULT), COUNTS]


@pytest.mark.parametrize(
    ("payload", "kind"),
    [
        (struct.pack("<BBHI4i", 2, 4, 0, 0, 1, 2, 3, 4), "foreign"),
        (struct.pack("<BBHI4i", 1, 3, 0, 0, 1, 2, 3, 4), "damaged"),
        (struct.pack("<BBHI3i", 1, 3, 0, 0, 1, 2, 3), "foreign"),
        (b"\x01", "damaged"),
        (b"\x01\x00\x00\x00\x00\x00\x00\x00", "foreign"),
    ],
)
def test_frames_that_do_not_fit_have_a_name(payload: bytes, kind: str) -> None:
    assert faults(decode([(0, encode_frame(payload))])) == [("adc", kind, 1)]


@given(st.lists(st.tuples(st.integers(0, 10**13), st.binary(max_size=80)), max_size=30))
def test_noise_never_raises(chunks: list[tuple[int, bytes]]) -> None:
    decode(chunks)


@given(st.lists(st.tuples(st.integers(0, 2**41), st.integers(0, 65535), st.integers(0, 2**32 - 1)), max_size=30))
def test_whatever_the_counters_do_the_axis_never_runs_backwards(steps: list[tuple[int, int, int]]) -> None:
    items = decode((t_ns, encode(sequence, time_us, COUNTS)) for t_ns, sequence, time_us in steps)
    taken = [item for item in items if isinstance(item, AdcSample)]
    for this, following in pairwise(taken):
        assert following.sequence > this.sequence
        assert following.device_time_us > this.device_time_us


@given(st.lists(st.sampled_from(["keep", "lose", "double", "damage"]), min_size=1, max_size=60))
def test_every_frame_sent_is_decoded_or_counted(fates: list[str]) -> None:
    stream: list[tuple[int, bytes]] = [frame(0)]
    for number, fate in enumerate(fates, start=1):
        t_ns, data = frame(number)
        if fate == "damage":
            stream.append((t_ns, bytes([data[0], data[1] ^ 0xFF or 1]) + data[2:]))
        else:
            stream += [(t_ns, data)] * {"keep": 1, "lose": 0, "double": 2}[fate]
    stream.append(frame(len(fates) + 1))
    items = decode(stream)
    lost = sum(count for _, kind, count in faults(items) if kind == "lost")
    assert samples(items)[-1] == len(fates) + 1
    assert len(samples(items)) + lost == len(fates) + 2
    assert sum(kind == "late" for _, kind, _ in faults(items)) == fates.count("double")
