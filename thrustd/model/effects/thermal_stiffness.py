"""Thermal stiffness: rubber changes its modulus with temperature, so the same deformation means another force.

    force = core force * (1 + y + bend y^2 / 2),    y = stiffness_1_k * (temperature_degC - reference_degC)

Negative: softer when warm. Near and above room temperature rubber elasticity itself stiffens (modulus proportional to
absolute temperature, +0.34 %/K), filler and viscosity soften. The isolator's specification allows up to 30 % more
dynamic stiffness at -7 degC, that is about -1.1 %/K below room temperature; the thesis saw nothing measurable from 30
to 80 degC. bend: 0 for a straight line, 1 for a modulus that falls exponentially, as that of filled rubber in the cold.
Valid for some 40 K either side of the reference. Left out: WLF shift of the relaxation times, heating from within.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    y = c[0] * (u[0] - c[1])
    return v * (1.0 + y + 0.5 * c[2] * y * y)


EFFECT = Effect(
    name="thermal_stiffness",
    title="stiffness that changes with temperature",
    site="gain",
    channels=("temperature_degC",),
    parameters=(
        Parameter("stiffness_1_k", "1/K", neutral=0.0, low=-0.03, high=0.03, starts=(-0.003,),
                  meaning="relative stiffness per kelvin",
                  expected="0 to -0.011 1/K (30 % stiffer at -7 degC); unmeasurable from 30 to 80 degC in the thesis"),
        Parameter("reference_degc", "degC", neutral=20.0, low=-60.0, high=150.0, starts=(20.0,),
                  meaning="temperature when the model was identified", amplitude=False, spread=10.0),
        Parameter("bend", "-", neutral=0.0, low=-10.0, high=10.0, starts=(0.0,),
                  meaning="0: a straight line; 1: exponential", amplitude=False, spread=1.0),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="F = F_core (1 + y + b y^2 / 2),  y = k (T - T_ref)",
    source="Treloar, The Physics of Rubber Elasticity, 3rd ed., ch. 2; specification quoted in the thesis",
    separating_test=(
        "warm the mount by 20 K at two constant forces (0 and 5 kN): no change at 0, a proportional one at 5 kN"
    ),
)  # fmt: skip
