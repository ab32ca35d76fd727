"""Free play that the load takes up: a joint that is loose when unloaded and tight above a certain load.

    x = r + gap_mm * s,    s = clip((l - taken_up_mm) / width_mm + 1/2, 0, 1)
    l = r + fading (r - lag(r)),    lag: first-order, fades_s;    x = reading, r = deformation of the rubber

While the joint closes, the transducer moves by the gap and the rubber hardly: a flat stretch in the curve of force
over reading, in both directions. The joint closes at a load, which is the rubber's, and the load that goes with a
deformation fades as the rubber relaxes: l stands for it, with one lag for all of the rubber's. x grows with r, one
line in each of the three parts of the clip: r follows from x in closed form. A gap that closes over most of the
travel would be a scale: width_mm stays within a factor of e of its starts. No hysteresis: what is left of it is
`free_play`, of which this is a variant. Left out: the elasticity of the contact.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    fading = c[3] * (1.0 - c[4])  # of the lag as it will be after this sample
    rise, level = (1.0 + fading) / c[2], 0.5 - (fading * x[0] + c[1]) / c[2]
    rubber = min(max((v - c[0] * level) / (1.0 + c[0] * rise), v - c[0]), v)
    x[0] += c[4] * (rubber - x[0])
    return rubber


def begin(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """At rest nothing fades any more: l is r."""
    closing = (v - c[0] * (0.5 - c[1] / c[2])) / (1.0 + c[0] / c[2])
    x[0] = min(max(closing, v - c[0]), v)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["gap_mm"], p["taken_up_mm"], p["width_mm"], p["fading"], -math.expm1(-dt_s / p["fades_s"])])


EFFECT = Effect(
    name="free_play_taken_up",
    title="free play that is taken up at a load",
    site="deformation",
    channels=(),
    parameters=(
        Parameter("gap_mm", "mm", neutral=0.0, low=0.0, high=10.0, starts=(0.02,),
                  meaning="travel of the joint from loose to tight",
                  expected="0 for a bonded rubber mount; up to 0.1 mm in a worn bolt"),
        Parameter("taken_up_mm", "mm", neutral=0.3, low=-1000.0, high=1000.0,
                  starts=(0.15, 0.25, 0.35, 0.5, 0.65, 0.8, 0.95),
                  meaning="deformation of the rubber at which the joint is half closed", amplitude=False),
        Parameter("width_mm", "mm", neutral=0.1, low=1e-4, high=1000.0, starts=(0.15, 0.05),
                  meaning="deformations of the rubber between open and closed", amplitude=False, e_folds=1.0),
        Parameter("fading", "-", neutral=0.1, low=0.0, high=2.0, starts=(0.1,),
                  meaning="share of the load at one deformation that fades", amplitude=False, spread=0.1),
        Parameter("fades_s", "s", neutral=30.0, low=0.01, high=10000.0, starts=(30.0,),
                  meaning="time constant by which it fades", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="x = r + g clip((r + a (r - lag(r)) - x_0) / b + 1/2, 0, 1)",
    source="Nordin & Gutman, Automatica 38 (2002) 1633; Brokate & Sprekels, Hysteresis and Phase Transitions, 1996",
    separating_test="load slowly from zero through the suspected load and back: the force stands still while x moves",
    initial=begin,
    variant_of="free_play",
)  # fmt: skip
