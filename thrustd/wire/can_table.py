"""Which CAN identifier carries which catalogue signal: a DBC file plus a table of rows, compiled at start-up.

The DBC gives identifiers, byte layout and units; a row names which of its signals is which channel of the catalogue:

    CanRow(dbc="Engine1_N1", signal="n1_pct", index=0)

Messages whose DBC entry has the four signals of `HEADER` are CANaerospace and get their header judged; others are
plain. Reading takes any layout; writing makes one `struct` of a byte-aligned layout and leaves others to cantools.

    catalogue value = raw * scale + offset          (the DBC's own factor and the change of unit in one step)
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from struct import Struct
from typing import Annotated, Any, NamedTuple

import cantools
import msgspec
from msgspec import Meta

from thrustd.core.errors import ConfigError
from thrustd.core.signals import CATALOGUE, STANDARD_GRAVITY_M_S2

HEADER = ("NodeId", "DataType", "ServiceCode", "MessageCode")  # CANaerospace 1.7, the first four bytes
UNSIGNED, SIGNED, FLOAT = range(3)
EXTENDED_BIT = 1 << 31  # set in `ident` for 29-bit identifiers
MAX_DBC_BYTES = 4_000_000
KELVIN_AT_0_DEGC = 273.15
POUND_KG = 0.45359237
FOOT_M = 0.3048
Rpm = Annotated[float, Meta(ge=100, le=1e6)]
Density = Annotated[float, Meta(ge=0.1, le=2.0)]


class CanRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One DBC signal and the catalogue channel it is."""

    dbc: str  # name of the signal in the DBC file
    signal: str  # channel of the catalogue
    index: int = 0  # engine 0.. or mount 0..; 0 for aircraft signals


class CanUnits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the conversion of units needs to know about the engine and its fuel."""

    n1_100_pct_rpm: Rpm = 15904.0  # JT15D-4
    n2_100_pct_rpm: Rpm = 32760.0  # JT15D-4
    fuel_density_kg_l: Density = 0.804  # typical Jet A-1 at 15 degC; ASTM D1655 allows 0.775 to 0.840


class Bits(NamedTuple):
    """Where a raw value is in a message, as a DBC numbers bits, and what it is."""

    start: int  # least significant bit, little-endian; most significant bit, big-endian
    length: int
    little_endian: bool
    kind: int  # UNSIGNED, SIGNED or FLOAT


@dataclass(frozen=True, slots=True)
class CanField:
    """One catalogue signal inside a message."""

    bits: Bits
    scale: float
    offset: float
    signal: str
    index: int


@dataclass(frozen=True, slots=True)
class CanMessage:
    """One identifier, ready for the hot path."""

    ident: int
    name: str
    n_bytes: int
    pack: Callable[..., bytes]  # of the header's values and those of the fields
    header: tuple[Bits, ...]  # of HEADER; empty when the message has none
    data_types: frozenset[int]  # legal CANaerospace data types; empty = any
    fields: tuple[CanField, ...]


@dataclass(frozen=True, slots=True)
class CanTable:
    """Every message somebody needs, by identifier."""

    messages: dict[int, CanMessage]

    @classmethod
    def from_dbc(cls, text: str, rows: Iterable[CanRow], units: CanUnits, where: str = "DBC") -> "CanTable":
        """Compile `rows` against the DBC in `text`; `where` names the file in error messages."""
        if len(text) > MAX_DBC_BYTES:
            raise ConfigError(f"{where}: {len(text)} bytes, expected a DBC file of at most {MAX_DBC_BYTES}")
        try:
            database: Any = cantools.database.load_string(text, "dbc")
        except (cantools.Error, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
            raise ConfigError(f"{where}: not a readable DBC file: {_one_line(error)}") from None
        owners = {signal.name: message for message in database.messages for signal in message.signals}
        wanted: dict[str, list[CanRow]] = {}
        for row in rows:
            _check_row(row, owners, where)
            wanted.setdefault(owners[row.dbc].name, []).append(row)
        compiled = (_compile(database.get_message_by_name(name), group, units, where) for name, group in wanted.items())
        return cls({message.ident: message for message in compiled})


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _check_row(row: CanRow, owners: dict[str, Any], where: str) -> None:
    if row.signal not in CATALOGUE:
        raise ConfigError(f"{where}: signal {row.dbc!r}: {row.signal!r} is not a channel of the catalogue")
    if row.dbc not in owners:
        raise ConfigError(f"{where}: signal {row.dbc!r} is missing, expected for {row.signal}[{row.index}]")
    if row.index < 0 or (row.index and CATALOGUE[row.signal].scope == "aircraft"):
        raise ConfigError(f"{where}: signal {row.dbc!r}: index {row.index} does not exist for {row.signal}")


def _compile(message: Any, group: list[CanRow], units: CanUnits, where: str) -> CanMessage:
    if message.is_multiplexed():
        raise ConfigError(f"{where}: message {message.name!r} is multiplexed, expected a plain layout")
    by_name = {signal.name: signal for signal in message.signals}
    rows = sorted(group, key=lambda row: by_name[row.dbc].start // 8)
    has_header = all(name in by_name for name in HEADER)
    names = [*(HEADER if has_header else ()), *(row.dbc for row in rows)]
    signals = [by_name[name] for name in names]
    return CanMessage(
        ident=message.frame_id | (EXTENDED_BIT if message.is_extended_frame else 0),
        name=message.name,
        n_bytes=message.length,
        pack=_packer(message, signals),
        header=tuple(_bits(by_name[name]) for name in HEADER) if has_header else (),
        data_types=frozenset(by_name["DataType"].choices or ()) if has_header else frozenset(),
        fields=tuple(_field(by_name[row.dbc], row, units, f"{where}: signal {row.dbc!r}") for row in rows),
    )


def _bits(signal: Any) -> Bits:
    kind = FLOAT if signal.is_float else SIGNED if signal.is_signed else UNSIGNED
    return Bits(signal.start, signal.length, signal.byte_order == "little_endian", kind)


def _field(signal: Any, row: CanRow, units: CanUnits, where: str) -> CanField:
    wanted_unit = CATALOGUE[row.signal].unit
    conversion = _conversions(row.signal, units).get((signal.unit or "-", wanted_unit))
    if conversion is None:
        raise ConfigError(f"{where}: unit {signal.unit!r} cannot become {wanted_unit!r} of {row.signal}")
    factor, shift = conversion
    scale = signal.scale * factor
    if scale == 0 or not isfinite(scale) or not isfinite(signal.offset):
        raise ConfigError(
            f"{where}: factor {signal.scale} and offset {signal.offset}, expected finite and a factor not 0"
        )
    return CanField(_bits(signal), scale, signal.offset * factor + shift, row.signal, row.index)


def _conversions(signal: str, units: CanUnits) -> dict[tuple[str, str], tuple[float, float]]:
    """(unit in the DBC, unit in the catalogue) -> factor, shift."""
    own = CATALOGUE[signal].unit
    full_rpm = units.n2_100_pct_rpm if signal == "n2_pct" else units.n1_100_pct_rpm
    fuel = units.fuel_density_kg_l / 3600
    table: dict[tuple[str, str], tuple[float, float]] = {
        ("K", "degC"): (1.0, -KELVIN_AT_0_DEGC),
        ("degF", "degC"): (5 / 9, -160 / 9),
        ("°C", "degC"): (1.0, 0.0),
        ("1/min", "%"): (100 / full_rpm, 0.0),
        ("rpm", "%"): (100 / full_rpm, 0.0),
        ("l/h", "kg/s"): (fuel, 0.0),
        ("kg/h", "kg/s"): (1 / 3600, 0.0),
        ("lb/h", "kg/s"): (POUND_KG / 3600, 0.0),
        ("ft", "m"): (FOOT_M, 0.0),
        ("m/s^2", "g"): (1 / STANDARD_GRAVITY_M_S2, 0.0),
        ("m/s2", "g"): (1 / STANDARD_GRAVITY_M_S2, 0.0),
        ("kN", "N"): (1000.0, 0.0),
        ("hPa", "Pa"): (100.0, 0.0),
        ("kPa", "Pa"): (1000.0, 0.0),
    }
    table[own, own] = (1.0, 0.0)
    return table


def _packer(message: Any, signals: list[Any]) -> Callable[..., bytes]:
    """Raw values of `signals` into the message's bytes; other signals are written as 0."""
    layout = _byte_layout(message.length, signals)
    if layout is not None:
        return layout.pack
    names = [signal.name for signal in signals]
    zeros = {signal.name: 0 for signal in message.signals}

    def pack(*values: float) -> bytes:
        raw = zeros | dict(zip(names, values, strict=True))
        return bytes(message.encode(raw, scaling=False, strict=False))

    return pack


_INTEGER_CODES = {8: "B", 16: "H", 32: "I", 64: "Q"}
_FLOAT_CODES = {16: "e", 32: "f", 64: "d"}


def _byte_layout(n_bytes: int, signals: list[Any]) -> Struct | None:
    """One struct for the whole message, or None when it is not byte-aligned, ordered and of one byte order."""
    orders = {signal.byte_order for signal in signals if signal.length > 8}
    if len(orders) > 1:
        return None
    text, at = "<" if orders == {"little_endian"} else ">", 0
    for signal in signals:
        first_bit = 0 if signal.byte_order == "little_endian" else 7
        code = (_FLOAT_CODES if signal.is_float else _INTEGER_CODES).get(signal.length)
        start = signal.start // 8
        if code is None or signal.start % 8 != first_bit or start < at:
            return None
        text += f"{start - at}x" + (code.lower() if signal.is_signed or signal.is_float else code)
        at = start + signal.length // 8
    return Struct(text + f"{n_bytes - at}x")
