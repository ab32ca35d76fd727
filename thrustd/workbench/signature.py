"""The signature of an effect: the force it adds while a mount goes through one standard programme.

Ten minutes: a step from 1 to 5 kN at a spring of 5000 N/mm, a slow triangle, a step back; meanwhile every channel an
effect may read makes a movement of its own. The effect's own compiled step runs, with the parameters found in the data.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from thrustd.core.signals import CATALOGUE
from thrustd.model.effect import Effect
from thrustd.workbench.figures import short
from thrustd.workbench.pyramid import Floats

DT_S = 0.1
SECONDS = 600.0
STIFFNESS_N_MM = 5000.0  # a front isolator, thesis table 4.1
POINTS = 300


def signature_of(effect: Effect, parameters: Mapping[str, float]) -> dict[str, Any]:
    """Lines to draw: the programme's force, and the force the effect adds to it (N) over time (s)."""
    t = np.arange(0.0, SECONDS, DT_S)
    deformation = np.interp(t, [0, 60, 62, 240, 320, 400, 480, 482, 600], [0.2, 0.2, 1, 1, 0.3, 1, 1, 0.2, 0.2])
    columns = {name: _channel(name, t, deformation) for name in effect.channels}
    scale = STIFFNESS_N_MM if effect.site == "deformation" else 1.0
    entering = np.ascontiguousarray(deformation * STIFFNESS_N_MM / scale)
    stage = effect.stage(effect.neutral() | dict(parameters), DT_S)
    leaving = stage.from_rest(columns, entering)
    step = len(t) // POINTS
    return {
        "time_s": short(t[::step]),
        "programme_n": short(deformation[::step] * STIFFNESS_N_MM),
        "added_n": short(((leaving - entering) * scale)[::step]),
    }


def _channel(name: str, t: Floats, deformation: Floats) -> Floats:
    """The standard movement of one channel (n,)."""
    moved: dict[str, Floats] = {
        "deformation_mm": deformation,
        "time_s": t,
        "accel_x_g": 0.1 * np.sin(2 * np.pi * t / 120),
        "accel_y_g": 0.05 * np.sin(2 * np.pi * t / 90),
        "accel_z_g": 1 + 0.3 * np.sin(2 * np.pi * t / 150),
        "temperature_degC": 20 + 25 * t / SECONDS,
        "vibration_mm_s": np.where(t > 300, 15.0, 2.0),
        "dynamic_pressure_Pa": 8000 * t / SECONDS,
        "mach": 0.4 * t / SECONDS,
    }
    if name in moved:
        return moved[name]
    signal = CATALOGUE.get(name)
    low, high = (max(signal.low, 0.0), signal.high / 2) if signal else (0.0, 1.0)
    return low + (high - low) * t / SECONDS
