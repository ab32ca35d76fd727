"""The plain fields of an object as JSON values, and back: the memory of watches and opinions across a restart.

NaN has no JSON: it travels as null. A field that is neither plain nor a row of plain values stays with its object.
"""

from collections import deque
from collections.abc import Iterable
from math import isfinite, nan
from typing import Any

MAX_TEXT = 64  # no word that an object keeps is longer


def remember(thing: object) -> dict[str, Any]:
    """Every plain field of `thing` (bool, int, float, str, list or deque of these), JSON-able."""
    return {name: _out(value) for name, value in _fields(thing) if _is_plain(value)}


def recall(thing: object, memory: Any) -> bool:
    """Set the fields that `remember` gave; False, and nothing changed, when the memory is not of such an object."""
    if not isinstance(memory, dict):
        return False
    fields = {name: value for name, value in _fields(thing) if _is_plain(value)}
    if set(memory) != set(fields) or not all(_fits(fields[name], memory[name]) for name in fields):
        return False
    for name, value in fields.items():
        setattr(thing, name, _in(value, memory[name]))
    return True


def _fields(thing: object) -> list[tuple[str, Any]]:
    names: Iterable[str] = getattr(type(thing), "__slots__", None) or vars(thing)
    return [(name, getattr(thing, name)) for name in names]


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | deque):
        return all(isinstance(item, bool | int | float) for item in value)
    return isinstance(value, bool | int | float | str)


def _out(value: Any) -> Any:
    if isinstance(value, list | deque):
        return [_out(item) for item in value]
    if isinstance(value, float):  # numpy's scalars too
        return float(value) if isfinite(value) else None
    return value


def _fits(present: Any, stored: Any) -> bool:
    match present:
        case deque():
            return isinstance(stored, list) and len(stored) <= (present.maxlen or 0) and all(map(_is_number, stored))
        case list():
            rows = isinstance(stored, list) and len(stored) == len(present)
            return rows and all(_fits(mine, theirs) for mine, theirs in zip(present, stored, strict=True))
        case bool():
            return isinstance(stored, bool)
        case str():
            return isinstance(stored, str) and len(stored) <= MAX_TEXT
        case _:
            return _is_number(stored)


def _is_number(stored: Any) -> bool:
    return stored is None or (isinstance(stored, int | float) and not isinstance(stored, bool))


def _in(present: Any, stored: Any) -> Any:
    match present:
        case deque():
            return deque(map(_number, stored), present.maxlen)
        case list():
            return [_in(mine, theirs) for mine, theirs in zip(present, stored, strict=True)]
        case bool() | str():
            return stored
        case int():
            return 0 if stored is None else int(stored)
        case _:
            return _number(stored)


def _number(stored: Any) -> float:
    return nan if stored is None else float(stored)
