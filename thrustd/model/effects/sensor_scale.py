"""Sensor scale: the LVDT's millimetres are not the bench's (another transducer, conditioner or excitation voltage).

    true deformation = reading / (1 + scale_error)

Positive: it reads too much. Zero stays where it is. Because it scales deformation and not force, a stiffening mount
shows it a little differently from a change of stiffness or of load-cell gain; on a nearly straight force curve
nothing separates the three but a calibration. Valid for errors of up to a fifth. Left out: nonlinearity of the
transducer (`sensor_scale_bent`).
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v / (1.0 + c[0])


EFFECT = Effect(
    name="sensor_scale",
    title="scale of the deformation sensor",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("scale_error", "-", neutral=0.0, low=-0.5, high=0.5, starts=(0.02,),
                  meaning="relative excess of the reading", expected="within 0.005 for a calibrated LVDT"),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="x = x_read / (1 + e)",
    source="Nyce, Linear Position Sensors, ch. 3",
    separating_test="calibrate the LVDT against gauge blocks (0, 0.5, 1 mm) without load",
)  # fmt: skip
