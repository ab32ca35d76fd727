"""The same asked of several things at once: compiled loops let go of the interpreter, so threads share processors."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar, copy_context
from typing import Any, TypeVar

import numba

One = TypeVar("One")
Found = TypeVar("Found")

_numba: Any = numba.config
_inside: ContextVar[bool] = ContextVar("inside", default=False)


def each(function: Callable[[One], Found], things: Iterable[One]) -> Iterator[Found]:
    """`function` of every thing, in their order: as many at a time as there are processors.

    What is asked within one of them is asked one after the other. The first error ends it, and so does who stops
    listening: what has not begun then never does.
    """
    asked = list(things)
    threads = min(len(asked), _processors())
    if threads < 2 or _inside.get():
        yield from map(function, asked)
        return

    def within(one: One) -> Found:
        _inside.set(True)
        return function(one)

    contexts = [copy_context() for _ in asked]  # what numpy says of overflow is the caller's
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(lambda context, one: context.run(within, one), contexts, asked)


def _processors() -> int:
    """Those that this process may use; NUMBA_NUM_THREADS asks for fewer."""
    return int(_numba.NUMBA_NUM_THREADS)
