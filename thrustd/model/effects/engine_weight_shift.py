"""Engine weight seen by the transducer: normal load moves the reading, in proportion to it and by a couple.

    deformation of the mount = x / (1 - (stretch_1_g + more_1_g_mm2 x^2) (n - 1)) + shift_mm_g (n - 1),    n = accel_z_g

The weight that hangs on the isolators takes part of the deformation that the same thrust would make (thesis 12.1.2:
5 um less for 500 N at 6 kN: the reading has to be stretched), and where the centre of gravity lies off the line of the
mounts it is a couple: one mount is loaded, the other unloaded, whatever the thrust. A variant of `engine_weight`, which
puts the same on the force. Positive stretch: more weight, smaller reading. A stretch in proportion to the force grows
faster than the reading of a spring that stiffens: more_1_g_mm2. The reading is the deformation less what weight took
of it, hence the fraction: at 3 g and 5 % a product would be 1 % off. Left out: lateral acceleration.
"""

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

LEAST = 0.1  # of the deformation that is left to read


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    more = u[0] - 1.0
    return v / max(1.0 - (c[0] + c[2] * v * v) * more, LEAST) + c[1] * more


EFFECT = Effect(
    name="engine_weight_shift",
    title="engine weight that moves the reading",
    site="deformation",
    channels=("accel_z_g",),
    parameters=(
        Parameter("stretch_1_g", "1/g", neutral=0.0, low=-0.5, high=0.5, starts=(0.01,),
                  meaning="share by which the reading is too small per g of normal load",
                  expected="0.01: 5 um for 500 N at 1.1 mm"),
        Parameter("shift_mm_g", "mm/g", neutral=0.0, low=-5.0, high=5.0, starts=(0.01,),
                  meaning="deformation hidden by the couple of the weight, per g",
                  expected="by the offset of the centre of gravity"),
        Parameter("more_1_g_mm2", "1/g/mm^2", neutral=0.0, low=-1.0, high=1.0, starts=(0.002,),
                  meaning="by how much more it stretches where the spring is stiffer"),
    ),
    step=step,
    prepare=None,
    n_state=0,
    equation="x_mount = x / (1 - (a + c x^2) (n - 1)) + b (n - 1)",
    source="thesis section 12.1.2",
    separating_test="weights on the bench, or turns at constant N1: 1 to 2 g at idle (couple), at full thrust (both)",
    variant_of="engine_weight",
)  # fmt: skip
