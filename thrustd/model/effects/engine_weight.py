"""Engine weight: load across the mount stiffens it along the engine axis, so the same thrust deforms it less.

    force = core force * (1 + k * weight_n_1g * (accel_z_g - 1)),    k = stiffening per newton of weight on this mount

Thesis section 12.1.2: 500 N more weight on a mount makes the thrust deformation 5 um smaller at 6 kN, about 30 N; k =
30 N / 6000 N / 500 N = 1e-5 1/N. The two front mounts carry 2162 N at 1 g (eq. 4.5), 1081 N each. The reference is 1
g because that is where a mount is when it is identified in the aircraft; a bench record without weight has its own
gain, which the output curve holds. Left out: lateral load.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

MOUNT_WEIGHT_N = 1081.0  # half of 2162 N, thesis eq. 4.5


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v * (1.0 + c[0] * (u[0] - 1.0))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["stiffening_1_n"] * MOUNT_WEIGHT_N])


EFFECT = Effect(
    name="engine_weight",
    title="engine weight on the mount (load factor)",
    site="gain",
    channels=("accel_z_g",),
    parameters=(
        Parameter("stiffening_1_n", "1/N", neutral=0.0, low=-1e-3, high=1e-3, starts=(1e-5,),
                  meaning="relative stiffening per newton of engine weight",
                  expected="1e-5 1/N (5 um less at 6 kN per 500 N)"),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="F = F_core (1 + k W_1g (f_z - 1))",
    source="thesis section 12.1.2 and eq. 4.5",
    separating_test="steady turns at 1.5 to 2 g or a push-over at constant thrust",
)  # fmt: skip
