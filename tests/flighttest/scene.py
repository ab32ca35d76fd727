"""A made flight as a recording with estimates: levels held, then changed, with noise of known size."""

import numpy as np
from scipy.signal import lfilter

from thrustd.records.recording import make_recording

HOLD_S, CHANGE_S, HZ = 60, 15, 4
ENGINES = ("left", "right")
BIAS_STD_N = 40.0


def correlated(rng, n, tau):
    """Unit variance, correlation over `tau` samples."""
    keep = np.exp(-1 / tau)
    return lfilter([np.sqrt(1 - keep * keep)], [1, -keep], rng.standard_normal(n + round(10 * tau)))[-n:]


def held(levels):
    """Each level for HOLD_S, straight lines of CHANGE_S between them."""
    times, values = [], []
    for place, level in enumerate(levels):
        begin = place * (HOLD_S + CHANGE_S)
        times += [begin, begin + HOLD_S]
        values += [level, level]
    time_s = np.arange(0, times[-1], 1 / HZ)
    return time_s, np.interp(time_s, times, values)


def made_flight(machs=(0.25, 0.35, 0.45), seed=0, name="made.csv", estimates=True):
    """Every level of Mach with a thrust and an N1 of its own; constant altitude."""
    rng = np.random.default_rng(seed)
    time_s, mach = held(machs)
    n = len(time_s)
    columns = {
        "time_s": time_s,
        "mach": mach + 1e-4 * rng.standard_normal(n),
        "pressure_altitude_m": 3000 + rng.standard_normal(n),
        "sat_degC": np.full(n, -4.0),
        "accel_x_g": 0.05 + 0.0003 * rng.standard_normal(n),
        "accel_z_g": 1 + 0.003 * correlated(rng, n, 8),
        "pitch_deg": np.full(n, 3.0),
    }
    for place, engine in enumerate(ENGINES):
        thrust_n = 1000 + 5000 * mach + 100 * place
        columns |= {
            f"n1_pct_{engine}": 60 + 60 * mach + 0.02 * rng.standard_normal(n),
            f"n2_pct_{engine}": 80 + 20 * mach,
            f"fuel_flow_kg_s_{engine}": 0.02 + 2e-5 * thrust_n,
        }
        if estimates:
            columns |= {
                f"estimate_thrust_n_{engine}": thrust_n + 5 * correlated(rng, n, 8),
                f"estimate_thrust_std_n_{engine}": np.full(n, BIAS_STD_N),
                f"estimate_mount_n_{engine}": thrust_n,
                f"estimate_brochure_n_{engine}": thrust_n + 80,
                f"estimate_brochure_std_n_{engine}": np.full(n, 150.0),
                f"estimate_status_{engine}": np.zeros(n),
                f"estimate_load_share_{engine}": np.full(n, 0.46),
                f"estimate_thrust_rate_n_s_{engine}": np.zeros(n),
            }
    return make_recording(name, columns)
