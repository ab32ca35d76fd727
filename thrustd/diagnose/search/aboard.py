"""The mounts of one engine that a log carries, and in which of them an effect is.

What one mount or its transducer does no other mount shows; what acts on the engine, or on every mount of its kind, both
show, a load in the part that each carries. Which it is, the readings say: an effect is weighed in the mount that is
judged, in the other one, and in both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.core.aircraft import MountPlace
from thrustd.core.columns import Floats
from thrustd.core.signals import CATALOGUE
from thrustd.diagnose.search.candidates import moves
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.records import COMPLETE
from thrustd.identify.regression.terms import Term, split
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import model_stages
from thrustd.records.recording import Recording

HERE, THERE, BOTH = "here", "there", "both"
OF_A_MOUNT = {name: signal.rest for name, signal in CATALOGUE.items() if signal.scope == "mount"}


class Aboard(NamedTuple):
    """A mount with its model and what it read, stretch by stretch, under plain names."""

    place: MountPlace
    spec: ModelSpec  # as its bench left it; what was measured of the mount where it is comes on top
    segments: tuple[Segment, ...]

    def run(self, spec: ModelSpec, segment: Segment) -> Floats:
        """Free run (n,) of such a model as it flies."""
        return simulate(calibrated(spec, self.place, spec.name), segment)


@dataclass(frozen=True, slots=True)
class Placed:
    """An effect in one or both mounts."""

    term: Term
    where: str = HERE

    @property
    def word(self) -> str:
        return self.term.effect.word

    @property
    def here(self) -> bool:
        """Whether it is in the mount that is judged."""
        return self.where != THERE

    def fixed(self) -> "Placed":
        """With its shape where it begins."""
        return replace(self, term=replace(self.term, shapes=False))

    def in_mount(self, mount: Aboard, judged: Aboard) -> Term | None:
        """As this mount has it; None: it has none, or its model already has what the judged one lacks."""
        if mount is judged:
            return self.term if self.here else None
        if self.where == HERE:
            return None
        term, name = self.term, self.term.effect.name
        known = next((e.parameters for e in mount.spec.effects if e.name == name), None)
        if known is not None and not term.centre:
            return None
        factor = mount.place.share / judged.place.share if term.effect.site == "force" else 1.0
        std = {p: factor * sigma for p, sigma in term.std.items()}
        values = term.effect.neutral() | (known or {})
        return replace(term, fixed={**term.fixed, **(known or {})}, std=std, centre={p: values[p] for p in std})


def places(term: Term, mounts: Sequence[Aboard]) -> list[Placed]:
    """Where it can be."""
    judged, *others = mounts
    every = [Placed(term), *(Placed(term, where) for where in (THERE, BOTH) if others)]
    return [one for one in every if one.here or all(one.in_mount(mount, judged) for mount in others)]


def spec_with(mount: Aboard, judged: Aboard, placed: Sequence[Placed], numbers: Floats) -> ModelSpec:
    """The model of one mount with those of the effects that are in it."""
    parts = zip(placed, split([one.term for one in placed], numbers), strict=True)
    own = [(one.in_mount(mount, judged), values) for one, values in parts]
    return with_effects(mount.spec, [_sized(term, values) for term, values in own if term is not None])


def sized(placed: Sequence[Placed], numbers: Floats, std: Floats) -> list[tuple[Placed, EffectSpec]]:
    """Effects with their sizes, one sigma each."""
    terms = [one.term for one in placed]
    parts = zip(placed, split(terms, numbers), split(terms, std), strict=True)
    return [(one, _sized(one.term, values, sigma)) for one, values, sigma in parts]


def _sized(term: Term, numbers: Floats, std: Floats | None = None) -> EffectSpec:
    return EffectSpec(term.effect.name, term.values(numbers), {} if std is None else term.sigma(numbers, std))


def with_effects(spec: ModelSpec, found: Sequence[EffectSpec]) -> ModelSpec:
    """The model with these effects; one that it has is given its new size."""
    if not found:
        return spec
    effects = list(spec.effects)
    for effect in found:
        where = [i for i, known in enumerate(effects) if known.name == effect.name]
        i = where[0] if where else len(effects)
        effects[i : i + 1] = [effect]
    return msgspec.structs.replace(spec, effects=effects, witness=None)


def read_beside(records: Sequence[Recording], others: Sequence[tuple[MountPlace, ModelSpec]]) -> list[str]:
    """Columns that other mounts read, where these speak whenever the judged one does."""
    names = [f"{name}_{place.mount}" for place, spec in others for name in _reads(spec, place) if name in OF_A_MOUNT]

    def there(name: str) -> bool:
        return all(
            name in record and np.isfinite(record[name][np.isfinite(record[DEFORMATION])]).mean() > COMPLETE
            for record in records
        )

    return [name for name in names if there(name)]


def _reads(spec: ModelSpec, place: MountPlace) -> set[str]:
    flies = calibrated(spec, place, spec.name)
    return {DEFORMATION, *(name for stage in model_stages(flies, 1.0) for name in stage.channels)}


def beside(segments: Sequence[Segment], place: MountPlace, spec: ModelSpec) -> Aboard | None:
    """Another mount of the same engine over the same stretches; None where the log lacks what its model reads.

    A mount without a thermometer is taken to be at 20 degC, as everywhere.
    """
    found = []
    for segment in segments:
        shared = {name: column for name, column in segment.inputs.items() if name not in OF_A_MOUNT}
        for name, at_rest in OF_A_MOUNT.items():
            own = f"{name}_{place.mount}"
            if own in segment.inputs:
                shared[name] = segment.inputs[own]
            elif name != DEFORMATION and np.isfinite(at_rest):
                shared[name] = np.full(len(segment), at_rest)
        found.append(replace(segment, inputs=shared))
    there = all(_reads(spec, place) <= set(one.inputs) and moves(one.inputs[DEFORMATION]) for one in found)
    return Aboard(place, spec, tuple(found)) if there else None
