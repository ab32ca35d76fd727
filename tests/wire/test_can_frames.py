"""CAN: cantools is the oracle for the bytes; counters, senders and headers are judged by name."""

import math
import struct
from pathlib import Path

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.one_by_one import can_items
from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Frame, Reading
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS, ICD_OPTIONAL_ROWS, ICD_OUTPUT_ROWS, CanEncoder
from thrustd.wire.can_table import FLOAT, Bits, CanField, CanMessage, CanRow, CanTable, CanUnits

DBC_TEXT = (Path(__file__).parents[2] / "deploy" / "canaerospace.dbc").read_text()
ORACLE = cantools.database.load_string(DBC_TEXT, "dbc")
HEARD = (*ICD_INPUT_ROWS, *ICD_OPTIONAL_ROWS)
INPUTS = CanTable.from_dbc(DBC_TEXT, HEARD, CanUnits(), "canaerospace.dbc")
OUTPUTS = CanTable.from_dbc(DBC_TEXT, ICD_OUTPUT_ROWS, CanUnits(), "canaerospace.dbc")
float32 = st.floats(width=32, allow_nan=False, allow_infinity=False)


def message(code: int, value: float = 8000.0, t_ns: int = 0, ident: int = 500, **header: int) -> Frame:
    head = {"node": 1, "data_type": 2, "service": 0} | header
    return Frame(t_ns, "can", ident, struct.pack(">BBBBf", *head.values(), code & 255, value))


def kinds(items: list[Reading | Fault]) -> list[str]:
    return [item.kind if isinstance(item, Fault) else item.signal for item in items]


def feed(*frames: Frame) -> list[str]:
    decoder = CanDecoder(INPUTS)
    return kinds([item for frame in frames for item in can_items(decoder, frame)])


def test_the_table_covers_the_identifiers_of_the_icd() -> None:
    heard = {300, 301, 302, 303, 304, 305, 311, 318, 322, 323, 324, 500, 501, 504, 505, 524, 525}
    assert set(INPUTS.messages) == heard | {1860} | set(range(1800, 1808)) | set(range(1820, 1828))
    assert set(OUTPUTS.messages) == {1850, 1851, 1852, 1853, 1854, 1855}


@given(st.sampled_from(sorted(INPUTS.messages)), float32, st.integers(0, 255))
def test_decoding_agrees_with_cantools(ident: int, raw: float, code: int) -> None:
    described = ORACLE.get_message_by_frame_id(ident)
    name = described.signals[-1].name
    values = {"NodeId": 9, "DataType": 2, "ServiceCode": 0, "MessageCode": code, name: raw}
    data = described.encode(values, strict=False)
    field = INPUTS.messages[ident].fields[0]
    expected = described.decode(data)[name] * field.scale + field.offset
    assert can_items(CanDecoder(INPUTS), Frame(5, "can", ident, data)) == [
        Reading(5, field.signal, field.index, expected)
    ]


@given(st.sampled_from((1850, 1851, 1852, 1853)), float32)
def test_encoding_agrees_with_cantools(ident: int, value: float) -> None:
    field = OUTPUTS.messages[ident].fields[0]
    sent_ident, data = CanEncoder(OUTPUTS, node_id=42).encode(field.signal, field.index, value)
    described = ORACLE.get_message_by_frame_id(ident)
    decoded = described.decode(data, decode_choices=False)
    assert sent_ident == ident
    assert decoded == {
        "NodeId": 42, "DataType": 2, "ServiceCode": 0, "MessageCode": 0, described.signals[-1].name: value,
    }  # fmt: skip


@given(st.sampled_from((0, 1)), st.integers(0, 2**32 - 1))
def test_a_status_is_a_bit_string(engine: int, bits: int) -> None:
    ident, data = CanEncoder(OUTPUTS, node_id=42).encode("thrust_status", engine, bits)
    decoded = ORACLE.get_message_by_frame_id(ident).decode(data, decode_choices=False)
    assert ident == 1854 + engine
    assert (decoded["DataType"], decoded[f"Engine{engine + 1}_ThrustStatus"]) == (5, bits)


def test_many_values_are_said_as_one_after_the_other() -> None:
    signals = [("n1_pct", 0, [20.0, 21.0, 22.5]), ("mark", 0, [1.0, 2.0]), ("n1_pct", 0, [30.0] * 300), ("mach", 0, [])]
    one, all_ = CanEncoder(INPUTS, node_id=7), CanEncoder(INPUTS, node_id=7)
    for signal, index, values in signals:
        ident, data = all_.encode_all(signal, index, values)
        assert [(ident, each) for each in data] == [one.encode(signal, index, value) for value in values]


@pytest.mark.parametrize("row", HEARD, ids=lambda row: row.dbc)
def test_every_row_comes_back_through_the_wire(row: CanRow) -> None:
    encoder, decoder = CanEncoder(INPUTS, node_id=1), CanDecoder(INPUTS)
    for value in (0.25, 0.5):
        [reading] = can_items(decoder, Frame(1, "can", *encoder.encode(row.signal, row.index, value)))
        assert reading[:3] == (1, row.signal, row.index)
        assert reading[3] == pytest.approx(value, abs=2e-5)


@pytest.mark.parametrize(
    ("ident", "raw", "signal", "value"),
    [
        (500, 15904.0, "n1_pct", 100.0), (505, 32760.0, "n2_pct", 100.0), (324, 273.15, "sat_degC", 0.0),
        (524, 447.7611940, "fuel_flow_kg_s", 0.1), (302, 1.0, "accel_z_g", 1.0),
        (322, 5000.0, "pressure_altitude_m", 5000.0),
    ],
)  # fmt: skip
def test_units_become_those_of_the_catalogue(ident: int, raw: float, signal: str, value: float) -> None:
    [reading] = can_items(CanDecoder(INPUTS), message(0, raw, ident=ident))
    assert isinstance(reading, Reading)
    assert reading.signal == signal
    assert reading.value == pytest.approx(value, rel=1e-6, abs=1e-4)


def test_losses_are_counted_over_the_wrap_of_the_message_code() -> None:
    decoder = CanDecoder(INPUTS)
    items = [item for code in (254, 255, 256, 260, 261) for item in can_items(decoder, message(code))]
    assert [item for item in items if isinstance(item, Fault)] == [Fault(0, "can[Engine1_N1]", "lost", count=3)]
    assert kinds(items).count("n1_pct") == 5


def test_repeats_are_dropped_and_a_stuck_counter_is_named() -> None:
    assert feed(message(1), message(1), message(2)) == ["n1_pct", "late", "n1_pct"]
    assert feed(message(1, 8000), message(1, 8001)) == ["n1_pct", "contested", "n1_pct"]


def test_identifiers_count_separately() -> None:
    assert feed(message(7), message(3, ident=501), message(8), message(4, ident=501)) == ["n1_pct"] * 4


def test_a_second_sender_is_not_trusted_while_the_first_lives() -> None:
    second = message(0, node=2)
    assert feed(message(0), second, message(1)) == ["n1_pct", "contested", "n1_pct"]
    assert feed(message(0), second._replace(t_ns=2_000_000_000)) == ["n1_pct", "n1_pct"]


def test_headers_lengths_and_values_that_do_not_fit_are_named() -> None:
    assert feed(message(0, data_type=3)) == ["foreign"]
    assert feed(message(0, service=1)) == ["foreign"]
    assert feed(message(0)._replace(data=b"\1\2\0\0\0\0\0")) == ["foreign"]
    assert feed(message(0, math.nan), message(1, math.inf), message(2)) == ["out_of_range"] * 2 + ["n1_pct"]
    assert feed(message(0, ident=777)) == []


@given(st.lists(st.builds(Frame, st.integers(0, 2**60), st.just("can"), st.integers(0, 2047), st.binary(max_size=8))))
def test_noise_never_raises(frames: list[Frame]) -> None:
    feed(*frames)


PRIVATE_BUS = """VERSION ""
BU_: A
BO_ 256 Packed: 8 A
 SG_ AltPacked : 4|20@1+ (0.5,-1000) [0|0] "ft" A
 SG_ MachPacked : 24|12@1+ (0.001,0) [0|0] "" A
BO_ 2566834709 Aligned: 6 A
 SG_ Fuel : 16|16@1+ (0.1,0) [0|0] "kg/h" A
 SG_ Temp : 0|16@1- (0.01,0) [0|0] "degC" A
"""
PRIVATE_ROWS = (
    CanRow("AltPacked", "pressure_altitude_m"), CanRow("MachPacked", "mach"),
    CanRow("Fuel", "fuel_flow_kg_s", 1), CanRow("Temp", "sat_degC"),
)  # fmt: skip


@given(st.sampled_from((16, 32, 64)), st.booleans(), st.data())
def test_floats_of_every_length_are_those_of_the_struct_module(length: int, little: bool, data: st.DataObject) -> None:
    value = data.draw(st.floats(width=length))
    raw = struct.pack(("<" if little else ">") + {16: "e", 32: "f", 64: "d"}[length], value)
    bits = Bits(8 if little else 15, length, little, FLOAT)
    field = CanField(bits, 1.0, 0.0, "thrust_N", 0)
    table = CanTable({1: CanMessage(1, "F", 1 + len(raw), bytes, (), frozenset(), (field,))})
    [item] = can_items(CanDecoder(table), Frame(0, "can", 1, b"\xff" + raw))
    assert item == (
        Reading(0, "thrust_N", 0, value) if math.isfinite(value) else Fault(0, "thrust_N[0]", "out_of_range")
    )


def test_another_bus_is_another_file() -> None:
    """Bit-packed, little-endian, integers with factors, 29-bit identifiers, several signals per message."""
    table = CanTable.from_dbc(PRIVATE_BUS, PRIVATE_ROWS, CanUnits())
    oracle, decoder = cantools.database.load_string(PRIVATE_BUS, "dbc"), CanDecoder(table)
    packed = oracle.encode_message("Packed", {"AltPacked": 30000.0, "MachPacked": 0.62}, strict=False)
    aligned = oracle.encode_message("Aligned", {"Fuel": 360.0, "Temp": -50.0}, strict=False)
    readings = {
        (item.signal, item.index): item.value
        for ident, data in ((256, packed), (2566834709, aligned))
        for item in can_items(decoder, Frame(0, "can", ident, data))
        if isinstance(item, Reading)
    }
    assert readings == pytest.approx(
        {("pressure_altitude_m", 0): 9144.0, ("mach", 0): 0.62, ("fuel_flow_kg_s", 1): 0.1, ("sat_degC", 0): -50.0}
    )
    encoder = CanEncoder(table, node_id=0)
    encoder.encode("mach", 0, 0.62)
    ident, data = encoder.encode("pressure_altitude_m", 0, 9144.0)
    assert (ident, oracle.decode_message(256, data)["MachPacked"]) == (256, pytest.approx(0.62))


@pytest.mark.parametrize(
    ("text", "rows", "words"),
    [
        (DBC_TEXT, [CanRow("Engine3_N1", "n1_pct")], ["fleet.dbc", "Engine3_N1", "missing"]),
        (DBC_TEXT, [CanRow("Engine1_N1", "n9_pct")], ["fleet.dbc", "n9_pct", "catalogue"]),
        (DBC_TEXT, [CanRow("MachNumber", "mach", 1)], ["fleet.dbc", "MachNumber", "index 1"]),
        (DBC_TEXT, [CanRow("MachNumber", "n1_pct")], ["fleet.dbc", "MachNumber", "'-'", "'%'"]),
        ("no dbc at all", [CanRow("MachNumber", "mach")], ["fleet.dbc", "not a readable DBC"]),
        ("", [CanRow("MachNumber", "mach")], ["fleet.dbc", "not a readable DBC"]),
    ],
)
def test_a_table_that_cannot_be_is_refused_in_one_line(text: str, rows: list[CanRow], words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        CanTable.from_dbc(text, rows, CanUnits(), "fleet.dbc")
    line = str(caught.value)
    assert "\n" not in line
    assert all(word in line for word in words), line
