"""numba with the types kept, for the twin's loops."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numpy as np
import numpy.typing as npt

from thrustd.core.jit import compiled

FloatArray = npt.NDArray[np.float64]

P = ParamSpec("P")
R = TypeVar("R")


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compiled on first use and kept for the next start."""
    return cast(Callable[P, R], compiled(function))
