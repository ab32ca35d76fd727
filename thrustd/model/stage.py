"""A stage: the one building block of a chain. Curves, the linear block and every physical effect are stages.

A stage maps the running signal v of one sample to the next stage's v. Its whole behaviour is two functions:

    prepare(dt_s) -> c            coefficients for one sample period, float64 (n_c,)
    step(x, c, u, v) -> v         one sample; x: state (n_x,), changed in place; u: its channels (n_u,)

`step` is plain scalar Python that numba can compile. One compiled loop calls the steps of any chain by their
addresses: sample by sample through all of them in flight (`compose`), over a block of one of them on the ground
(`Stage.run`), with bit-equal results, because stages only feed forward. A call by address costs 5 to 20 ns more than an
inlined one, but whatever the chain, nothing is left to compile when a daemon starts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import cfunc, njit, types
from numba.extending import intrinsic

from thrustd.core.columns import Floats as Floats  # effects take it from here
from thrustd.core.columns import Integers
from thrustd.core.jit import compiled, named

DEFORMATION = "deformation_mm"
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
    enters: bool = False  # the rubber's deformation comes in here: stages behind read it, not what the transducer says

    def start(self, u: Floats, v: float) -> Floats:
        """State (n_state,) at rest with channels u (n_u,) and running signal v; zeros unless the stage knows better."""
        x = np.zeros(self.n_state)
        if self.initial is not None:
            self.initial(x, self.c, u, v)
        return x

    def run(self, x: Floats, u: Floats, v: Floats) -> Floats:
        """Step over a block: u (n, n_u), v (n,) -> (n,); x is left at the state after the last sample."""
        out = np.array(v)
        _block(self.step).run(x, self.c, np.require(u, requirements=["C", "W"]), out)
        return out

    def from_rest(self, columns: Mapping[str, Floats], v: Floats) -> Floats:
        """Over a block (n,), at rest on its first sample; `columns` (n,) by channel."""
        u = np.column_stack([columns[name] for name in self.channels]) if self.channels else np.empty((len(v), 0))
        return self.run(self.start(u[0], float(v[0])), u, v)

    def once(self, x: Floats, u: Floats, v: float) -> float:
        """One sample with channels u (n_u,); x is advanced."""
        return self.run(x, u[None, :], np.array([v])).item()


_ROW, _TABLE = types.float64[::1], types.float64[:, ::1]
_STEP = types.float64(_ROW, _ROW, _ROW, types.float64)
_WORTH_COMPILING = 40_000_000  # samples through one step: inlined each is 5 ns faster, compiling takes 0.2 s
Places = Integers  # (n + 1, 4): address of a step, where its slices of x, c and u begin; last row: their ends


class Chain(NamedTuple):
    """Stages one after the other, as compiled code runs them."""

    places: Places
    entry: int  # number of the stage that the rubber's deformation enters
    own: Integers  # (n_own,) columns of u that it is written to there; none where it is the reading as it is
    c: Floats  # of all stages


def _typed(_: Any, address: Any, x: Any, c: Any, u: Any, v: Any) -> Any:
    def lowered(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        begin, *arguments = values
        kinds = [context.get_value_type(kind) for kind in signature.args[1:]]
        function = ir.FunctionType(context.get_value_type(signature.return_type), kinds)
        return builder.call(builder.inttoptr(begin, function.as_pointer()), arguments)

    return types.float64(types.int64, *_STEP.args), lowered


_call: Any = intrinsic(_typed)


def _run_chain(chain: Chain, x: Floats, u: Floats, v: Floats) -> None:
    places, c = chain.places, chain.c
    for k in range(len(v)):
        w = v[k]
        for i in range(len(places) - 1):
            if i == chain.entry:
                for j in chain.own:
                    u[k, j] = w
            here, end = places[i], places[i + 1]
            w = _call(here[0], x[here[1] : end[1]], c[here[2] : end[2]], u[k, here[3] : end[3]], w)
        v[k] = w


CHAIN = named(Chain, types.int64[:, ::1], types.int64, types.int64[::1], _ROW)
run_chain: Any = compiled(_run_chain, types.void(CHAIN, _ROW, _TABLE, _ROW), error_model="numpy")


def _run_one(address: int, x: Floats, c: Floats, u: Floats, v: Floats) -> None:
    for k in range(len(v)):
        v[k] = _call(address, x, c, u[k], v[k])


_run_step: Any = compiled(_run_one, types.void(types.int64, _ROW, _ROW, _TABLE, _ROW), error_model="numpy")


class _Block:
    """A loop over one step: by its address at first, compiled around the step once that pays. The same bits."""

    def __init__(self, step: Any) -> None:
        self._step = step
        self._address = _entry(step).address
        self._passed = 0
        self._own: Any = None

    def run(self, x: Floats, c: Floats, u: Floats, v: Floats) -> None:
        self._passed += v.size
        if self._own is None and self._passed > _WORTH_COMPILING:
            self._own = _inlined(self._step)
        if self._own is None:
            _run_step(self._address, x, c, u, v)
        else:
            self._own(x, c, u, v)


@cache
def _entry(step: Any) -> Any:
    """The compiled step for callers that know its address; lives as long as the process."""
    return compiled(step.py_func, _STEP, "numpy", cfunc)


@cache
def _block(step: Any) -> _Block:
    return _Block(step)


def _inlined(step: Any) -> Any:
    @njit(error_model="numpy")
    def block(x: Floats, c: Floats, u: Floats, v: Floats) -> None:
        for k in range(v.shape[0]):
            v[k] = step(x, c, u[k], v[k])

    return block


def compose(stages: tuple[Stage, ...]) -> Chain:
    """These stages for `run_chain`; rows of u hold their channels one after the other."""
    sizes = [(stage.n_state, stage.c.size, len(stage.channels)) for stage in stages]
    addresses = [_entry(stage.step).address for stage in stages] + [0]
    begins = np.cumsum([(0, 0, 0), *sizes], axis=0)
    entry = next((i for i, stage in enumerate(stages) if stage.enters), 0)
    behind = [(i > entry > 0, name) for i, stage in enumerate(stages) for name in stage.channels]
    own = np.array([j for j, (later, name) in enumerate(behind) if later and name == DEFORMATION], np.int64)
    c = np.concatenate([stage.c for stage in stages])
    return Chain(np.column_stack((addresses, begins)), entry, own, c)


def free_run(stages: Sequence[Stage], columns: dict[str, Floats], v: Floats) -> Floats:
    """v (n,) through these stages over a whole block, at rest on its first sample; columns (n,) by channel."""
    for stage in stages:
        columns = entered(stage, columns, v)
        v = stage.from_rest(columns, v)
    return v


def entered(stage: Stage, columns: dict[str, Floats], v: Floats) -> dict[str, Floats]:
    """Columns as this stage and those behind it read them."""
    return {**columns, DEFORMATION: v} if stage.enters else columns
