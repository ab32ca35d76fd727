"""A second mount for the blind benchmark: forward physics of its own, sharing no code with the effects or the twin.

Force in, deformation out: quasi-linear viscoelastic with three relaxation times and a cubic spring, solved for the
deformation by Newton sample by sample; friction is a set of sliders on the deformation, creep a Boltzmann sum of past
increments, every disturbance acts where it would in the aircraft. Seeded; 20 Hz; LVDT in steps of 5 mm / 2^16; load
cell 12 N.
"""

import numpy as np
from numba import njit

DT_S = 0.05
LOAD_CELL_N = 12.0
LSB_MM = 5.0 / 2**16
G0 = 9.80665
ROOM_DEGC = 21.0


def steps(rng, hours, low=400.0, high=6500.0, hold=(60.0, 300.0), ramp=(1.0, 6.0)):
    n = int(hours * 3600 / DT_S)
    force = np.empty(n)
    k, level = 0, 0.0
    while k < n:
        target = rng.uniform(low, high)
        m = int(rng.uniform(*ramp) / DT_S) + 1
        piece = np.concatenate((np.linspace(level, target, m), np.full(int(rng.uniform(*hold) / DT_S), target)))[
            : n - k
        ]
        force[k : k + len(piece)] = piece
        k, level = k + len(piece), target
    return force


def wave(rng, n, tau_s, size):
    """Smooth random signal with correlation time tau_s."""
    a = np.exp(-DT_S / tau_s)
    noise = rng.normal(size=n)
    smooth = _smooth(_smooth(noise, a), a)
    return size * smooth / np.std(smooth)


@njit
def _smooth(w, a):
    out = np.empty_like(w)
    y, gain = 0.0, np.sqrt(1 - a * a)
    for k in range(w.size):
        y = a * y + gain * w[k]
        out[k] = y
    return out


@njit
def _mount(force, stiffness, cubic, shares, keeps, dashpot):
    """Deformation from force: QLV relaxation solved forward with an explicit elastic inverse by Newton."""
    out = np.empty_like(force)
    state = np.zeros(shares.size)
    elastic_old, x, last = 0.0, 0.0, 0.0
    for k in range(force.size):
        memory, direct = 0.0, 1.0
        for i in range(shares.size):
            memory += shares[i] * keeps[i] * (state[i] - elastic_old)
            direct += shares[i] * keeps[i]
        wanted = (force[k] - memory) / direct  # force = elastic + sum shares * state
        for _ in range(20):
            f = stiffness * x + cubic * x**3 + dashpot / direct * (x - last) - wanted
            move = f / (stiffness + 3 * cubic * x * x + dashpot / direct)
            x -= move
            if abs(move) < 1e-12:
                break
        for i in range(shares.size):
            state[i] = keeps[i] * (state[i] + stiffness * x + cubic * x**3 - elastic_old)
        elastic_old = stiffness * x + cubic * x**3
        last = x
        out[k] = x
    return out


@njit
def _sliders(x, limits_mm):
    """Friction share -1..1 of sliders that follow the deformation x."""
    out = np.empty_like(x)
    held = np.zeros(limits_mm.size)
    for k in range(1, x.size):
        total = 0.0
        for i in range(limits_mm.size):
            held[i] = min(max(held[i] + x[k] - x[k - 1], -limits_mm[i]), limits_mm[i])
            total += held[i] / limits_mm[i]
        out[k] = total / limits_mm.size
    out[0] = 0.0
    return out


@njit
def _backlash(x, half_gap):
    out = np.empty_like(x)
    p = x[0]
    for k in range(x.size):
        p = min(max(p, x[k] - half_gap), x[k] + half_gap)
        out[k] = p
    return out


class Mount:
    def __init__(self, seed):
        rng = np.random.default_rng([seed, 7])
        self.stiffness = rng.uniform(4700, 5400)
        self.cubic = self.stiffness * rng.uniform(0.05, 0.3)
        self.shares = rng.uniform(0.03, 0.08, 3)
        self.taus = np.array([0.4, 15.0, 400.0]) * rng.uniform(0.6, 1.6, 3)

    def deform(self, force, stiff=1.0, dashpot=0.0):
        keeps = np.exp(-DT_S / self.taus)
        loads = np.ascontiguousarray(force / stiff)
        return _mount(loads, self.stiffness, self.cubic, self.shares, keeps, dashpot / DT_S)


def quiet(rng, n):
    return {
        "accel_x_g": np.zeros(n),
        "accel_y_g": np.zeros(n),
        "accel_z_g": np.ones(n),
        "temperature_degC": np.full(n, ROOM_DEGC),
        "vibration_mm_s": np.zeros(n),
        "n1_pct": np.full(n, 60.0),
        "dynamic_pressure_Pa": np.zeros(n),
        "mach": np.zeros(n),
        "pressure_altitude_m": np.zeros(n),
        "cabin_psi": np.full(n, 14.7),
    }


def moving(rng, n, force):
    t = np.arange(n) * DT_S
    hours = t / 3600
    warm = 21 + rng.uniform(15, 30) * (1 - np.exp(-hours / rng.uniform(0.3, 1.0))) + wave(rng, n, 200, 0.7)
    q = np.clip(
        9000 * (0.5 + 0.5 * np.sin(hours * rng.uniform(2, 5) + rng.uniform(0, 6))) + wave(rng, n, 150, 1500), 0, None
    )
    n1 = 40 + 55 * np.sqrt(np.clip(force, 0, None) / 6500) + wave(rng, n, 60, 4)
    vib = np.clip(8 + 12 * np.exp(-(((n1 - 75) / 8) ** 2)) + wave(rng, n, 90, 5), 0, None)
    return {
        "accel_x_g": wave(rng, n, 8, 0.06) + wave(rng, n, 60, 0.04),
        "accel_y_g": wave(rng, n, 6, 0.03),
        "accel_z_g": 1 + wave(rng, n, 10, 0.15) + 0.3 * (wave(rng, n, 40, 1) > 1.2),
        "temperature_degC": warm,
        "vibration_mm_s": vib,
        "n1_pct": n1,
        "dynamic_pressure_Pa": q,
        "mach": np.sqrt(q / 60000),
        "pressure_altitude_m": np.clip(3000 + 3000 * np.sin(hours * 3) + wave(rng, n, 300, 400), 0, None),
        "cabin_psi": 14.7 - 1.5 * (0.5 + 0.5 * np.sin(hours * rng.uniform(3, 7))) + wave(rng, n, 120, 0.2),
    }


def _carried(force, ch, name, s):
    """Force that deforms the mount."""
    if name == "axial_inertia":
        return force - s * G0 * ch["accel_x_g"]
    if name == "nacelle_drag":
        return force - s * ch["dynamic_pressure_Pa"]
    if name == "unknown_cabin":
        return force - s * (ch["cabin_psi"] - 14.7) ** 2
    if name == "unknown_n1":
        return force - s * np.exp(-(((ch["n1_pct"] - 80) / 5) ** 2))
    return force


def _stiffness(ch, name, s, hours):
    """Factor on the stiffness."""
    if name == "engine_weight":
        return 1 + s * (ch["accel_z_g"] - 1)
    if name == "thermal_stiffness":
        return np.exp(-s * (ch["temperature_degC"] - ROOM_DEGC))
    if name == "ageing":
        return 1 + s * hours
    if name == "payne":
        a = (ch["vibration_mm_s"] / 12.0) ** 1.1
        return 1 - s * a / (1 + a)
    return 1.0


READINGS = {  # what the transducer makes of the deformation x: (x, channels, size, hours)
    "creep": lambda x, ch, s, hours: x + s * _log_creep(x),  # type: ignore[has-type]
    "thermal_expansion": lambda x, ch, s, hours: x + s * (ch["temperature_degC"] - ROOM_DEGC),
    "vibration_rectification": lambda x, ch, s, hours: x + s * (ch["vibration_mm_s"] / 20) ** 2,
    "free_play": lambda x, ch, s, hours: x + (x - _backlash(x, s / 2)),
    "sensor_drift": lambda x, ch, s, hours: x + s * hours,
    "sensor_scale": lambda x, ch, s, hours: x * (1 + s),
    "time_delay": lambda x, ch, s, hours: np.interp(hours * 3600 - s, hours * 3600, x),
}


def applied(mount, force, ch, effects, sizes):
    """Deformation at the transducer under a force, with hidden effects of the given sizes."""
    hours = np.arange(len(force)) * DT_S / 3600
    hidden = dict(zip(effects, sizes, strict=True))
    carried, stiff = force, np.ones(len(force))
    for name, s in hidden.items():
        carried = _carried(carried, ch, name, s)
        stiff = stiff * _stiffness(ch, name, s, hours)
    dashpot = hidden.get("viscous_damping", 0.0)
    x = mount.deform(carried, stiff, dashpot)
    if "mullins_softening" in hidden:
        top = np.maximum.accumulate(np.abs(x))
        softer = 1 - hidden["mullins_softening"] * np.tanh(2 * (top - np.abs(x)))
        x = mount.deform(carried, stiff * softer, dashpot)
    if "hysteresis" in hidden:
        friction = hidden["hysteresis"] * _sliders(x, np.array([0.01, 0.03, 0.09]))
        x = mount.deform(carried - friction, stiff, dashpot)
    for name, s in hidden.items():
        if name in READINGS:
            x = READINGS[name](x, ch, s, hours)
    return x


@njit
def _log_creep(x):
    """Integral of dx(s) log10(1 + (t - s)/60 s) as a sum over a few hundred past increments (coarse steps of 5 s)."""
    n, m = x.size, 100
    rows = n // m + 1
    coarse = np.zeros(rows)
    out = np.zeros(n)
    last = 0.0
    for j in range(rows):
        k = min(n - 1, j * m)
        coarse[j] = x[k] - last
        last = x[k]
        total = 0.0
        for i in range(j + 1):
            total += coarse[i] * np.log10(1 + (j - i) * m * 0.05 / 60.0)
        for k2 in range(j * m, min(n, (j + 1) * m)):
            out[k2] = total
    return out


# sizes that make about 30 N RMS; the benchmark scales them to the strength it wants
NOMINAL = {
    "axial_inertia": 40.0, "nacelle_drag": 0.005, "engine_weight": 0.03, "thermal_stiffness": 5e-4, "ageing": 0.01,
    "payne": 0.03, "unknown_cabin": 30.0, "unknown_n1": 80.0, "mullins_softening": 0.02, "hysteresis": 50.0,
    "viscous_damping": 1000.0, "creep": 0.01, "thermal_expansion": 4e-4, "vibration_rectification": 0.006,
    "free_play": 0.012, "sensor_drift": 0.006, "sensor_scale": 0.008, "time_delay": 0.3,
}  # fmt: skip


PARAMETERS = {  # those sizes that mean the same as a parameter of the effect
    "axial_inertia": "axial_inertia.mass_kg", "nacelle_drag": "nacelle_drag.drag_area_m2",
    "viscous_damping": "viscous_damping.damping_n_s_mm", "thermal_expansion": "thermal_expansion.expansion_mm_k",
    "free_play": "free_play.gap_mm", "sensor_drift": "sensor_drift.drift_mm_h",
    "sensor_scale": "sensor_scale.scale_error", "time_delay": "time_delay.delay_s", "ageing": "ageing.ageing_1_h",
}  # fmt: skip


def measured(ch, x, force, rng):
    noisy = np.round(x / LSB_MM) * LSB_MM
    n = len(force)
    return {
        "time_s": np.arange(n) * DT_S,
        "deformation_mm": noisy,
        "force_N": force + rng.normal(0, LOAD_CELL_N, n),
    } | ch


def strength_of(mount, force, ch, name, size):
    """Force-equivalent RMS of an effect: change of deformation times local stiffness."""
    plain = mount.deform(force)
    changed = applied(mount, force, ch, [name], [size])
    return float(
        np.sqrt(
            np.mean(((changed - plain) * mount.stiffness * (1 + 3 * mount.cubic / mount.stiffness * plain**2)) ** 2)
        )
    )


def exercise(effects, seed, target_n, hours=2.0, flight=0):
    """(bench, measured, held-out) column dicts and the sizes used; each effect has target_n RMS force equivalent."""
    rng = np.random.default_rng([seed, 11])
    mount = Mount(seed)
    bench_force = steps(rng, hours)
    bench = measured(quiet(rng, len(bench_force)), mount.deform(bench_force), bench_force, rng)
    rng = np.random.default_rng([seed, 11, flight]) if flight else rng
    out = [bench]
    sizes = None
    for _ in range(2):
        force = steps(rng, hours, hold=(30.0, 400.0), ramp=(1.0, 20.0))
        ch = moving(rng, len(force), force)
        if sizes is None:
            sizes = []
            for name in effects:
                size = NOMINAL[name]
                for _ in range(3):
                    size *= target_n / strength_of(mount, force, ch, name, size)
                sizes.append(size)
        x = applied(mount, force, ch, effects, sizes)
        out.append(measured(ch, x, force, rng))
    return out, dict(zip(effects, sizes, strict=True))
