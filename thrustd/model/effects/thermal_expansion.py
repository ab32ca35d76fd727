"""Thermal expansion: the mount and what holds it grow with temperature, and the LVDT reads that growth as deformation.

    true deformation = reading - expansion_mm_k * (temperature_degC - reference_degC)

A positive coefficient means that warming makes the reading larger. An offset in millimetres, the same at every force:
that tells it from thermal stiffness, which scales with force. The thesis measured 0.0095 mm/K on its bench between 30
and 80 degC (section 12.2); in the aircraft mount and pylon differ, the sign may as well. Valid for slow temperature,
when one sensor speaks for the whole mount. Left out: gradients inside the rubber and the lag of the temperature
sensor.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (u[0] - c[1])


EFFECT = Effect(
    name="thermal_expansion",
    title="thermal expansion between the LVDT and the mount",
    site="deformation",
    channels=("temperature_degC",),
    parameters=(
        Parameter("expansion_mm_k", "mm/K", neutral=0.0, low=-0.1, high=0.1, starts=(0.003,),
                  meaning="reading per kelvin at constant force", expected="0.0095 mm/K on the bench of the thesis"),
        Parameter("reference_degc", "degC", neutral=20.0, low=-60.0, high=150.0, starts=(20.0,),
                  meaning="temperature when the model was identified", amplitude=False, spread=10.0),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="x = x_read - a (T - T_ref)",
    source="thesis section 12.2: 0.0095 mm/K on its bench",
    separating_test="warm the mount by 20 K at two constant forces (0 and 5 kN): the same shift in mm at both",
)  # fmt: skip
