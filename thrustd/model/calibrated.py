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
from thrustd.model.compile import curve_stage
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.model.effects.hysteresis import EFFECT as FRICTION
from thrustd.model.effects.nacelle_drag import EFFECT as DRAG
from thrustd.model.effects.thermal_expansion import EFFECT as EXPANSION
from thrustd.model.expression import PREFIX

GRID = 2001  # points of a curve that is searched
PRESSED = f"{PREFIX}-presses_n * (accel_z_g - 1)"
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
    spec = _under_weight(spec, place)
    if mount.read_mm:
        spec = _behind_curve(spec, mount, where)
    if mount.gain != 1.0:
        low, high = spec.valid.force_n
        spec = msgspec.structs.replace(
            spec,
            output_curve=_scaled(spec.output_curve, mount.gain),
            valid=msgspec.structs.replace(spec.valid, force_n=(low * mount.gain, high * mount.gain)),
        )
    if place.drag_m2 != 0.0:
        spec = _more(spec, DRAG, drag_area_m2=place.drag_m2)
    if mount.expansion_mm_k == 0.0:
        return spec
    grows = {"expansion_mm_k": mount.expansion_mm_k, "reference_degc": mount.reference_degc}
    return msgspec.structs.replace(spec, effects=[EffectSpec(EXPANSION.name, grows), *spec.effects])


def with_friction(spec: ModelSpec, factor: float) -> ModelSpec:
    """With so much of its own friction."""
    return msgspec.structs.replace(spec, effects=[_yields(one, factor) if rubs(one) else one for one in spec.effects])


def rubs(present: EffectSpec) -> bool:
    """Whether it is friction."""
    return effect_named(present.name).word == FRICTION.word


def _yields(present: EffectSpec, factor: float) -> EffectSpec:
    forces = {p.name for p in effect_named(present.name).parameters if p.unit == "N"}
    moved = {name: factor * value if name in forces else value for name, value in present.parameters.items()}
    return msgspec.structs.replace(present, parameters=moved)


def _under_weight(spec: ModelSpec, place: MountPlace) -> ModelSpec:
    """With what the load factor makes of the force that the weight presses at 1 g."""
    presses_n = place.couple_n - place.weight_n * sin(radians(place.lean_deg))
    if presses_n == 0.0:
        return spec
    spec = _preloaded(spec, place.couple_n) if place.couple_n != 0.0 else spec
    return msgspec.structs.replace(spec, effects=[*spec.effects, EffectSpec(PRESSED, {"presses_n": presses_n})])


def _preloaded(spec: ModelSpec, couple_n: float) -> ModelSpec:
    """Begun where the couple holds it: force(r) = F(r + d) - F(d),  F(d) = F(0) + couple at rest."""
    if spec.linear.feedback is not None:
        raise ModelError(f"{spec.name}: a fed-back block has no curve to begin on elsewhere; expected one without")
    linear, (low, high) = spec.linear, spec.valid.deformation_mm
    gain = linear.direct + sum(m.gain for m in linear.real_modes) + sum(m.gain_re for m in linear.complex_modes)
    mm = np.linspace(low - high, high, GRID)
    inner = _values(spec.input_curve, mm)
    force_n = _values(spec.output_curve, gain * inner)
    wanted_n = np.interp(0.0, mm, force_n) + couple_n
    d_mm, v, f_n = (float(np.interp(wanted_n, force_n, column)) for column in (mm, inner, force_n))
    valid = spec.valid
    return msgspec.structs.replace(
        spec,
        input_curve=_moved(spec.input_curve, d_mm, v),
        output_curve=_moved(spec.output_curve, gain * v, f_n),
        valid=ValidRange((low - d_mm, high - d_mm), (valid.force_n[0] - f_n, valid.force_n[1] - f_n), valid.rate_mm_s),
    )


def _values(curve: Curve, x: Floats) -> Floats:
    stage = curve_stage("", curve)
    return np.array([stage.step(NOTHING, stage.c, NOTHING, each) for each in x.tolist()])


def _moved(curve: Curve, x: float, y: float) -> Curve:
    """The curve seen from one of its points."""
    if isinstance(curve, PiecewiseLinear):
        return PiecewiseLinear([each - x for each in curve.x], [each - y for each in curve.y])
    first, *rest = curve.coefficients
    return Polynomial(curve.centre - x, curve.scale, [first - y, *rest])


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
    """curve(r + zero) - curve(zero), in front of the input curve."""
    inner = spec.input_curve
    if not isinstance(inner, PiecewiseLinear):
        raise ModelError(f"{where}: its input curve is a polynomial; a transducer's curve needs a piecewise-linear one")
    read, true = np.array(mount.read_mm), np.array(mount.true_mm)
    zero = np.array([mount.zero_mm])
    forward = _Line(read - zero, true - _Line(read, true)(zero))
    back = _Line(forward.y, forward.x)
    knots = np.union1d(forward.x, back(np.array(inner.x)))
    low, high = back(np.array(spec.valid.deformation_mm)).tolist()
    curve = PiecewiseLinear(knots.tolist(), _Line(np.array(inner.x), np.array(inner.y))(forward(knots)).tolist())
    valid = ValidRange((low, high), spec.valid.force_n, spec.valid.rate_mm_s)
    return msgspec.structs.replace(spec, input_curve=curve, valid=valid)
