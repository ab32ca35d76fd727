"""Scale that bends: the LVDT's millimetres are not the bench's, and not equally wrong over its travel.

    true deformation = reading / (1 + scale_error) * (1 + square s + cube s^2),    s = clip(reading / range_mm, -1, 1)

A data sheet's linearity: the core leaves the coils towards the end of the stroke, or the transducer stands at an angle
to the motion, so millimetres become shorter with travel. About the null of the transducer such a curve is odd, a cube;
the null is seldom the mount's own zero, and a cube seen from elsewhere has a square. Zero stays where it is, and
outside range_mm, the travel of the record, the reading is as wrong as at its end. Valid for errors of up to a tenth.
A variant of `sensor_scale`. It bends the deformation and not the force: the two differ where the rubber remembers or
rubs, by little. Left out: a linearity that changes with temperature.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.sensor_scale import EFFECT as STRAIGHT
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    s = min(max(v / c[3], -1.0), 1.0)
    return v / (1.0 + c[0]) * (1.0 + (c[1] + c[2] * s) * s)


EFFECT = Effect(
    name="sensor_scale_bent",
    title="scale of the deformation sensor that bends",
    site="deformation",
    channels=(),
    parameters=(
        *STRAIGHT.parameters,
        Parameter("square", "-", neutral=0.0, low=-0.15, high=0.15, starts=(0.005,),
                  meaning="relative shortfall of the reading that grows with travel, at range_mm",
                  expected="within 0.0025, the linearity of an LVDT over its nominal range"),
        Parameter("cube", "-", neutral=0.0, low=-0.15, high=0.15, starts=(0.005,),
                  meaning="relative shortfall of the reading that grows with travel squared, at range_mm",
                  expected="within 0.0025, the linearity of an LVDT over its nominal range"),
        Parameter("range_mm", "mm", neutral=1.0, low=1e-4, high=1000.0, starts=(1.0,),
                  meaning="travel over which it is told", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="x = x_read / (1 + e) (1 + a s + b s^2),  s = x_read / range",
    source="Nyce, Linear Position Sensors, ch. 3",
    separating_test="calibrate the LVDT against gauge blocks (0, 0.25, 0.5, 0.75, 1 mm) without load",
    variant_of="sensor_scale",
)  # fmt: skip
