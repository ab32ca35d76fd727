"""A model as one calibrated mount has it: the transducer's curve before its input curve, the gain behind its output.

Both curves are piecewise linear, so the composition is one again, exactly. What grows with temperature is the effect
`thermal_expansion`, beside that of the bench. What the weight presses on a mount at 1 g is in its zero: the couple of
an engine that hangs as a rigid body (`core.statics`), and of a mount that leans nose up by a, -m g sin(a). What the
load factor adds is taken off, and the curve of a rigid body begins where the couple holds it. Left out: where a lean
holds it, 3 N of an engine at 3 kN and 10 N at 6 kN per degree, which a tethered run takes for gain.
"""

from dataclasses import dataclass
from math import radians, sin

import msgspec
import numpy as np

from thrustd.core.aircraft import MountPlace
from thrustd.core.calibration import MountCalibration
from thrustd.core.columns import Floats
from thrustd.core.errors import ModelError
from thrustd.model.artifact import Curve, EffectSpec, ModelSpec, PiecewiseLinear, Polynomial, ValidRange
from thrustd.model.compile import curve_stage, rubs
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.model.effects.nacelle_drag import EFFECT as DRAG
from thrustd.model.effects.thermal_expansion import EFFECT as EXPANSION
from thrustd.model.expression import PREFIX
from thrustd.model.stage import DEFORMATION

GRID = 2001  # points of a curve that is searched
PRESSED = f"{PREFIX}-presses_n * (accel_z_g - 1)"
HELD = f"{PREFIX}-holds_n * accel_z_g"
NOTHING: Floats = np.empty(0)


@dataclass(frozen=True, slots=True)
class _Line:
    """Piecewise linear, its end segments go on."""

    x: Floats
    y: Floats

    def __call__(self, x: Floats) -> Floats:
        i = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        slope = (self.y[i + 1] - self.y[i]) / (self.x[i + 1] - self.x[i])
        return np.asarray(self.y[i] + slope * (x - self.x[i]))


def calibrated(spec: ModelSpec, place: MountPlace, where: str) -> ModelSpec:
    """The same model for readings from which the zero is taken off; `spec` itself where nothing was measured."""
    mount = place.calibration
    spec = with_friction(spec, mount.friction) if mount.friction != 1.0 else spec
    if mount.gain != 1.0:
        low, high = spec.valid.force_n
        spec = msgspec.structs.replace(
            spec,
            output_curve=_scaled(spec.output_curve, mount.gain),
            valid=msgspec.structs.replace(spec.valid, force_n=(low * mount.gain, high * mount.gain)),
        )
    spec = _under_weight(spec, place)
    if mount.read_mm:
        spec = _behind_curve(spec, mount, where)
    if place.drag_m2 != 0.0:
        spec = _more(spec, DRAG, drag_area_m2=place.drag_m2)
    if mount.expansion_mm_k == 0.0:
        return spec
    grows = {"expansion_mm_k": mount.expansion_mm_k, "reference_degc": mount.reference_degc}
    return msgspec.structs.replace(spec, effects=[EffectSpec(EXPANSION.name, grows), *spec.effects])


def with_friction(spec: ModelSpec, factor: float) -> ModelSpec:
    """With so much of its own friction."""
    return msgspec.structs.replace(spec, effects=[_yields(one, factor) if rubs(one) else one for one in spec.effects])


def each_more(spec: ModelSpec, factor: float) -> list[tuple[float, ModelSpec]]:
    """Every force of its friction, N, and the model in which that one alone is so much of itself."""
    found = []
    for place, present in enumerate(spec.effects):
        for name in _forces(present) if rubs(present) else ():
            more = msgspec.structs.replace(
                present, parameters=present.parameters | {name: factor * present.parameters[name]}
            )
            effects = [*spec.effects[:place], more, *spec.effects[place + 1 :]]
            found.append((present.parameters[name], msgspec.structs.replace(spec, effects=effects)))
    return found


def _yields(present: EffectSpec, factor: float) -> EffectSpec:
    moved = {name: factor * present.parameters[name] for name in _forces(present)}
    return msgspec.structs.replace(present, parameters=present.parameters | moved)


def _forces(present: EffectSpec) -> list[str]:
    """Its parameters that are forces, and there."""
    forces = [p.name for p in effect_named(present.name).parameters if p.unit == "N"]
    return [name for name in forces if present.parameters.get(name, 0.0) != 0.0]


def _under_weight(spec: ModelSpec, place: MountPlace) -> ModelSpec:
    """With what the load factor makes of the force that the weight presses at 1 g."""
    spec = _pressed(spec, place.couple_n, place.calibration.beyond) if place.couple_n != 0.0 else spec
    if (leans_n := -place.weight_n * sin(radians(place.lean_deg))) != 0.0:
        spec = msgspec.structs.replace(spec, effects=[*spec.effects, EffectSpec(PRESSED, {"presses_n": leans_n})])
    return spec


def _pressed(spec: ModelSpec, couple_n: float, beyond: float) -> ModelSpec:
    """Read from where the couple holds it: force(r) = F(r + d) + friction - couple, which is none at r = 0 and 1 g.

    Its friction is what it was when the weight came on it, from no deformation to d. Everything of the mount acts on
    all of its deformation and all of its force.
    """
    if spec.linear.feedback is not None:
        raise ModelError(f"{spec.name}: a fed-back block has no curve to begin on elsewhere; expected one without")
    linear, (low, high) = spec.linear, spec.valid.deformation_mm
    gain = linear.direct + sum(m.gain for m in linear.real_modes) + sum(m.gain_re for m in linear.complex_modes)
    first = gain * _values(spec.input_curve, np.array([0.0, min(low, 0.0)]))
    unloaded, edge = first.tolist()
    curves = _in_shear(spec.input_curve, 0.0, min(low, 0.0)), _in_shear(spec.output_curve, unloaded, edge, beyond)
    spec = msgspec.structs.replace(spec, input_curve=curves[0], output_curve=curves[1])
    mm = np.linspace(low - high, high, GRID)
    force_n = _values(spec.output_curve, gain * _values(spec.input_curve, mm))
    force_n += _friction_n(spec, mm) - np.interp(0.0, mm, force_n)
    d_mm, (least_n, most_n) = float(np.interp(couple_n, force_n, mm)), spec.valid.force_n
    valid = ValidRange((low - d_mm, high - d_mm), (least_n - couple_n, most_n - couple_n), spec.valid.rate_mm_s)
    effects = [*spec.effects, EffectSpec(HELD, {"holds_n": couple_n})]
    return msgspec.structs.replace(spec, pressed_mm=d_mm, valid=valid, effects=effects)


def _in_shear(curve: Curve, unloaded: float, edge: float, factor: float = 1.0) -> Curve:
    """Below the edge of what a bench has shown as on the other side: rubber in shear knows no forward.

    Or, where somebody has measured it, `factor` times as steep.
    """
    if not isinstance(curve, PiecewiseLinear):
        return curve
    line, x, y = _Line(np.array(curve.x), np.array(curve.y)), np.array(curve.x), np.array(curve.y)
    kept, other = x > edge, x > 2.0 * unloaded - edge
    at_edge_n, across_n = line(np.array([edge, 2.0 * unloaded - edge])).tolist()
    below = (2.0 * unloaded - x[other])[::-1], (at_edge_n + factor * (across_n - y[other]))[::-1]
    return PiecewiseLinear(
        [*below[0].tolist(), edge, *x[kept].tolist()], [*below[1].tolist(), at_edge_n, *y[kept].tolist()]
    )


def _friction_n(spec: ModelSpec, mm: Floats) -> Floats:
    """Of its effects of friction (n,), each brought from no deformation to mm (n,) at once."""
    total = np.zeros(len(mm))
    for present in spec.effects:
        if rubs(present):
            effect = effect_named(present.name)
            stage = effect.stage(effect.neutral() | present.parameters, 1.0)
            at_rest = np.zeros(len(stage.channels))
            for i, each in enumerate(mm.tolist()):
                x = stage.start(at_rest, 0.0)
                total[i] += stage.once(x, np.where(np.array(stage.channels) == DEFORMATION, each, at_rest), 0.0)
    return total


def _values(curve: Curve, x: Floats) -> Floats:
    stage = curve_stage("", curve)
    return np.array([stage.step(NOTHING, stage.c, NOTHING, each) for each in x.tolist()])


def _more(spec: ModelSpec, effect: Effect, **added: float) -> ModelSpec:
    """With this much more in an effect's parameters."""
    if effect.name not in [each.name for each in spec.effects]:
        spec = msgspec.structs.replace(spec, effects=[*spec.effects, EffectSpec(effect.name, effect.neutral())])
    values = {each.name: each.parameters for each in spec.effects}
    values[effect.name] = values[effect.name] | {name: values[effect.name][name] + more for name, more in added.items()}
    return msgspec.structs.replace(spec, effects=[EffectSpec(*each) for each in values.items()])


def _scaled(curve: Curve, gain: float) -> Curve:
    if isinstance(curve, PiecewiseLinear):
        return PiecewiseLinear(curve.x, [gain * y for y in curve.y])
    return Polynomial(curve.centre, curve.scale, [gain * value for value in curve.coefficients])


def _behind_curve(spec: ModelSpec, mount: MountCalibration, where: str) -> ModelSpec:
    """curve(r + zero) - curve(zero), in front of the input curve, which reads what the weight presses besides."""
    inner = spec.input_curve
    if not isinstance(inner, PiecewiseLinear):
        raise ModelError(f"{where}: its input curve is a polynomial; a transducer's curve needs a piecewise-linear one")
    read, true = np.array(mount.read_mm), np.array(mount.true_mm)
    zero = np.array([mount.zero_mm])
    d_mm = spec.pressed_mm
    forward = _Line(d_mm + read - zero, d_mm + true - _Line(read, true)(zero))
    back = _Line(forward.y, forward.x)
    knots = np.union1d(forward.x, back(np.array(inner.x)))
    low, high = (back(d_mm + np.array(spec.valid.deformation_mm)) - d_mm).tolist()
    curve = PiecewiseLinear(knots.tolist(), _Line(np.array(inner.x), np.array(inner.y))(forward(knots)).tolist())
    valid = ValidRange((low, high), spec.valid.force_n, spec.valid.rate_mm_s)
    return msgspec.structs.replace(spec, input_curve=curve, valid=valid)
