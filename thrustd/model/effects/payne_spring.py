"""Payne's softening of the spring itself: what relaxes is softened, friction beside it is not.

    w = f(x) (1 - s p), p = (V/Vc)^2m / (1 + (V/Vc)^2m)

The step of `payne`, in front of the relaxation instead of behind it: a change of stiffness is remembered like a change
of deformation. A variant of `payne`.
"""

from dataclasses import replace

from thrustd.model.effects.payne import EFFECT as GAIN

EFFECT = replace(
    GAIN,
    name="payne_spring",
    title="softening of the spring by vibration (Payne)",
    site="spring",
    equation="w = f(x) (1 - s p),  p = (V/Vc)^2m / (1 + (V/Vc)^2m)",
    variant_of="payne",
)
