"""The interface of a physical effect: what a file in `thrustd/model/effects/` says about itself.

An effect is one stage of the chain plus its physics card. With its amplitudes at their neutral values it returns its
input untouched, so adding one never makes a model worse at the start.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from thrustd.model.linear import sections
from thrustd.model.stage import Floats, Stage

Site = Literal["deformation", "spring", "linear", "gain", "force"]
SITES: tuple[Site, ...] = ("deformation", "spring", "linear", "gain", "force")  # in the order they act


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect. `starts`: values from which an estimation should begin (typical for PH-LAB)."""

    name: str  # with unit suffix, e.g. "mass_kg"
    unit: str
    neutral: float
    low: float
    high: float
    starts: tuple[float, ...]
    meaning: str
    amplitude: bool = True  # False: a shape parameter, without influence while the amplitudes are neutral
    expected: str = ""  # what physics says for PH-LAB, e.g. "172 kg on an upper mount"
    estimate: bool = True  # False: a reference value that stays fixed
    e_folds: float = 3.0  # that a shape may move from where an estimation begins
    spread: float = 0.0  # one sigma of a shape that moves by adding, not by factors
    beside: bool = False  # an amplitude of another effect in the same law, which says nothing of this one
    passive: bool = False  # an amplitude that is never below neutral in a body that gives back less than it was given
    level: float = 0.0  # of the effect's channel, squared in its law, at which the amplitude is given; 0: at none


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect; see the module docstring of its file for equation, sign, source and limits."""

    name: str
    title: str  # in words
    site: Site  # where it acts: on the deformation (mm), on the force of the spring (N, as a
    # factor) in front of the linear block, in that block, or on the force (N) as gain or addition
    channels: tuple[str, ...]  # what it reads (`u` of its step), canonical names
    parameters: tuple[Parameter, ...]
    step: Any  # compiled step(x, c, u, v) -> v
    prepare: Callable[[Mapping[str, float], float], Floats] | None  # (parameters, dt_s) -> c; None: as they stand
    n_state: int
    equation: str
    source: str
    separating_test: str  # the manoeuvre or bench test that shows it alone
    initial: Callable[[Floats, Floats, Floats, float], None] | None = None
    variant_of: str = ""  # another formulation of that effect; reports use that word
    lags: Callable[[Mapping[str, float]], list[tuple[float, float]]] | None = None  # of a linear one: tau_s, gain
    elements: Any = None  # compiled (x, c, u, wanted, out): what each of many amplitudes adds by 1, all in one pass
    ahead: str = ""  # the parameter that is a lateness of the reading, in seconds: only a record can undo it

    @property
    def word(self) -> str:
        """The word users type and reports print (ICD section 4)."""
        return self.variant_of or self.name

    def neutral(self) -> dict[str, float]:
        """Parameters with which the effect does nothing."""
        return {p.name: p.neutral if p.amplitude else p.starts[0] for p in self.parameters}

    def does_nothing(self, parameters: Mapping[str, float]) -> bool:
        """Whether all amplitudes are neutral."""
        return all(parameters[p.name] == p.neutral for p in self.parameters if p.amplitude)

    def stage(self, parameters: Mapping[str, float], dt_s: float) -> Stage:
        """The effect as a stage of a chain at one sample period; a linear one alone, without the block it widens."""
        if self.lags is not None:
            lags = self.lags(parameters)
            return sections(self.name, 1.0 + sum(g for _, g in lags), [(tau, -g) for tau, g in lags], [], dt_s)
        return Stage(self.name, self.step, self.constants(parameters, dt_s), self.n_state, self.channels, self.initial)

    def constants(self, parameters: Mapping[str, float], dt_s: float) -> Floats:
        """What its step reads as `c`."""
        if self.prepare is not None:
            return self.prepare(parameters, dt_s)
        return np.array([parameters[p.name] for p in self.parameters])


def begin_at_channel(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """An effect at rest whose first state is the last value of its channel."""
    x[0] = u[0]


def begin_at_signal(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """An effect at rest whose first state is the last value of the running signal."""
    x[0] = v
