"""The configuration: TOML text -> frozen Config. Unknown keys and impossible values are errors; no file access here.

Every part receives its own section. Sections whose meaning belongs to a part on a higher floor (`fusion`, `can.units`,
`can.input`) are kept as plain tables and converted by that part with `section`.
"""

import re
import tomllib
from collections.abc import Sequence
from copy import deepcopy
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta, inspect

from thrustd.core.errors import ConfigError

MAX_BYTES = 1_000_000
MOST_PARTS = 8  # of a dotted key: tomllib keeps every beginning of it, memory with the square of their number
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{MOST_PARTS}}}")
ESTIMATE_SLACK = 0.01  # 33.3 Hz is written for a third of 100

_OF_MONTH = r"(0[13578]|1[02])-(0[1-9]|[12]\d|3[01])|(0[469]|11)-(0[1-9]|[12]\d|30)|02-(0[1-9]|1\d|2[0-8])"
_LEAP = r"[12]\d(0[48]|[2468][048]|[13579][26])-02-29"
_DAY = rf"^([12]\d{{3}}-({_OF_MONTH})|{_LEAP})$"
Day = Annotated[str, Meta(pattern=_DAY)]  # ISO 8601, of a calendar
Name = Annotated[str, Meta(pattern="^[a-z][a-z0-9_]{0,31}$")]
Positive = Annotated[float, Meta(gt=0, le=1e9)]
Scale = Annotated[float, Meta(ge=-0.01, le=0.01)]  # mm per count: 2^24 counts are an LVDT's few mm
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Port = Annotated[int, Meta(ge=1, le=65535)]
T = TypeVar("T")


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Base of every table of the configuration."""


class Aircraft(Section, frozen=True):
    name: Annotated[str, Meta(pattern=r"^[^\x00-\x1f\x7f-\x9f]{1,64}$")]  # of this aircraft, as in its logs' names
    engines: Annotated[list[Name], Meta(min_length=1, max_length=4)]  # names; their order is that of CAN and deck
    data: str | None = None  # masses, spring rates, limits of the type; none: the shipped citation-ii.toml


class Mount(Section, frozen=True):
    """One mount with an LVDT; deformation_mm = counts * scale_mm + offset_mm, loaded by forward thrust +."""

    name: Name  # follows the names of its channels in recordings
    engine: Name  # one of aircraft.engines
    adc_channel: Annotated[int, Meta(ge=0, le=7)]  # place in the frame of the serial ADC
    model: str  # artifact, relative to the configuration file
    scale_mm: Scale  # mm per count; negative turns the sign
    offset_mm: Annotated[float, Meta(ge=-100, le=100)] = 0.0  # deformation at count 0


class Adc(Section, frozen=True):
    """The serial ADC."""

    port: Annotated[str, Meta(min_length=1)]  # device path or any pyserial URL
    sample_hz: Annotated[float, Meta(ge=10, le=10_000)]  # frames per second; another rate is a fault
    channels: Annotated[int, Meta(ge=1, le=8)]  # counts per frame
    baud: Count = 921_600  # bits per second


class Can(Section, frozen=True):
    """The CAN bus: a DBC file plus, for another aircraft, a table of its own."""

    interface: str  # of python-can: socketcan, udp_multicast, ...; fifo: named pipes on this machine
    channel: str  # of that interface, e.g. can0
    dbc: str  # relative to the configuration file
    bitrate: Count = 1_000_000  # bits per second; where python-can sets the bus up
    input: list[dict[str, Any]] = []  # rows {dbc, signal, index}; empty = the ICD's table
    units: dict[str, float] = {}


class CanOut(Section, frozen=True):
    """Estimates sent on the bus (ids 1850 to 1853)."""

    node_id: Annotated[int, Meta(ge=0, le=255)]  # CANaerospace node id of thrustd
    rate_hz: Annotated[float, Meta(gt=0, le=100)] = 10.0  # messages of each engine per second


class Steps(Section, frozen=True):
    """How often what happens."""

    estimate_hz: Annotated[float, Meta(ge=1, le=100)] = 50.0  # fused steps per second
    reading_hz: Annotated[float, Meta(gt=0, le=100)] = 10.0  # decoded channels in the log
    tick_hz: Annotated[float, Meta(ge=1, le=100)] = 20.0  # keeps estimates coming when the ADC is silent
    bridge_gap_ms: Annotated[float, Meta(ge=0, le=2000)] = 500.0  # longer gaps re-initialise the linear block


class Log(Section, frozen=True):
    """The recorder; files rotate and never overwrite."""

    folder: str  # relative to the configuration file
    rotate_mb: Positive = 500.0  # a new file after this size
    rotate_min: Positive = 60.0  # a new file after this time
    keep_free_mb: Annotated[float, Meta(ge=0, le=1e9)] = 0.0  # delete the oldest logs when less is free; 0 = never


class Health(Section, frozen=True):
    """Prometheus page on loopback, read by `thrustd status`."""

    port: Port = 9105  # on 127.0.0.1


class WarmRestart(Section, frozen=True):
    """The state goes to `file` every second; a restart takes it over when it is not older than `max_age_s`."""

    file: str  # relative to the configuration file
    max_age_s: Annotated[float, Meta(gt=0, le=60)] = 10.0  # an older checkpoint is not taken over


class Realtime(Section, frozen=True):
    """Asked of the kernel after READY's preparations; refused = flown without, with a word."""

    fifo_priority: Annotated[int, Meta(ge=0, le=99)] = 0  # SCHED_FIFO; 0 = ordinary
    lock_memory: bool = False  # mlockall: no page of the process goes to swap


class LiveView(Section, frozen=True):
    """WebSocket server for Foxglove."""

    host: Annotated[str, Meta(pattern=r"^[^\x00-\x1f\x7f-\x9f]{1,253}$")] = "127.0.0.1"  # address to listen on
    port: Port = 8765  # of the WebSocket
    origins: tuple[str, ...] = ("https://app.foxglove.dev",)  # pages that may read along; what is no page always may


class Config(Section, frozen=True):
    aircraft: Aircraft
    mount: Annotated[list[Mount], Meta(min_length=1, max_length=8)]
    adc: Adc
    can: Can
    deck: str  # brochure deck, relative to the configuration file
    calibration: str | None = None  # of the mounts in this aircraft, relative to the configuration file
    steps: Steps = Steps()
    fusion: dict[str, Any] = {}
    log: Log | None = None
    live_view: LiveView | None = None
    can_out: CanOut | None = None
    health: Health | None = None
    warm_restart: WarmRestart | None = None
    realtime: Realtime = Realtime()

    def mounts_of(self, engine: str) -> tuple[int, ...]:
        """Indices of the mounts that carry `engine`, in the order of the file."""
        return tuple(i for i, mount in enumerate(self.mount) if mount.engine == engine)


def read_config(text: str, where: str) -> Config:
    """Parse and check a configuration; `where` names the file in errors (ConfigError, one line)."""
    config = read_toml(text, Config, where)
    _check(config, where)
    return config


def read_toml(text: str, kind: type[T], where: str) -> T:
    """A file of TOML as the struct `kind`; ConfigError, one line that begins with `where`."""
    if len(text) > MAX_BYTES:
        raise ConfigError(f"{where}: {len(text)} bytes, expected at most {MAX_BYTES}")
    if found := LONG_KEY.search(text):
        raise ConfigError(f"{where}: key {found[0][:40]} ...: expected at most {MOST_PARTS} names between dots")
    try:
        table = tomllib.loads(text)
    except ValueError as problem:  # of a number that is too long, too
        other = _other_file(text) if kind is Config else ""
        raise ConfigError(f"{where}: {other or f'not TOML: {problem}'}") from None
    except RecursionError:
        raise ConfigError(f"{where}: nested too deep, expected tables and lists as in deploy/ph-lab.toml") from None
    return section(table, kind, where)


def _other_file(text: str) -> str:
    """What a file is that is surely no configuration, and who reads it."""
    kinds = {
        '"thrustd-model/': "a mount model, read by `thrustd compile` and",
        '"thrustd.deck.': "a brochure deck, read by",
    }
    found = next((words for schema, words in kinds.items() if schema in text[:4000]), "")
    return f"{found} `thrustd info`; expected a configuration (TOML) that names it" if found else ""


def section(table: Any, kind: type[T], where: str) -> T:
    """A plain table as the struct `kind`; ConfigError that names file, key, value and what was expected."""
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as problem:
        raise ConfigError(f"{where}: {_with_value(table, kind, str(problem))}") from None


def _with_value(table: Any, kind: type, problem: str) -> str:
    """msgspec's "Expected ... - at `$.adc.port`" with the offending value, or with the keys that there are."""
    message, _, path = problem.partition(" - at `$")
    path = path.rstrip("`").lstrip(".")
    value = table
    try:
        if "[...]" in path:
            path = path.replace("[...]", f".{_refused_key(table, kind, path)}")
        parts = [part for part in path.replace("[", ".").replace("]", "").split(".") if part]
        for part in parts:
            value = value[int(part)] if isinstance(value, list) else value[part]
    except (KeyError, IndexError, ValueError, TypeError):
        return problem.replace("`$.", "`").replace("`$`", "the top level")
    if "unknown field" in message:
        key = message.split("`")[1]
        return f"{path}{'.' if path else ''}{key}: no such key, expected one of {', '.join(_keys(kind, parts))}"
    message = message.replace(f"`str` matching regex {_DAY!r}", "a day of the calendar, as 2026-02-28")
    return f"{path or 'the top level'} = {_short(value)}: {message}"


def _refused_key(table: Any, kind: type, path: str) -> str:
    """Which of a table's own names stands for `[...]` in `path`: without it the fault is gone."""
    holder = table = deepcopy(table)
    for part in path.partition("[...]")[0].split("."):
        holder = holder[part]
    for key in [*holder]:
        del holder[key]
        try:
            msgspec.convert(table, kind)
        except msgspec.ValidationError as problem:
            if path in str(problem):
                continue
        return str(key)
    raise KeyError(path)


def _keys(kind: Any, parts: Sequence[str]) -> tuple[str, ...]:
    """Of the table that `parts` lead to from a struct."""
    named: Any = inspect.type_info(kind)
    for part in (*parts, ""):
        if isinstance(named, inspect.UnionType):  # a table that may be left out
            named = next(each for each in named.types if isinstance(each, inspect.StructType))
        if part and isinstance(named, inspect.ListType):
            named = named.item_type
        elif part and isinstance(named, inspect.DictType):
            named = named.value_type
        elif part:
            named = next(field.type for field in named.fields if field.name == part)
    return tuple(field.encode_name for field in named.fields)


def _short(value: Any) -> str:
    """A table or a list is told by what it is."""
    if isinstance(value, dict | list):
        return "a table" if isinstance(value, dict) else "a list"
    if isinstance(value, int) and value.bit_length() > 64:
        return f"a number of {value.bit_length()} bits"  # Python does not print any
    return repr(value)


def _check(config: Config, where: str) -> None:
    _check_apart(config, where)
    for i, mount in enumerate(config.mount):
        if mount.engine not in config.aircraft.engines:
            raise ConfigError(
                f"{where}: mount[{i}].engine = {mount.engine!r}: expected one of {', '.join(config.aircraft.engines)}"
            )
        if mount.adc_channel >= config.adc.channels:
            raise ConfigError(
                f"{where}: mount[{i}].adc_channel = {mount.adc_channel}: expected 0 to {config.adc.channels - 1}"
            )
        if mount.scale_mm == 0:
            raise ConfigError(f"{where}: mount[{i}].scale_mm = 0: expected mm per count, e.g. 5 mm / 2^24 = 2.98e-7")
    for engine in config.aircraft.engines:
        if (mounts := len(config.mounts_of(engine))) not in (1, 2):
            raise ConfigError(f"{where}: engine {engine!r} has {mounts} mounts, expected 1 or 2")
    _check_rates(config, where)


def _check_apart(config: Config, where: str) -> None:
    """What is named or numbered is so once."""
    lists: tuple[tuple[str, Sequence[Any]], ...] = (
        ("mount[{}].name", [mount.name for mount in config.mount]),
        ("mount[{}].adc_channel", [mount.adc_channel for mount in config.mount]),
        ("aircraft.engines[{}]", config.aircraft.engines),
    )
    for field, values in lists:
        for i, value in enumerate(values):
            if value in values[:i]:
                raise ConfigError(f"{where}: {field.format(i)} = {value!r}: appears twice, expected different ones")
    if config.health and config.live_view and config.health.port == config.live_view.port:
        raise ConfigError(f"{where}: live_view.port = {config.live_view.port}: taken by health.port, expected another")


def _check_rates(config: Config, where: str) -> None:
    """A fused step is every so many samples."""
    sample_hz, estimate_hz = config.adc.sample_hz, config.steps.estimate_hz
    samples = max(round(sample_hz / estimate_hz), 1)  # between two fused steps
    if abs(sample_hz / samples - estimate_hz) > ESTIMATE_SLACK * estimate_hz:
        raise ConfigError(
            f"{where}: steps.estimate_hz = {estimate_hz:g}: expected adc.sample_hz, {sample_hz:g}, over a whole "
            f"number: {sample_hz / samples:g} comes nearest"
        )
    if config.can_out and config.can_out.rate_hz > estimate_hz:
        raise ConfigError(
            f"{where}: can_out.rate_hz = {config.can_out.rate_hz:g}:"
            f" expected at most steps.estimate_hz, {estimate_hz:g}"
        )
