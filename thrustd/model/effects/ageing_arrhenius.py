"""Ageing by a dose of heat: hours count for more when the rubber is warm (Arrhenius), and the later ones for less.

    force = core force * (1 + ageing_1_h * settled hours),    settled hours = settling_h * ln(1 + D / settling_h)
    D = integral of exp(E / R (1 / 296 K - 1 / T)) dt in hours since reference_s,    T: temperature_degC + 273.15 K

A variant of `ageing`. D are the hours at 23 degC that age as much; ageing_1_h is the rate at 23 degC and at the
reference time, positive: hardening. After-cure and physical ageing go with the logarithm of time; with a settling time
far longer than the recording it is a straight line of the dose. E is 60 to 120 kJ/mol for oxidation of rubber, a factor
of two per 8 to 4 K. A run that begins after the reference time takes the hours before it at the temperature that it
begins with. Left out: recovery at rest, oxygen that comes too slowly.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.ageing import EFFECT as BY_TIME
from thrustd.model.elsewhere import TEMPERATURE
from thrustd.model.stage import Floats, jit

R_KJ_MOL_K = 8.314462618e-3
ZERO_DEGC_K = 273.15
ROOM_K = 296.15
STEEPEST = 30.0  # of the exponent: what a broken sensor reads is no heat


@jit
def _speed(activation_k: float, temperature_degc: float) -> float:
    """Hours at room temperature that one hour at this temperature is worth."""
    kelvin = max(temperature_degc + ZERO_DEGC_K, 1.0)
    return math.exp(max(-STEEPEST, min(STEEPEST, activation_k * (1.0 / ROOM_K - 1.0 / kelvin))))


@jit
def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = max(0.0, u[0] - c[1]) * _speed(c[3], u[1])
    x[1] = u[0]


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] += max(0.0, u[0] - max(x[1], c[1])) * _speed(c[3], u[1])
    x[1] = u[0]
    return v * (1.0 + c[0] * math.log(1.0 + x[0] / c[2]))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    settling_h = p["settling_h"]
    activation_k = p["activation_kj_mol"] / R_KJ_MOL_K
    return np.array([p["ageing_1_h"] * settling_h, p["reference_s"], 3600.0 * settling_h, activation_k])


EFFECT = Effect(
    name="ageing_arrhenius",
    title="stiffness that changes with a dose of heat",
    site="gain",
    channels=(*BY_TIME.channels, TEMPERATURE),
    parameters=(
        *BY_TIME.parameters,
        Parameter("activation_kj_mol", "kJ/mol", neutral=80.0, low=0.0, high=200.0, starts=(80.0,),
                  meaning="activation energy: how much faster it goes when warm", expected="60 to 120 kJ/mol",
                  amplitude=False, spread=20.0),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core (1 + k T ln(1 + D / T)),  dD/dt = exp(E / R (1 / 296 K - 1 / T_r))",
    source="Celina, Gillen & Assink, Polym. Degrad. Stab. 90 (2005) 395; Struik, Physical Aging, 1978",
    separating_test="hold 5 kN for two hours at 20 and two at 60 degC, then back at 20: what stays is ageing",
    initial=initial,
    variant_of="ageing",
)  # fmt: skip
