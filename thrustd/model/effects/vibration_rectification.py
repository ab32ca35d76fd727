"""Vibration rectification: a shaking LVDT or a stiffening mount turns vibration into a steady shift.

    true deformation = reading - shift_mm * (vibration_mm_s / 100 mm/s)^exponent

Averaging a curve k(x) over a vibration of amplitude a adds k'' a^2 / 4: an even power, normally the square. An offset
in millimetres at every force, unlike Payne's softening that scales with force. The thesis saw no shift for radial
vibration up to 540 Hz. Valid while the vibration's frequency is far above what the LVDT channel passes. Left out:
dependence on frequency.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (abs(u[0]) * 0.01) ** c[1]


EFFECT = Effect(
    name="vibration_rectification",
    title="steady shift by vibration",
    site="deformation",
    channels=("vibration_mm_s",),
    parameters=(
        Parameter("shift_mm", "mm", neutral=0.0, low=-1e9, high=1e9, starts=(0.01,), level=100.0,
                  meaning="shift at 100 mm/s", expected="0: the thesis saw none"),
        Parameter("exponent", "-", neutral=2.0, low=1.0, high=2.0, starts=(2.0, 1.0),
                  meaning="power of the vibration", amplitude=False),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="x = x_read - s (V / 100 mm/s)^p",
    source="second-order expansion of the static curve; thesis section 12.1.1",
    separating_test="vibrate (0, 50, 100 mm/s) at two constant forces: the same shift in mm at both",
)  # fmt: skip
