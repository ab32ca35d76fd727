"""A tethered static run: the aircraft stands, held by a load cell, and its engines are run up, apart and together."""

import numpy as np

from thrustd.core.atmosphere import ZERO_CELSIUS_K
from thrustd.core.columns import Floats
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.engine import IDLE_N1_PCT, Health, engine_columns, spool_rate_pct_s

HZ = 20.0
OFF_S, EXERCISE_S, HOLD_S, COOLING_S = 30.0, 30.0, 40.0, 120.0
FULL_PCT = 96.0
LEVELS_PCT = (50.0, 65.0, 80.0, 92.0, 70.0, IDLE_N1_PCT)
TOGETHER_PCT = (60.0, 85.0, 96.0, 75.0, IDLE_N1_PCT)
CELL_STD_N, CELL_ZERO_N = 15.0, 20.0  # noise; zero and wheels


def static_run(seed: int, healths: tuple[Health, ...]) -> tuple[Recording, Recording]:
    """Profile of the aircraft, and the load cell's record.

    Both engines to full power once, left engine in steps, right engine in steps, both together, engines off.
    """
    rng = np.random.default_rng([seed, 8])
    idle = IDLE_N1_PCT
    phases = [(OFF_S, 0.0, 0.0), (20.0, idle, 0.0), (20.0, idle, idle), (EXERCISE_S, FULL_PCT, FULL_PCT)]
    phases += [(HOLD_S, level, idle) for level in LEVELS_PCT] + [(HOLD_S, idle, level) for level in LEVELS_PCT]
    phases += [(HOLD_S, level, level) for level in TOGETHER_PCT] + [(COOLING_S, 0.0, 0.0)]
    wanted = np.repeat(np.array(phases)[:, 1:], [round(phase[0] * HZ) for phase in phases], axis=0)
    time_s = np.arange(len(wanted)) / HZ
    still = np.zeros(len(time_s))
    static_k = still + float(rng.uniform(278.0, 298.0))
    columns = {
        "time_s": time_s, "mach": still, "pressure_altitude_m": still, "sat_degC": static_k - ZERO_CELSIUS_K,
        "tat_degC": static_k - ZERO_CELSIUS_K, "accel_x_g": still, "accel_y_g": still, "accel_z_g": still + 1.0,
        "pitch_deg": still,
    }  # fmt: skip
    for number, (side, health) in enumerate(zip(("left", "right"), healths, strict=True)):
        engine = engine_columns(time_s, _spooled(wanted[:, number]), (still, still, static_k), health)
        columns |= {f"{name}_{side}": column for name, column in engine.items()}
    profile = make_recording(f"static_seed{seed}", columns, {"source": "twin static run", "seed": str(seed)})
    pull_n = profile["thrust_N_left"] + profile["thrust_N_right"]
    cell_n = pull_n + CELL_ZERO_N * rng.standard_normal() + CELL_STD_N * rng.standard_normal(len(time_s))
    return profile, make_recording(f"cell_seed{seed}", {"time_s": time_s, "force_N": cell_n})


def _spooled(wanted_pct: Floats) -> Floats:
    n1_pct, now = np.empty_like(wanted_pct), 0.0
    for i, wanted in enumerate(wanted_pct.tolist()):
        now += spool_rate_pct_s(now, wanted, 0.0) / HZ
        n1_pct[i] = now
    return n1_pct
