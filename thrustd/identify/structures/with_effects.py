"""Beyond the thesis (its outlook): HW-PWL with internal friction, and with the engine's weight as second input.

The HW-PWL core is fitted first; then the effect's parameters, the heights of the output curve and the gains of the
linear block are estimated together through the whole chain, on data thinned to a rate that friction, which does not
depend on rate, still shows. Knots of the core that lie close together imitated friction and become one before.
"""

from collections.abc import Sequence

import msgspec
import numpy as np

from thrustd.identify.estimate import EstimateSettings, estimate_segments
from thrustd.identify.hw_fit import HwSettings, Progress
from thrustd.identify.segments import Segment, thinned
from thrustd.identify.structures.block_oriented import fit_blocks
from thrustd.identify.structures.structure import Fitted, Structure, of_spec
from thrustd.model.artifact import EffectSpec, ModelSpec, PiecewiseLinear
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named

SAMPLES = 60_000  # to which the data are thinned
ITERATIONS = 12
NEAR, JUMP = 0.03, 0.1  # of a curve's range in x and in y


def _structure(name: str, title: str, effect: str, channels: tuple[str, ...] = ()) -> Structure:
    def fit(segments: Sequence[Segment], progress: Progress | None) -> Fitted:
        core = fit_blocks(segments, HwSettings(), name, progress)
        assert core.spec is not None
        moves = [c for c in channels if any(np.ptp(s.inputs[c]) > 0.0 for s in segments)]
        if len(moves) < len(channels):
            return of_spec(core.spec, core.n_parameters, (f"{', '.join(channels)} never moves: {effect} left out",))
        spec = with_effect(_unkinked(core.spec), effect, thinned(segments, SAMPLES))
        return of_spec(spec, core.n_parameters + len(effect_named(effect).parameters))

    return Structure(name, title, "beyond", fit, channels)


def with_effect(core: ModelSpec, name: str, segments: list[Segment]) -> ModelSpec:
    """The core with one effect, from the best of its starting values."""
    effect = effect_named(name)
    which = [f"{name}.{p.name}" for p in effect.parameters if p.estimate]
    settings = EstimateSettings(max_iterations=3, tolerance=1e-3)
    trials = [
        estimate_segments(_added(core, effect, start), segments, [*which, "output_curve.y.*"], settings)
        for start in _starts(effect)
    ]
    best = min(trials, key=lambda result: result.rmse_after)
    gains = [f"linear.real.{i}.gain" for i in range(len(core.linear.real_modes))]
    wide = [*which, "input_curve.y.*", "output_curve.y.*", *gains]
    return estimate_segments(best.spec, segments, wide, EstimateSettings(ITERATIONS, 1e-4)).spec


def _unkinked(core: ModelSpec) -> ModelSpec:
    f, h = (_apart(curve) if isinstance(curve, PiecewiseLinear) else curve
            for curve in (core.input_curve, core.output_curve))  # fmt: skip
    return msgspec.structs.replace(core, input_curve=f, output_curve=h)


def _apart(curve: PiecewiseLinear) -> PiecewiseLinear:
    """Inner knots nearer than `NEAR` become one in their middle, unless they carry a jump; the ends stay."""
    span, height = curve.x[-1] - curve.x[0], max(curve.y) - min(curve.y)
    kept = [(curve.x[0], curve.y[0])]
    for x, y in zip(curve.x[1:-1], curve.y[1:-1], strict=True):
        near = min(x - kept[-1][0], curve.x[-1] - x) < NEAR * span
        if not near or abs(y - kept[-1][1]) > JUMP * height:
            kept.append((x, y))
        elif len(kept) > 1 and x - kept[-1][0] < NEAR * span:
            kept[-1] = ((x + kept[-1][0]) / 2, (y + kept[-1][1]) / 2)
    x_all, y_all = zip(*kept, (curve.x[-1], curve.y[-1]), strict=True)
    return PiecewiseLinear(list(x_all), list(y_all))


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
    _structure("hw-pwl+bouc-wen", "HW-PWL with Bouc-Wen friction", "hysteresis"),
    _structure("hw-pwl+prandtl-ishlinskii", "HW-PWL with Prandtl-Ishlinskii friction", "hysteresis_prandtl_ishlinskii"),
    _structure("hw-pwl+weight", "MISO HW-PWL with engine weight", "engine_weight", ("accel_z_g",)),
)
