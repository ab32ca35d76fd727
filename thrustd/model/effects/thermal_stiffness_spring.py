"""Stiffness of the spring itself that follows the temperature late: friction beside it does not.

    w = f(x) (1 + k (T_m - T_ref))

The step of `thermal_stiffness_late`, in front of the relaxation instead of behind it: a change of stiffness is
remembered like a change of deformation. A variant of `thermal_stiffness`.
"""

from dataclasses import replace

from thrustd.model.effects.thermal_stiffness_late import EFFECT as GAIN

EFFECT = replace(
    GAIN,
    name="thermal_stiffness_spring",
    title="stiffness of the spring that follows the temperature late",
    site="spring",
    equation="w = f(x) (1 + y + b y^2 / 2),  y = k (T_m - T_ref),  T_m of two nodes that warm after T",
    variant_of="thermal_stiffness",
)
