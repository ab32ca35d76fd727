"""Nacelle drag: air presses on the nacelle, so the mounts carry thrust minus drag.

    thrust share = mount force + drag_area_m2 * dynamic_pressure_Pa

Positive area: drag pulls backwards and the mounts feel less than the engine makes. drag_area is c_D times frontal
area, shared over the mounts: about 0.02 m2 for a nacelle of 1.2 m2 with c_D 0.035, half to each front mount. Valid at
small incidence below drag rise. Left out: dependence on Mach number, incidence and spillage, buoyancy of the pylon's
flow.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v + c[0] * u[0]


EFFECT = Effect(
    name="nacelle_drag",
    title="drag of the nacelle",
    site="force",
    channels=("dynamic_pressure_Pa",),
    parameters=(
        Parameter("drag_area_m2", "m2", neutral=0.0, low=-0.5, high=0.5, starts=(0.02,),
                  meaning="drag area on this mount",
                  expected="about 0.02 m2: c_D 0.035 of 1.2 m2, shared by two mounts"),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="F = F_mount + (c_D A) q",
    source="Hoerner, Fluid-Dynamic Drag, ch. 9 and 13",
    separating_test="level acceleration from 130 to 250 kt at constant N1, inertia known from accel_x_g",
)  # fmt: skip
