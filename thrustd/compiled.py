"""numba with its cache of machine code, and without it where there is no place for one."""

from collections.abc import Callable
from typing import Any, Literal

from numba import njit


def compiled(
    function: Callable[..., Any], signature: Any = None, error_model: Literal["python", "numpy"] = "python"
) -> Any:
    """`njit(signature)(function)`, kept for the next start in NUMBA_CACHE_DIR or beside the source.

    A package that cannot be written and a user without a home leave no such place (numba raises RuntimeError, "no
    locator available"): then it is compiled anew in every process.
    """
    try:
        return njit(signature, cache=True, error_model=error_model)(function)
    except RuntimeError:
        return njit(signature, error_model=error_model)(function)
