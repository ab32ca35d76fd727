"""Engine weight that stiffens late and not in proportion: a mount settles under the load across it before it answers.

    force = core force * (1 + k W (m + bend m^2)),    m = n - 1,  n: accel_z_g low-passed with lag_s,  W: weight at 1 g

A variant of `engine_weight`. What changes the stiffness along the engine is how far the weight has pushed the rubber
across, which follows the load as late as rubber and suspension do; and the stiffness of a bearing falls with the square
of the load across it rather than in proportion. Left out: how it depends on the thrust.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.engine_weight import MOUNT_WEIGHT_N
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = u[0] + c[1] * (x[0] - u[0])
    m = x[0] - 1.0
    return v * (1.0 + c[0] * (m + c[2] * m * m))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["stiffening_1_n"] * MOUNT_WEIGHT_N, np.exp(-dt_s / p["lag_s"]), p["bend"]])


EFFECT = Effect(
    name="engine_weight_late",
    title="engine weight on the mount, late and bent",
    site="gain",
    channels=("accel_z_g",),
    parameters=(
        Parameter("stiffening_1_n", "1/N", neutral=0.0, low=-1e-3, high=1e-3, starts=(1e-5,),
                  meaning="relative stiffening per newton of engine weight, at 1 g",
                  expected="1e-5 1/N (5 um less at 6 kN per 500 N)"),
        Parameter("lag_s", "s", neutral=0.5, low=1e-3, high=1000.0, starts=(0.5,),
                  meaning="by which the rubber follows the load across it", amplitude=False),
        Parameter("bend", "-", neutral=0.0, low=-10.0, high=10.0, starts=(0.0,),
                  meaning="of the square of a change of 1 g, beside the change", amplitude=False, spread=1.0),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_core (1 + k W_1g (m + b m^2)),  m = lowpass(f_z) - 1",
    source="Koh & Kelly, Int. J. Mech. Sci. 30 (1988) 933",
    separating_test="pull-ups of several sizes at constant thrust, held for a minute",
    initial=begin_at_channel,
    variant_of="engine_weight",
)  # fmt: skip
