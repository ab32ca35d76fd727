"""Payne effect: shaking breaks up the filler network of the rubber, so it softens while it vibrates.

    force = core force * (1 - softening * p),    p = (V / Vc)^(2m) / (1 + (V / Vc)^(2m)),    V = vibration_mm_s

Kraus' law for the storage modulus, G = G_inf + (G_0 - G_inf) / (1 + (a / a_c)^2m), with velocity at the running speed
for amplitude a. softening is (G_0 - G_inf) / G_0. Recovers when the shaking stops; scales with force, unlike
vibration rectification, and follows the present vibration, unlike Mullins, which follows the largest load ever. The
thesis saw none for radial vibration on axial stiffness. Valid for filled rubber; left out: frequency of the
vibration, the time it takes (see `payne_recovering`).
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    broken = (abs(u[0]) / c[1]) ** c[2]
    return v * (1.0 - c[0] * (broken / (1.0 + broken)))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["softening"], p["vibration_c_mm_s"], 2.0 * p["exponent_m"]])


EFFECT = Effect(
    name="payne",
    title="softening by vibration (Payne)",
    site="gain",
    channels=("vibration_mm_s",),
    parameters=(
        Parameter("softening", "-", neutral=0.0, low=0.0, high=0.9, starts=(0.03,),
                  meaning="relative loss of stiffness under full vibration",
                  expected="0 to 0.3 for filled rubber sheared along the vibration"),
        Parameter("vibration_c_mm_s", "mm/s", neutral=10.0, low=0.05, high=1000.0, starts=(30.0, 10.0, 3.0, 100.0),
                  meaning="vibration that breaks half of the network", amplitude=False),
        Parameter("exponent_m", "-", neutral=0.6, low=0.3, high=1.2, starts=(0.6,),
                  meaning="Kraus exponent m", amplitude=False, spread=0.15),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="F = F_core (1 - s p),  p = (V/Vc)^2m / (1 + (V/Vc)^2m)",
    source="Kraus, J. Appl. Polym. Sci. Symp. 39 (1984) 75; Lion & Kardelky, Int. J. Plasticity 20 (2004) 1313",
    separating_test=(
        "vibrate (0, 10, 50, 100 mm/s) at two constant forces (0 and 5 kN): no change at 0, a proportional one at 5 kN"
    ),
)  # fmt: skip
