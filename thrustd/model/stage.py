"""A stage: the one building block of a chain. Curves, the linear block and every physical effect are stages.

A stage maps the running signal v of one sample to the next stage's v. Its whole behaviour is two functions:

    prepare(dt_s) -> c            coefficients for one sample period, float64 (n_c,)
    step(x, c, u, v) -> v         one sample; x: state (n_x,), changed in place; u: its channels (n_u,)

`step` is plain scalar Python that numba can compile. The compiled function runs sample by sample with the others in
flight (`compose`) and in a loop over a block on the ground (`Stage.run`): one implementation, bit-equal results,
because stages only feed forward.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from thrustd.compiled import compiled

Floats = NDArray[np.float64]
Step = Callable[[Floats, Floats, Floats, float], float]


def jit(function: Callable[..., Any]) -> Any:
    """Compile without fast-math or fused multiply-add, so that block and stream agree to the last bit."""
    return compiled(function, error_model="numpy")


@dataclass(frozen=True, slots=True)
class Stage:
    """One element of a chain, prepared for one sample period."""

    name: str
    step: Any  # compiled Step
    c: Floats  # (n_c,)
    n_state: int = 0
    channels: tuple[str, ...] = ()
    initial: Callable[[Floats, Floats, Floats, float], None] | None = None  # (x, c, u, v): fill x for a start at rest

    def start(self, u: Floats, v: float) -> Floats:
        """State (n_state,) at rest with channels u (n_u,) and running signal v; zeros unless the stage knows better."""
        x = np.zeros(self.n_state)
        if self.initial is not None:
            self.initial(x, self.c, u, v)
        return x

    def run(self, x: Floats, u: Floats, v: Floats) -> Floats:
        """Step over a block: u (n, n_u), v (n,) -> (n,); x is left at the state after the last sample."""
        out = np.empty_like(v)
        _block(self.step).run(
            x, self.c, np.require(u, requirements=["C", "W"]), np.require(v, requirements=["C", "W"]), out
        )
        return out


_ROW = types.float64[::1]
_TABLE = types.float64[:, ::1]
_STEP = types.FunctionType(types.float64(_ROW, _ROW, _ROW, types.float64))
_WORTH_COMPILING = 8_000_000  # samples through one step: a call by pointer costs 20 ns more, compiling 0.2 s


def _by_pointer(step: Any, x: Floats, c: Floats, u: Floats, v: Floats, out: Floats) -> None:
    for k in range(v.shape[0]):
        out[k] = step(x, c, u[k], v[k])


_any_block = compiled(_by_pointer, types.void(_STEP, _ROW, _ROW, _TABLE, _ROW, _ROW), error_model="numpy")


class _Block:
    """A loop over one step: by function pointer at first, compiled around the step once that pays. The same bits."""

    def __init__(self, step: Any) -> None:
        self._step = step
        self._passed = 0
        self._own: Any = None

    def run(self, x: Floats, c: Floats, u: Floats, v: Floats, out: Floats) -> None:
        self._passed += v.size
        if self._own is None and self._passed > _WORTH_COMPILING:
            self._own = _inlined(self._step)
        if self._own is None:
            _any_block(self._step, x, c, u, v, out)
        else:
            self._own(x, c, u, v, out)


@cache
def _block(step: Any) -> _Block:
    return _Block(step)


def _inlined(step: Any) -> Any:
    @njit(error_model="numpy")
    def block(x: Floats, c: Floats, u: Floats, v: Floats, out: Floats) -> None:
        for k in range(v.shape[0]):
            out[k] = step(x, c, u[k], v[k])

    return block


_AT_ONCE = 6  # stages per compiled loop: a core of three and three effects
_Offsets = tuple[int, int, int]  # where a stage's slices of x, c and u begin


@jit
def _pass_through(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v


@cache
def _loop(steps: tuple[Any, ...], offsets: tuple[_Offsets, ...]) -> Any:
    """`_AT_ONCE` steps over rows. Written out, because every function is compiled at start-up; LLVM inlines all."""
    f0, f1, f2, f3, f4, f5 = steps
    (x0, c0, u0), (x1, c1, u1), (x2, c2, u2), (x3, c3, u3), (x4, c4, u4), (x5, c5, u5), (x6, c6, u6) = offsets

    @njit(error_model="numpy")
    def loop(x: Floats, c: Floats, u: Floats, v: Floats) -> None:
        for k in range(v.shape[0]):
            w = f0(x[x0:x1], c[c0:c1], u[k, u0:u1], v[k])
            w = f1(x[x1:x2], c[c1:c2], u[k, u1:u2], w)
            w = f2(x[x2:x3], c[c2:c3], u[k, u2:u3], w)
            w = f3(x[x3:x4], c[c3:c4], u[k, u3:u4], w)
            w = f4(x[x4:x5], c[c4:c5], u[k, u4:u5], w)
            v[k] = f5(x[x5:x6], c[c5:c6], u[k, u5:u6], w)

    return loop


def compose(stages: tuple[Stage, ...]) -> tuple[tuple[Any, ...], Floats]:
    """Fuse stages into a few compiled loops(x, c, u, v), run one after the other, and the joint coefficients c.

    x, c and each row of u (n, n_u) are those of the stages, one after the other; v (n,) is changed in place.
    """
    idle = [(_pass_through, 0, 0, 0)] * (-len(stages) % _AT_ONCE)
    parts = [(s.step, s.n_state, s.c.size, len(s.channels)) for s in stages] + idle
    ends = np.cumsum([(0, 0, 0), *(part[1:] for part in parts)], axis=0)
    offsets = [(int(x), int(c), int(u)) for x, c, u in ends]
    loops = tuple(
        _loop(tuple(part[0] for part in parts[i : i + _AT_ONCE]), tuple(offsets[i : i + _AT_ONCE + 1]))
        for i in range(0, len(parts), _AT_ONCE)
    )
    return loops, np.concatenate([stage.c for stage in stages])
