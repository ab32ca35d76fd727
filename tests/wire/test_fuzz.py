"""Ten million serial bytes and a million CAN messages, random and mutated: no crash, no growth, nothing made up."""

import random
import resource
import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.wire.one_by_one import AdcSample, adc_items, can_items
from thrustd.core.errors import ConfigError
from thrustd.core.faults import FAULT_KINDS
from thrustd.core.types import Fault, Frame, Reading
from thrustd.wire.adc_frames import AdcDecoder, encode
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS
from thrustd.wire.can_table import CanTable, CanUnits

DBC_TEXT = (Path(__file__).parents[2] / "deploy" / "canaerospace.dbc").read_text()
GROWTH_LIMIT_KB = 50_000


def resident_kb() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() // 1024


def test_five_million_random_bytes_give_no_sample() -> None:
    dice, decoder, kinds, before_kb = np.random.default_rng(1), AdcDecoder(4, 1000), Counter[str](), resident_kb()
    for step in range(5000):
        for item in adc_items(decoder, step * 1_000_000, dice.bytes(1000)):
            assert isinstance(item, Fault)
            kinds[item.kind] += 1
    assert set(kinds) <= set(FAULT_KINDS)
    assert set(kinds) >= {"damaged"}
    assert resident_kb() - before_kb < GROWTH_LIMIT_KB


def mutated_stream(n_frames: int, dice: random.Random) -> Iterator[tuple[int, bytes]]:
    """(arrival, bytes): flips, cuts, insertions, repeats, losses, one frame in ten."""
    for number in range(n_frames):
        data = encode(number, number * 1000, (number & 0xFFFF, -number & 0xFFFF, 0, 7))
        fate = dice.random()
        if fate < 0.02:
            at = dice.randrange(len(data))
            yield number * 1_000_000, data[:at] + bytes([data[at] ^ 1 << dice.randrange(8)]) + data[at + 1 :]
        elif fate < 0.04:
            yield number * 1_000_000, data[: dice.randrange(len(data))]
        elif fate < 0.06:
            yield number * 1_000_000, dice.randbytes(dice.randrange(80)) + data
        elif fate < 0.08:
            yield number * 1_000_000, data + data
        elif fate >= 0.1:
            yield number * 1_000_000, data


def test_five_million_mutated_bytes_never_give_a_wrong_sample() -> None:
    n_frames = 190_000
    decoder, before_kb, good, sent_bytes, last = AdcDecoder(4, 1000), resident_kb(), 0, 0, -1
    for t_ns, data in mutated_stream(n_frames, random.Random(2)):
        sent_bytes += len(data)
        for item in adc_items(decoder, t_ns, data):
            if isinstance(item, AdcSample):
                number = item.sequence
                assert item.counts == (number & 0xFFFF, -number & 0xFFFF, 0, 7)
                assert item.device_time_us == number * 1000
                assert number > last
                last, good = number, good + 1
            else:
                assert item.kind in FAULT_KINDS
    assert sent_bytes > 4_500_000
    assert good > 0.9 * n_frames
    assert resident_kb() - before_kb < GROWTH_LIMIT_KB


def test_a_million_can_messages_random_and_mutated() -> None:
    table = CanTable.from_dbc(DBC_TEXT, ICD_INPUT_ROWS, CanUnits())
    decoder, dice, kinds, before_kb = CanDecoder(table), random.Random(3), Counter[str](), resident_kb()
    idents = [*table.messages, 0, 1850, 2047]
    noise, lengths = dice.randbytes(1 << 16), [8] * 12 + [0, 4, 7, 64]
    for step in range(1_000_000):
        choice = noise[step & 0xFFFF]
        if choice < 200:
            data = struct.pack(">BBBBf", 1, 2, 0, step // len(idents) & 255, step * 0.01)
        else:
            at = step * 7 & 0xFF00
            data = noise[at : at + lengths[choice & 15]]
        for item in can_items(decoder, Frame(step * 300_000, "can", idents[step % len(idents)], data)):
            kinds[item.kind if isinstance(item, Fault) else "reading"] += 1
            if isinstance(item, Reading):
                assert item.value - item.value == 0
    assert set(kinds) <= {*FAULT_KINDS, "reading"}
    assert kinds["reading"] > 500_000
    assert resident_kb() - before_kb < GROWTH_LIMIT_KB


def test_a_damaged_dbc_is_refused_in_one_line_or_still_a_table() -> None:
    dice, refused = random.Random(4), 0
    for _ in range(40):
        text = list(DBC_TEXT)
        for _ in range(dice.randrange(1, 6)):
            text[dice.randrange(len(text))] = dice.choice('0159x |@+-"():;\n')
        try:
            CanTable.from_dbc("".join(text), ICD_INPUT_ROWS, CanUnits(), "fuzz.dbc")
        except ConfigError as error:
            assert str(error).startswith("fuzz.dbc: ")
            assert "\n" not in str(error)
            refused += 1
    assert refused > 10
