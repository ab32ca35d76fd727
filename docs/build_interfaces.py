"""Writes docs/interfaces.md from the tables in the code: signals, faults, status bits, log topics, settings."""

import inspect
from pathlib import Path
from typing import get_args, get_origin, get_type_hints

import msgspec

from thrustd import config
from thrustd.fault_status import BITS, ENDS, FUSION_BITS, FUSION_ENDS
from thrustd.fusion.settings import FusionSettings
from thrustd.signals import CATALOGUE
from thrustd.types import FAULT_KINDS, Status
from thrustd.wire import log_layout

HEAD = """# Interfaces

Made by `python docs/build_interfaces.py` from the tables in the code; do not edit by hand.
The wire formats themselves are in the interface control document; this page says what thrustd makes of them.
"""


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def signals() -> str:
    rows = [
        (f"`{s.name}`", s.unit, s.scope, s.meaning, f"{s.low:g} to {s.high:g}", f"{s.stale_after_s:g}")
        for s in CATALOGUE.values()
    ]
    return table(("channel", "unit", "one per", "meaning and sign", "plausible", "stale after, s"), rows)


def faults() -> str:
    bits, ends = BITS | FUSION_BITS, ENDS | FUSION_ENDS
    begins = {end: begin for begin, end in ends.items()}
    rows: list[tuple[str, ...]] = []
    for kind, meaning in FAULT_KINDS.items():
        bit = ", ".join(f"`{flag.name}`" for flag in bits[kind]) if kind in bits else f"ends `{begins[kind]}`"
        rows.append((f"`{kind}`", meaning, bit, f"`{ends[kind]}`" if kind in ends else ""))
    return table(("kind", "meaning", "status bit", "until"), rows)


def status_bits() -> str:
    source = inspect.getsource(Status)
    rows: list[tuple[str, ...]] = []
    for bit in Status:
        line = next(line for line in source.splitlines() if line.strip().startswith(f"{bit.name} ="))
        rows.append((f"`{bit.name}`", str(int(bit)), line.partition("#")[2].strip()))
    return table(("bit", "value", "meaning"), rows)


def type_words(hint: object) -> str:
    """A key's type and limits in words."""
    if get_origin(hint) is not None and hasattr(hint, "__metadata__"):
        limits = [meta for meta in hint.__metadata__ if isinstance(meta, msgspec.Meta)]
        words = [
            f"{name} {value:g}"
            for meta in limits
            for name, value in (("at least", meta.ge), ("above", meta.gt), ("at most", meta.le))
            if value is not None
        ]
        return ", ".join([type_words(get_args(hint)[0]), *words])
    if hasattr(hint, "__args__") and type(None) in get_args(hint):
        return type_words(next(kind for kind in get_args(hint) if kind is not type(None)))
    return getattr(get_origin(hint) or hint, "__name__", str(hint))


def keys(kind: type, path: str) -> list[tuple[str, ...]]:
    hints = get_type_hints(kind, include_extras=True)
    rows = []
    for field in msgspec.structs.fields(kind):
        default = "required" if field.required else f"`{field.default}`"
        rows.append((f"`{path}{field.name}`", type_words(hints[field.name]), default))
    return rows


def configuration() -> str:
    sections = (
        (config.Aircraft, "aircraft."), (config.Mount, "mount[]."), (config.Adc, "adc."), (config.Can, "can."),
        (config.Steps, "steps."), (config.Log, "log."), (config.LiveView, "live_view."), (config.CanOut, "can_out."),
        (FusionSettings, "fusion."),
    )  # fmt: skip
    rows = [row for kind, path in sections for row in keys(kind, path)]
    return table(("key", "type", "default"), rows)


def topics() -> str:
    text = inspect.getdoc(log_layout) or ""
    return "```\n" + text + "\n```\n"


def page() -> str:
    parts = (
        ("Channels", signals()), ("Faults", faults()), ("Status bits of an estimate", status_bits()),
        ("The flight log", topics()), ("Configuration keys", configuration()),
    )  # fmt: skip
    return HEAD + "".join(f"\n## {title}\n\n{text}" for title, text in parts)


if __name__ == "__main__":
    Path(__file__).with_name("interfaces.md").write_text(page())
