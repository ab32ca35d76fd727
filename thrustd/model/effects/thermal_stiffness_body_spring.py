"""Stiffness of the spring itself that follows the temperature of a body: friction beside it does not.

    w = f(x) (1 + y + bend y^2 / 2),    y = stiffness_1_k * (T_m - reference_degc)

The step of `thermal_stiffness_body`, in front of the relaxation instead of behind it, as `thermal_stiffness_spring` is
to `thermal_stiffness_late`. A variant of `thermal_stiffness`.
"""

from dataclasses import replace

from thrustd.model.effects.thermal_stiffness_body import EFFECT as GAIN

EFFECT = replace(
    GAIN,
    name="thermal_stiffness_body_spring",
    title="stiffness of the spring that follows the temperature of a body",
    site="spring",
    equation="w = f(x) (1 + y + b y^2 / 2),  y = k (T_m - T_ref),  T_m the mean of a slab whose faces warm after T",
)
