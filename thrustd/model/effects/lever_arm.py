"""Lever arm of the accelerometer: where the aircraft turns it feels what the engine does not.

    f_sensor = f_engine + (omega_dot x r + omega x (omega x r)) / g0          r: from the engine to the sensor
    thrust share = mount force + m g0 f_sensor,x - m [q_dot z - r_dot y - (q^2 + r^2) x + p q y + p r z]

p, q, r: roll, pitch, yaw rate (right wing down, nose up, nose right); x forward, y right, z down. Parameters are first
moments, mass on this mount times distance, so that they can be estimated as they stand and an unknown one is 0. Rates
become accelerations behind a first-order low-pass. On PH-LAB's recordings: 10 to 15 N RMS, 326 N at most, for 373 kg at
2 m. Left out: the aircraft that bends between sensor and engine. Source: Klein & Morelli 2006, section 10.2.2.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

RAD = np.pi / 180.0


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    q, p, r = c[5] * u[0], c[5] * u[1], c[5] * u[2]
    x[2] = c[3] * x[2] + c[4] * (q - x[0])
    x[3] = c[3] * x[3] + c[4] * (r - x[1])
    x[0], x[1] = q, r
    return v + c[0] * (q * q + r * r) + c[1] * (x[3] - p * q) - c[2] * (x[2] + p * r)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    moments = p["forward_kg_m"], p["right_kg_m"], p["down_kg_m"]
    return np.array([*moments, decay, (1.0 - decay) / dt_s, RAD])


def begin(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """The rates have been so for long."""
    x[0], x[1], x[2], x[3] = c[5] * u[0], c[5] * u[2], 0.0, 0.0


def _moment(name: str, way: str) -> Parameter:
    return Parameter(
        name, "kg m", neutral=0.0, low=-5000.0, high=5000.0, starts=(100.0,),
        meaning=f"mass on this mount times how far the accelerometer is {way} of the engine",
        expected="172 kg on an upper, 201 kg on a lower mount times the distance",
    )  # fmt: skip


EFFECT = Effect(
    name="lever_arm",
    title="accelerometer away from the engine",
    site="force",
    channels=("pitch_rate_deg_s", "roll_rate_deg_s", "yaw_rate_deg_s"),
    parameters=(
        _moment("forward_kg_m", "forward"), _moment("right_kg_m", "right"), _moment("down_kg_m", "below"),
        Parameter("filter_s", "s", neutral=0.1, low=0.005, high=10.0, starts=(0.1,),
                  meaning="low-pass of the angular accelerations", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=4,
    equation="F = F_mount + m g0 f_x - m (omega_dot x r + omega x (omega x r))_x",
    source="Klein & Morelli 2006, section 10.2.2",
    separating_test="pitch doublets and steady turns at constant thrust and speed",
    initial=begin,
)  # fmt: skip
