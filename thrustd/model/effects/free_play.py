"""Free play (backlash) in the load path: after a reversal the joint moves through its gap before the mount follows.

    deformation of the mount = x - gap_mm / 2 * s,    s <- clip(s + dx / travel_mm, -1, 1),    x = reading

s says on which side of its gap the joint rests. With travel_mm = gap_mm / 2 this is the play operator
clip(p, x - gap / 2, x + gap / 2); a joint that snaps through its gap has a shorter travel. Loading shows less force
than unloading at the same reading, the opposite sign to friction. A negative gap is lost motion between mount and LVDT:
the reading lags the mount, loading shows more force, as friction does; then only the width of the turn-over tells them
apart. gap 0 returns the reading untouched. Starts in the middle of the gap. Left out: elasticity of the contact and a
gap that only opens at zero load (a jump in the input curve represents that).
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_signal
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = min(max(x[1] + (v - x[0]) * c[1], -1.0), 1.0)
    x[0] = v
    return v - c[0] * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([0.5 * p["gap_mm"], 1.0 / p["travel_mm"]])


EFFECT = Effect(
    name="free_play",
    title="free play in the load path",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("gap_mm", "mm", neutral=0.0, low=-10.0, high=10.0, starts=(0.02,),
                  meaning="total gap; negative: lost motion of the LVDT",
                  expected="0 for a bonded rubber mount; up to 0.05 mm in worn bolts"),
        Parameter("travel_mm", "mm", neutral=0.01, low=0.0005, high=10.0, starts=(0.002, 0.01, 0.03),
                  meaning="deformation over which the joint crosses half its gap", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="x_mount = x - g/2 s,  s = clip(s + dx/travel, -1, 1)",
    source=(
        "Brokate & Sprekels, Hysteresis and Phase Transitions, 1996, ch. 2.1; Nordin & Gutman, "
        "Automatica 38 (2002) 1633"
    ),
    separating_test=(
        "reverse slowly by less than the suspected gap at 1 and at 5 kN: the reading moves, the force does not"
    ),
    initial=begin_at_signal,
)  # fmt: skip
