"""numba with its cache of machine code, and without it where there is no place for one.

What numba kept it believes as long as the function's own file is the same, though machine code holds the functions
that it calls and the constants that it reads, whichever file they are of. So a digest of them goes with the function,
as what a closure holds: numba makes that part of the key. It is part of the function's name, too, and so of the file's:
an index that another version left names types that may be gone, and numba does not survive reading it.
"""

import sys
from collections.abc import Callable, Iterator
from enum import EnumMeta
from hashlib import sha256
from types import CellType, CodeType, FunctionType
from typing import Any, Literal

import numpy as np
from numba import njit, types
from numba.core import event

MANY = 10  # functions compiled by one process: its cache is empty or of another version
FIRST = "thrustd: first start on this machine: compiling, up to a minute, only this once\n"


class _Compiling(event.Listener):
    """Tells a person at a terminal or notebook, or a script that asked for it, why nothing happens."""

    def __init__(self) -> None:
        self.begun, self.anywhere = 0, False

    def on_start(self, _event: Any) -> None:
        self.begun += 1
        person = sys.stderr.isatty() or type(sys.stderr).__module__.startswith("ipykernel")
        if self.begun == MANY and (person or self.anywhere):
            sys.stderr.write(FIRST)

    def on_end(self, _event: Any) -> None:
        pass


_COMPILING = _Compiling()
_register: Any = event.register
_register("numba:compile", _COMPILING)


def say_compiling() -> None:
    """On standard error, once, wherever that goes; else only at a terminal, for bad input is one line."""
    _COMPILING.anywhere = True


def compiled(
    function: Callable[..., Any],
    signature: Any = None,
    error_model: Literal["python", "numpy"] = "python",
    compiler: Callable[..., Any] = njit,
) -> Any:
    """`compiler(signature)(function)`, kept for the next start in NUMBA_CACHE_DIR or beside the source.

    A package that cannot be written and a user without a home leave no such place (numba raises RuntimeError, "no
    locator available"): then it is compiled anew in every process.
    """
    function = _with_digest(function)
    try:
        return compiler(signature, cache=True, error_model=error_model)(function)
    except RuntimeError:
        return compiler(signature, error_model=error_model)(function)


def entry(function: Any) -> Any:
    """Machine code of one signature for callers in Python: half of a short call is numba's look at what it was given.

    So it is for callers whose arrays are made once and are of the signature's kinds: nobody looks at more than the size
    of their numbers.
    """
    (only,) = function.overloads.values()
    return only.entry_point


def named(kind: type, *types_: Any) -> Any:
    """The type of a NamedTuple for a signature, its fields' types in their order."""
    library: Any = types
    if len(set(types_)) == 1:  # numba takes these for another kind
        return library.NamedUniTuple(types_[0], len(types_), kind)
    return library.NamedTuple(types_, kind)


def together(*types_: Any) -> Any:
    """The type of a plain tuple for a signature. A dispatcher knows one quickly; a NamedTuple it asks Python about."""
    library: Any = types
    return library.Tuple(types_)


def _with_digest(function: Any) -> Any:
    if function.__closure__ is not None:  # numba looks at what it holds
        return function
    digest = sha256(b"\n".join(_reached(function, set()))).hexdigest()
    code = function.__code__.replace(co_freevars=("digest",))
    made = FunctionType(code, function.__globals__, function.__name__, function.__defaults__, (CellType(digest),))
    made.__doc__, made.__module__ = function.__doc__, function.__module__
    made.__qualname__ = f"{function.__qualname__}_{digest[:12]}"
    made.__annotations__ = function.__annotations__
    return made


def _reached(function: Any, seen: set[Any]) -> Iterator[bytes]:
    """Code and constants that a function's machine code is made of."""
    seen.add(function)
    code = function.__code__
    yield code.co_code
    yield repr(function.__annotations__).encode()
    yield repr([each for each in code.co_consts if not isinstance(each, CodeType)]).encode()
    for name in code.co_names:
        value = function.__globals__.get(name)
        inner = getattr(value, "py_func", None)
        if inner is not None and inner not in seen:
            yield from _reached(inner, seen)
        elif isinstance(value, EnumMeta):
            yield repr(list(value)).encode()
        elif isinstance(value, np.ndarray):
            yield value.tobytes()
        elif isinstance(value, (int, float, str, tuple, np.generic, np.dtype)) and " at 0x" not in repr(value):
            yield f"{name} {value!r}".encode()
