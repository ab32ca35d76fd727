"""numba with its cache of machine code, and without it where there is no place for one.

Before its first function numba looks whether scipy.linalg is there, and so loads all of it: 0.3 s of every restart in
flight. Here nothing multiplies matrices in compiled code; what does finds scipy.linalg when it is called.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any, Literal

from numba import njit

LINALG = "scipy.linalg", "scipy.linalg.cython_blas"


def _spare_linalg() -> None:
    """Load the part of numba that looks for it."""
    if LINALG[0] in sys.modules:
        return
    sys.modules.update({name: ModuleType(name) for name in LINALG})
    try:
        import_module("numba.np.arraymath")
    finally:
        for name in LINALG:
            del sys.modules[name]


_spare_linalg()


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
    try:
        return compiler(signature, cache=True, error_model=error_model)(function)
    except RuntimeError:
        return compiler(signature, error_model=error_model)(function)
