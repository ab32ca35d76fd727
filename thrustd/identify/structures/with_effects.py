"""Beyond the thesis (its outlook): HW-PWL with friction that yields (Bouc-Wen), and with the engine's weight as input.

The regression of these data goes on with this one effect in place of all friction. Where the data do not show it,
HW-PWL stands in.
"""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from thrustd.identify.regression.friction import BEGIN, effects_of, yielding
from thrustd.identify.regression.hypotheses import resolved
from thrustd.identify.regression.solve import Progress, Solution
from thrustd.identify.regression.terms import Term, at_start, split
from thrustd.identify.regression.walk import is_walk
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.mount import fitted_from
from thrustd.identify.structures.structure import Fitted, Structure, of_spec
from thrustd.model.effects import effect_named

WEIGHT = effect_named("engine_weight")


def _fit(
    name: str, terms: Sequence[Term], segments: Sequence[Segment], fits: BlockFits, progress: Progress | None
) -> Fitted:
    """With the best of these terms."""
    base = fits.of(segments, replace(fits.wish, friction=True), progress).found
    found = min((_with(base, term, segments, progress) for term in terms), key=lambda one: one.mean_square)
    if not effects_of(found):
        return _stands_in(name, segments, fits, progress, "no friction shows")
    fitted = fitted_from(found, segments, fits.wish.segments)
    assert fitted.spec is not None
    return replace(fitted, spec=msgspec.structs.replace(fitted.spec, structure=name), again=None)


def _with(base: Solution, term: Term, segments: Sequence[Segment], progress: Progress | None) -> Solution:
    nothing = np.zeros(0)
    parts = zip(base.shape.terms, split(base.shape.terms, base.point.terms), strict=True)
    inner = [(one, numbers) for one, numbers in parts if one.effect.site == "linear" or is_walk(one)]
    shape = replace(base.shape, radii=nothing, grows=False, terms=(*(one for one, _ in inner), term))
    begin = np.array([BEGIN if p.amplitude else 0.0 for p in term.free])
    known = np.concatenate([*(numbers for _, numbers in inner), begin])
    point = replace(base.point, stops=nothing, growth=nothing, terms=known)
    return resolved(replace(base, shape=shape, point=point), segments, progress)


def _stands_in(name: str, segments: Sequence[Segment], fits: BlockFits, progress: Progress | None, why: str) -> Fitted:
    core = fits.of(segments, fits.wish, progress)
    spec = msgspec.structs.replace(core.spec, structure=name)
    return replace(of_spec(spec, core.n_parameters, note=f"{why}: this is hw-pwl"), same_as="hw-pwl")


def _bouc_wen(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    scale = float(np.nanstd(np.concatenate([s.force_n for s in segments])))
    d = [s.inputs[DEFORMATION] for s in segments]
    return _fit("hw-pwl+bouc-wen", (yielding(d, scale), yielding(d, scale, 0.0)), segments, fits, progress)


def _weight(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    (channel,), (stiffening,) = WEIGHT.channels, WEIGHT.parameters
    if not any(np.ptp(s.inputs[channel]) > 0.0 for s in segments):
        return _stands_in("hw-pwl+weight", segments, fits, progress, f"{channel} never moves")
    term = at_start(WEIGHT, {stiffening.name: stiffening.starts[0]}, {})
    return _fit("hw-pwl+weight", (term,), segments, fits, progress)


STRUCTURES = (
    Structure("hw-pwl+bouc-wen", "HW-PWL with Bouc-Wen friction", "beyond", _bouc_wen),
    Structure("hw-pwl+weight", "MISO HW-PWL with engine weight", "beyond", _weight, WEIGHT.channels),
)
