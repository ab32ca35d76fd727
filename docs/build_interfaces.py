"""Writes docs/interfaces.md from the tables in the code: wires, signals, faults, status bits, log topics, settings."""

import inspect
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import cantools
import msgspec

from thrustd.core.config import Config
from thrustd.core.faults import FAULT_KINDS, UNTIL_OVER
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Status
from thrustd.fusion.settings import FusionSettings
from thrustd.records import flight_log
from thrustd.records.recording import SUFFIX_UNITS
from thrustd.wire import log_layout
from thrustd.wire.adc_frames import VERSION
from thrustd.wire.can_frames import ICD_INPUT_ROWS, ICD_OPTIONAL_ROWS, ICD_OUTPUT_ROWS
from thrustd.wire.can_table import CanRow, CanUnits

DBC = Path(__file__).parents[1] / "deploy" / "canaerospace.dbc"
HEARD = (*ICD_INPUT_ROWS, *ICD_OPTIONAL_ROWS)

HEAD = """# Interfaces

Made by `python docs/build_interfaces.py` from the tables in the code; do not edit by hand.
What thrustd hears on its wires, what its channels, faults and status bits mean, and every key of its configuration.
"""

SERIAL = f"""UART 8N1. One frame per sample instant, numbers little-endian:

    frame   = COBS(payload + crc) + 0x00
    payload = u8 version ({VERSION}) | u8 n channels (1 to 8) | u16 sequence | u32 device time [us] | n x i32 counts
    crc     = CRC-16/XMODEM of payload (poly 0x1021, init 0x0000, no reflection, no final xor), u16

- `sequence` counts frames and wraps after 65535: a jump is lost frames, a repeat a duplicate.
- `device time` is the ADC's own crystal and wraps after 2^32 us.
- `counts` is a 24-bit sample, sign-extended; 0x7FFFFFFF marks a channel that is open or shorted.
- deformation_mm = counts * `scale_mm` + `offset_mm` of the mount; positive = loaded by forward thrust.
"""

CAN = """CANaerospace 1.7, 11-bit identifiers, 8 data bytes, big-endian:

    node id | data type | service code | message code | 4 bytes data

Data type 2 is FLOAT (IEEE 754 single), service code 0; `message code` counts up by one per message of an identifier and
wraps after 255. Identifiers, layout and units on the bus are those of `can.dbc`. `can.input` says which of its signals
is which channel; without it this table over `deploy/canaerospace.dbc` holds. The deck needs `n1_pct` of every engine,
`mach`, `pressure_altitude_m` and `sat_degC`; a mount model needs the channels that `thrustd compile` prints.

"""

SENT = """
Sent with `[can_out]`:

"""

COLUMNS = """Bench records, flights and converted files use the names of the channels above: header of a CSV, column of
Parquet, field of MCAP, variable of npz and mat. On a bench record they stand alone: `time_s`, `deformation_mm`,
`force_N`. In a recording of an aircraft the owner's name in the configuration follows: an engine's (`n1_pct_left`,
`fuel_flow_kg_s_right`) or a mount's (`deformation_mm_left_upper`, `temperature_degC_right_lower`); channels of the
aircraft have no owner (`mach`, `accel_z_g`). Instead of seconds `time_s` of a CSV may hold ISO 8601 dates or times of
day, that of Parquet timestamps or durations: they are read as seconds since the first.
"""

OWN_COLUMNS = "Other columns are kept, as candidates for the diagnosis; their unit is read from an ending: "

RAW = {"fusion": FusionSettings, "can.units": CanUnits, "can.input": CanRow}  # converted by the part that owns them
WITHOUT = {  # optional tables: what their absence means
    "steps": "every key has its default",
    "fusion": "every key has its default",
    "log": "nothing is recorded",
    "live_view": "no live view",
    "can_out": "nothing is sent on the bus",
    "health": "no health page, and `thrustd status` has nobody to ask",
    "warm_restart": "every start is cold",
    "realtime": "ordinary priority, memory not locked",
    "can.units": "every key has its default",
    "can.input": "the table under CAN bus above",
}
OWNERS = {
    "aircraft": "aircraft",
    "engine": "engines, in the order of `aircraft.engines`",
    "mount": "mounts, in the order of `[[mount]]`",
}
TYPES = {str: "text", int: "whole number", float: "number", bool: "true or false"}


def table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def bus(rows: tuple[CanRow, ...]) -> str:
    """Identifiers of `rows` in the shipped DBC, those of one channel in one line."""
    database = cantools.database.can.Database()
    database.add_dbc_string(DBC.read_text())
    found = {
        signal.name: (message.frame_id, signal.unit) for message in database.messages for signal in message.signals
    }
    lines: dict[str, list[CanRow]] = defaultdict(list)
    for row in rows:
        lines[row.signal].append(row)
    return table(
        ("identifier", "DBC signal", "unit on the bus", "channel", "of"),
        [bus_line(found, line) for line in lines.values()],
    )


def bus_line(found: dict[str, tuple[int, str | None]], line: list[CanRow]) -> tuple[str, ...]:
    idents, names = [found[row.dbc][0] for row in line], [f"`{row.dbc}`" for row in line]
    ends = slice(None, None, max(len(line) - 1, 1))
    channel = line[0].signal
    which = " to ".join(map(str, idents[ends]))
    return (
        which,
        " to ".join(names[ends]),
        found[line[0].dbc][1] or "-",
        f"`{channel}`",
        OWNERS[CATALOGUE[channel].scope],
    )


def signals() -> str:
    rows = [
        (f"`{s.name}`", s.unit, s.scope, s.meaning, f"{s.low:g} to {s.high:g}", f"{s.stale_after_s:g}")
        for s in CATALOGUE.values()
    ]
    return table(("channel", "unit", "one per", "meaning and sign", "plausible", "stale after, s"), rows)


def columns() -> str:
    units = ", ".join(f"`_{ending}`" for ending in SUFFIX_UNITS)
    flight = "Of a flight log:\n\n```\n" + (inspect.getdoc(flight_log) or "") + "\n```\n"
    return f"{COLUMNS}{OWN_COLUMNS}{units}.\n\n{flight}"


def faults() -> str:
    rows: list[tuple[str, ...]] = []
    for word, kind in FAULT_KINDS.items():
        bits = ", ".join(f"`{flag.name}`" for flag in kind.status)
        shows = "until it is over" if kind.shows_s == UNTIL_OVER else f"{kind.shows_s:g} s"
        rows.append((f"`{word}`", kind.meaning, bits, shows))
    return table(("kind", "meaning", "status bit", "shows for"), rows)


def remarks(kind: type, sign: str) -> dict[str, str]:
    """The comment beside each `name` `sign` of a class."""
    lines = [line.strip().partition("#") for line in inspect.getsource(kind).splitlines()]
    return {code.partition(sign)[0].strip(): said.strip() for code, _, said in lines if sign in code}


def status_bits() -> str:
    said = remarks(Status, " =")
    return table(
        ("bit", "value", "meaning"), [(f"`{bit.name}`", str(int(bit)), said[bit.name or ""]) for bit in Status]
    )


def plain(hint: Any) -> Any:
    """A type without its limits and without None."""
    if hasattr(hint, "__metadata__"):
        return plain(get_args(hint)[0])
    if isinstance(hint, UnionType):
        return plain(next(kind for kind in get_args(hint) if kind is not type(None)))
    return hint


def type_words(hint: Any) -> str:
    """A key's type and limits in words."""
    limits = [meta for meta in getattr(hint, "__metadata__", ()) if isinstance(meta, msgspec.Meta)]
    words = [
        f"{name} {value:.9g}"
        for meta in limits
        for name, value in (("at least", meta.ge), ("above", meta.gt), ("at most", meta.le))
        if value is not None
    ]
    kind = plain(hint)
    listed = get_origin(kind) in (list, tuple)
    what = "of them" if listed else "characters"
    words += [f"{meta.min_length} to {meta.max_length} {what}" for meta in limits if meta.max_length is not None]
    words += [f"`{meta.pattern}`" for meta in limits if meta.pattern is not None]
    return ", ".join([f"list of {type_words(get_args(kind)[0])}" if listed else TYPES[kind], *words])


def default_words(field: msgspec.structs.FieldInfo) -> str:
    return "required" if field.required else f"`{msgspec.json.encode(field.default).decode()}`"


def inner(hint: Any, path: str) -> tuple[type, str] | None:
    """The struct and the heading of a key that is a table or a list of tables; None for a plain value."""
    if path in RAW:
        listed = get_origin(hint) is list
        return RAW[path], f"[[{path}]]" if listed else f"[{path}]"
    kind = plain(hint)
    listed = get_origin(kind) is list
    kind = plain(get_args(kind)[0]) if listed else kind
    if not (isinstance(kind, type) and issubclass(kind, msgspec.Struct)):
        return None
    return kind, f"[[{path}]]" if listed else f"[{path}]"


def tables_of(kind: type, heading: str, path: str, absent: str) -> list[str]:
    """A table of the configuration as a section of the page, and those inside it."""
    hints, said = get_type_hints(kind, include_extras=True), remarks(kind, ": ")
    own: list[tuple[str, ...]] = []
    others: list[str] = []
    for field in msgspec.structs.fields(kind):
        key = f"{path}{field.name}"
        within = inner(hints[field.name], key)
        if within is None:
            own.append((f"`{key}`", type_words(hints[field.name]), default_words(field), said.get(field.name, "")))
        else:
            without = "Required." if field.required else f"Optional; without it {WITHOUT[key]}."
            others += tables_of(*within, f"{key}.", without)
    words = f"{absent} {kind.__dict__.get('__doc__') or ''}".strip()
    return [f"### {heading}\n\n{words}\n\n" + table(("key", "type", "default", "meaning"), own), *others]


def configuration() -> str:
    first = "TOML. File names are relative to the configuration file; unknown keys are errors. An installed example is"
    head, *rest = tables_of(Config, "Outside any table", "", f"{first} `deploy/ph-lab.toml`.")
    return "\n".join([head, *rest])


def topics() -> str:
    text = inspect.getdoc(log_layout) or ""
    return "```\n" + text + "\n```\n"


def page() -> str:
    parts = (
        ("Serial ADC", SERIAL), ("CAN bus", CAN + bus(HEARD) + SENT + bus(ICD_OUTPUT_ROWS)),
        ("Channels", signals()), ("Columns of recordings", columns()), ("Faults", faults()),
        ("Status bits of an estimate", status_bits()), ("The flight log", topics()),
        ("Configuration keys", configuration()),
    )  # fmt: skip
    return HEAD + "".join(f"\n## {title}\n\n{text}" for title, text in parts)


if __name__ == "__main__":
    Path(__file__).with_name("interfaces.md").write_text(page())
