"""Engine weight as a couple: normal load adds to what one mount holds and takes it from the other, whatever the thrust.

    thrust share = mount force - couple_n_g * (accel_z_g - 1)

Where the centre of gravity lies off the line of the mounts, the weight is a couple (thesis 4.4). What 1 g makes of it
is in the mount's zero, the rest comes and goes with the load factor and is held by the rubber like a load: it relaxes
with it, so it is taken off the force and not off the deformation. A variant of `engine_weight`. Positive: more load
factor loads this mount. Left out: lateral acceleration.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (u[0] - 1.0)


EFFECT = Effect(
    name="engine_weight_couple",
    title="couple of the engine's weight on the mount",
    site="force",
    channels=("accel_z_g",),
    parameters=(
        Parameter("couple_n_g", "N/g", neutral=0.0, low=-1e4, high=1e4, starts=(300.0,),
                  meaning="load that the couple of the weight puts on this mount, per g",
                  expected="1.2 to 1.4 kN/g where the engine hangs as a rigid body, else by the centre of gravity"),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="F = F_mount - b (n - 1)",
    source="thesis section 4.4; statics of a rigid body on three springs",
    separating_test="turns at constant N1, 1 to 2 g, at idle and at full thrust: the same change in N at both",
    variant_of="engine_weight",
)  # fmt: skip
