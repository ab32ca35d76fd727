"""Beyond the thesis (its outlook): HW-PWL with internal friction, and with the engine's weight as second input.

Friction as Prandtl-Ishlinskii stops is part of the regression itself. Bouc-Wen friction is fitted beside a core on data
thinned to a rate that friction, which does not depend on rate, still shows; the core is then fitted to the force
without that friction, and at last the effect's parameters, the heights of both curves and the gains together.
"""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from thrustd.identify.estimate import estimate
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment, thinned
from thrustd.identify.sensitivity import residuals
from thrustd.identify.structures.block_fits import BlockFit, BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, error_over, of_spec
from thrustd.model.artifact import Curve, EffectSpec, ModelSpec, Polynomial
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named

SAMPLES = 60_000  # to which the data are thinned
ITERATIONS = 12
SHOWS = 0.97  # error with friction over that of the smooth core alone, from which on there is none to be seen
SEGMENTS = 10  # of a table whose heights are estimated along with an effect
BOUC_WEN = "hysteresis"


def _bouc_wen(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    thin = thinned(segments, SAMPLES) or list(segments)
    wanted = replace(fits.wish, segments=fits.wish.segments or SEGMENTS)
    plain = fits.of(segments, wanted, progress)
    rubbing = with_effect(plain.spec, BOUC_WEN, thin)
    if error_over(rubbing, thin) > SHOWS * error_over(plain.spec, thin):
        return _stands_in(plain, "hw-pwl+bouc-wen", "no friction shows")
    core = fits.of([_without_effects(rubbing, s) for s in segments], wanted, progress)
    apart = msgspec.structs.replace(core.spec, effects=rubbing.effects)
    both = (rubbing, apart, _together(apart, BOUC_WEN, thin))  # means may be too coarse for the fastest modes
    spec = min(both, key=lambda spec: error_over(spec, segments))
    numbers = core.n_parameters + len(effect_named(BOUC_WEN).parameters)
    return of_spec(msgspec.structs.replace(spec, structure="hw-pwl+bouc-wen"), numbers)


def _second_input(name: str, title: str, effect: str) -> Structure:
    channels = effect_named(effect).channels

    def fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
        core = fits.of(segments, fits.wish, progress)
        if not all(any(np.ptp(s.inputs[c]) > 0.0 for s in segments) for c in channels):
            return _stands_in(core, name, f"{', '.join(channels)} never moves")
        spec = with_effect(core.spec, effect, thinned(segments, SAMPLES) or list(segments))
        added = len(effect_named(effect).parameters)
        return of_spec(msgspec.structs.replace(spec, structure=name), core.n_parameters + added)

    return Structure(name, title, "beyond", fit, channels)


def _stands_in(core: BlockFit, name: str, why: str) -> Fitted:
    spec = msgspec.structs.replace(core.spec, structure=name)
    return replace(of_spec(spec, core.n_parameters, note=f"{why}: this is hw-pwl"), same_as="hw-pwl")


def _without_effects(spec: ModelSpec, segment: Segment) -> Segment:
    """The force less what the effects add to it."""
    bare = msgspec.structs.replace(spec, effects=[])
    return replace(segment, force_n=segment.force_n - (residuals(bare, segment) - residuals(spec, segment)))


def with_effect(core: ModelSpec, name: str, segments: list[Segment]) -> ModelSpec:
    """The core with one effect, from the best of its starting values."""
    effect = effect_named(name)
    which = [*_estimated(effect), _heights("output_curve", core.output_curve)]
    trials = [estimate(_added(core, effect, start), segments, which, 3, 1e-3) for start in _starts(effect)]
    best = min(trials, key=lambda result: result.rmse_n)
    return _together(best.spec, name, segments)


def _together(spec: ModelSpec, name: str, segments: list[Segment]) -> ModelSpec:
    """The effect's parameters, the heights of both curves and the gains of the linear block, all at once."""
    curves = [_heights("input_curve", spec.input_curve), _heights("output_curve", spec.output_curve)]
    gains = [f"linear.real.{i}.gain" for i in range(len(spec.linear.real_modes))]
    wide = [*_estimated(effect_named(name)), *curves, *gains]
    return estimate(spec, segments, wide, ITERATIONS, 1e-4).spec


def _estimated(effect: Effect) -> list[str]:
    return [f"{effect.name}*.{p.name}" for p in effect.parameters if p.estimate]


def _heights(label: str, curve: Curve) -> str:
    return f"{label}.coefficients.*" if isinstance(curve, Polynomial) else f"{label}.y.*"


def _added(core: ModelSpec, effect: Effect, shape: float) -> ModelSpec:
    """At neutral amplitude, shape parameters at the `shape` quantile of their starting values."""
    values = effect.neutral()
    for parameter in effect.parameters:
        if not parameter.amplitude:
            values[parameter.name] = parameter.starts[round(shape * (len(parameter.starts) - 1))]
    return msgspec.structs.replace(core, effects=[*core.effects, EffectSpec(effect.name, values)])


def _starts(effect: Effect) -> list[float]:
    most = max((len(p.starts) for p in effect.parameters if not p.amplitude), default=1)
    return [0.5] if most == 1 else [0.0, 0.5, 1.0]


STRUCTURES = (
    Structure("hw-pwl+bouc-wen", "HW-PWL with Bouc-Wen friction", "beyond", _bouc_wen),
    _second_input("hw-pwl+weight", "MISO HW-PWL with engine weight", "engine_weight"),
)
