"""A second mount for the blind benchmark: compliances instead of moduli, other laws for every effect and every seed.

Deformation is an elastic law of the force plus retarded parts of it (Kelvin-Voigt elements in series, so nothing is
solved for), with a little stick in the linkage always there. Each hidden effect has several laws; the seed picks one.
The recordings are damaged as recordings are: jittered clock, a gap, missing cells, a time axis that does not start at
zero, channels that are not there. 20 Hz; LVDT in steps of 5 mm / 2^16; load cell 12 N.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.signal import lfilter

from benchmarks.blind_rig_friction import Law, bouc_wen, elastic, relays, rubbed

DT_S = 0.05
LOAD_CELL_N = 12.0
LSB_MM = 5.0 / 2**16
G0 = 9.80665
ROOM_DEGC = 20.0
PARAMETERS = {  # those sizes that mean the same as a parameter of the effect
    "axial_inertia": "axial_inertia.mass_kg",
    "time_delay": "time_delay.delay_s",
    "sensor_scale": "sensor_scale.scale_error",
}


def lag(signal, tau_s, start=None):
    keep = np.exp(-DT_S / tau_s)
    first = signal[0] if start is None else start
    return lfilter([1 - keep], [1, -keep], signal, zi=[keep * first])[0]


def held(rng, n, low, high, hold_s, ramp_s):
    """Levels held for a while, straight or smooth ways between them."""
    at, level, out = 0, rng.uniform(low, high), np.empty(n)
    while at < n:
        target = rng.uniform(low, high) if rng.random() < 0.8 else rng.choice([low, high])
        way = np.linspace(0, 1, max(2, int(rng.uniform(*ramp_s) / DT_S)))
        way = way if rng.random() < 0.5 else way * way * (3 - 2 * way)
        piece = np.concatenate((level + (target - level) * way, np.full(int(rng.uniform(*hold_s) / DT_S), target)))
        out[at : at + len(piece)] = piece[: n - at]
        at, level = at + len(piece), target
    return out


def noise(rng, n, tau_s, size):
    walk = lag(lag(rng.normal(size=n + 4000), tau_s, 0.0), tau_s, 0.0)[4000:]
    return size * (walk - walk.mean()) / walk.std()


@njit
def play(x, half):
    """Operator of play around its middle, -1..1 times half."""
    out = np.empty_like(x)
    p = x[0]
    for k in range(x.size):
        p = min(max(p, x[k] - half), x[k] + half)
        out[k] = x[k] - p
    return out


@njit
def damped(force, k, damping, power):
    """What is left for a spring k of a force when a damper beside it takes damping * rate^power."""
    left, out = force[0], np.empty_like(force)
    for i in range(force.size):
        for _ in range(20):
            gap = force[i] - left
            left += np.sign(gap) * min(k * (abs(gap) / damping) ** (1 / power) * DT_S / 20, abs(gap))
        out[i] = left
    return out


@dataclass
class Scene:
    """What the effects of one record may touch, in the order of physics."""

    force: np.ndarray  # applied
    ch: dict
    hours: np.ndarray
    mount: "Mount"
    carried: np.ndarray = field(init=False)
    softness: np.ndarray = field(init=False)  # factor on the compliance

    def __post_init__(self):
        self.carried, self.softness = self.force.copy(), np.ones(len(self.force))


class Mount:
    """x = elastic(F) + sum J_i lag_i(elastic); elastic softens, then stiffens."""

    def __init__(self, seed):
        rng = np.random.default_rng([seed, 31])
        self.k = rng.uniform(4500, 6500)
        self.bend = rng.uniform(0.05, 0.2)
        self.chain = list(
            zip(rng.uniform(0.02, 0.07, 3), np.array([1.2, 30.0, 500.0]) * rng.uniform(0.5, 2, 3), strict=True)
        )
        self.stick_mm = rng.uniform(0.0002, 0.0006)

    def deform(self, force, softness=1.0):
        e = elastic(force * softness, self.k, self.bend)
        return e + sum(j * lag(e, tau) for j, tau in self.chain) - play(e, self.stick_mm)

    def rub(self, force, softness, friction_n):
        """With Coulomb friction beside it."""
        shares, taus = np.array(self.chain).T
        softness = np.broadcast_to(np.asarray(softness, float), force.shape)
        law = Law(self.k, self.bend, shares, np.exp(-DT_S / taus), self.stick_mm)
        return rubbed(force, softness, friction_n, law)


def _hysteresis(law: int, x: np.ndarray, rng) -> np.ndarray:
    if law == 0:
        return bouc_wen(x, rng.uniform(0.02, 0.08), 2.0)
    middle, half = rng.uniform(0.0, 1.3, 300), rng.exponential(0.04, 300) + 0.005
    return relays(x, middle + half, middle - half, np.where(x[0] > middle, 1.0, -1.0))


def _creep(law: int, x: np.ndarray) -> np.ndarray:
    many = sum(lag(x, tau) * tau**0.12 for tau in (100.0, 600.0, 3600.0, 20000.0)) / 8
    return (lag(x, 900.0) * 0.4 + lag(x, 6000.0) * 0.6, many, lag(x, 2500.0))[law]


def _warmth(scene: Scene, law: int) -> np.ndarray:
    degc = scene.ch["temperature_degC"] - ROOM_DEGC
    return degc if law == 0 else lag(degc, 240.0) if law == 1 else degc + 0.004 * degc**2


def _grown(scene: Scene, law: int, rng) -> np.ndarray:
    walk = np.cumsum(rng.normal(size=len(scene.hours))) * np.sqrt(DT_S / 3600) * 0.3
    return (scene.hours, 1 - np.exp(-scene.hours / 0.8), walk + scene.hours)[law]


def _softening(name: str, scene: Scene, law: int, rng) -> np.ndarray:
    """Relative softening per unit of size."""
    if name == "engine_weight":
        return -(scene.ch["accel_z_g"] - 1)
    if name == "thermal_stiffness":
        return _warmth(scene, law)
    if name == "ageing":
        return -(scene.hours if law != 1 else np.log1p(3 * scene.hours))
    if name == "payne":
        ratio = scene.ch["vibration_mm_s"] / (8.0, 15.0, 30.0)[law]
        return ratio ** (1.0, 1.4, 0.8)[law] / (1 + ratio ** (1.0, 1.4, 0.8)[law])
    x = scene.mount.deform(scene.force)
    top = np.maximum.accumulate(x)
    return (1 - x / top, np.tanh((top**2 - x**2) / 0.4), np.sqrt(np.maximum(0, 1 - (x / top) ** 2)))[law]


SOFTENING = ("engine_weight", "thermal_stiffness", "ageing", "payne", "mullins_softening")
FORCES: dict[str, Callable] = {
    "axial_inertia": lambda ch, law: G0 * lag(ch["accel_x_g"], 0.05),
    "nacelle_drag": lambda ch, law: ch["dynamic_pressure_Pa"] * (1 + (0.0, 0.1, 0.3)[law] * ch["mach"]),
    "unknown_fuel": lambda ch, law: np.sin(ch["fuel_kg"] / 150),
    "unknown_gear": lambda ch, law: np.clip(ch["gear_pct"] - 30, 0, None),
}


def deformation(scene: Scene, effects, sizes, seed) -> np.ndarray:
    """Reading of a perfect transducer."""
    for name, s in zip(effects, sizes, strict=True):
        rng, law = _law(name, seed)
        if name in FORCES:
            scene.carried = scene.carried - s * FORCES[name](scene.ch, law)
        if name in SOFTENING:
            scene.softness = scene.softness * (1 + s * _softening(name, scene, law, rng))
    x = scene.mount.deform(scene.carried, scene.softness)
    for name, s in zip(effects, sizes, strict=True):
        rng, law = _law(name, seed)
        if name == "hysteresis" and law == 1:
            x = scene.mount.rub(scene.carried, scene.softness, s)
        elif name == "hysteresis":  # friction takes part of the force
            x = scene.mount.deform(scene.carried - s * _hysteresis(law, x, rng), scene.softness)
        if name == "viscous_damping":
            passed = damped(scene.carried, scene.mount.k, s, (1.0, 0.8, 1.2)[law])
            x = scene.mount.deform(passed, scene.softness)
    for name, s in zip(effects, sizes, strict=True):
        x = _read(name, s, scene, x, seed)
    return x


def _read(name, s, scene, x, seed):
    rng, law = _law(name, seed)
    if name == "creep":
        return x + s * _creep(law, x)
    if name == "thermal_expansion":
        return x + s * _warmth(scene, law)
    if name == "vibration_rectification":
        return x + s * (scene.ch["vibration_mm_s"] / 20) ** (2.0, 1.5, 2.0)[law]
    if name == "free_play":
        return x + play(x + 0.1, s / 2) if law != 2 else x + np.clip((play(x, s / 2)) * 3, -s / 2, s / 2)
    if name == "sensor_drift":
        return x + s * _grown(scene, law, rng)
    if name == "sensor_scale":
        return x * (1 + s)
    if name == "time_delay":
        t = scene.hours * 3600
        return np.interp(t - s, t, x) if law != 1 else lag(x, s)
    return x


def _law(name, seed):
    return np.random.default_rng([seed, len(name), ord(name[0])]), (seed + len(name)) % 3


NOMINAL = {
    "axial_inertia": 40.0, "nacelle_drag": 0.005, "unknown_fuel": 50.0, "unknown_gear": 1.0, "engine_weight": 0.03,
    "thermal_stiffness": 5e-4, "ageing": 0.01, "payne": 0.03, "mullins_softening": 0.02, "hysteresis": 50.0,
    "viscous_damping": 1000.0, "creep": 0.02, "thermal_expansion": 4e-4, "vibration_rectification": 0.006,
    "free_play": 0.012, "sensor_drift": 0.006, "sensor_scale": 0.008, "time_delay": 0.3,
}  # fmt: skip


def surroundings(rng, n, force, quiet):
    if quiet:
        still = {"accel_x_g": 0.0, "accel_z_g": 1.0, "temperature_degC": ROOM_DEGC, "vibration_mm_s": 0.0}
        still |= {"n1_pct": 0.0, "dynamic_pressure_Pa": 0.0, "mach": 0.0, "fuel_kg": 1500.0, "gear_pct": 100.0}
        return {name: np.full(n, value) for name, value in still.items()}
    hours = np.arange(n) * DT_S / 3600
    mach = np.clip(0.3 + noise(rng, n, 200, 0.08), 0.1, 0.6)
    n1 = 35 + 60 * np.sqrt(np.clip(force, 0, None) / 6500) + noise(rng, n, 5, 0.5)
    return {
        "accel_x_g": noise(rng, n, 4, 0.05) + held(rng, n, -0.08, 0.12, (10, 60), (2, 10)),
        "accel_z_g": 1 + noise(rng, n, 2, 0.05) + np.clip(held(rng, n, -0.4, 0.6, (10, 50), (3, 8)), -0.3, 0.6),
        "temperature_degC": ROOM_DEGC + rng.uniform(15, 40) * (1 - np.exp(-hours / rng.uniform(0.3, 1.5)))
        + held(rng, n, -6, 6, (200, 900), (100, 300)),
        "vibration_mm_s": np.clip(3 + 14 * (n1 / 100) ** 3 + held(rng, n, -4, 10, (30, 200), (5, 20)), 0.1, None),
        "n1_pct": n1,
        "dynamic_pressure_Pa": 45000 * mach**2,
        "mach": mach,
        "fuel_kg": 1500 - 500 * hours + noise(rng, n, 30, 5),
        "gear_pct": held(rng, n, 0, 100, (60, 400), (5, 15)),
    }  # fmt: skip


def record(rng, force, ch, x, damaged):
    n = len(force)
    read = np.round(x / LSB_MM) * LSB_MM
    table = {"time_s": np.arange(n) * DT_S, "deformation_mm": read, "force_N": force + rng.normal(0, LOAD_CELL_N, n)}
    table |= ch
    if not damaged:
        return table
    table["time_s"] = np.round(1000.0 + table["time_s"] + rng.uniform(-0.005, 0.005, n), 4)
    keep = rng.random(n) > 5e-4
    gap = int(rng.uniform(0.3, 0.7) * n)
    keep[gap : gap + int(rng.uniform(20, 60) / DT_S)] = False
    lost = rng.random(n) < 2e-4
    table["temperature_degC"] = np.where(lost, np.nan, table["temperature_degC"])
    return {name: column[keep] for name, column in table.items()}


def exercise(effects, seed, target_n, hours=2.0, flight=0):
    """(bench, measured, held-out) column dicts and the sizes used; each effect has target_n RMS force equivalent."""
    rng, mount = np.random.default_rng([seed, 37]), Mount(seed)
    n = int(hours * 3600 / DT_S)
    force = held(rng, n, 300.0, 6500.0, (20.0, 400.0), (0.5, 8.0))
    tables = [record(rng, force, surroundings(rng, n, force, True), mount.deform(force), False)]
    rng = np.random.default_rng([seed, 37, flight]) if flight else rng
    t, sizes = np.arange(n) * DT_S / 3600, []
    for which in range(2):
        force = np.clip(held(rng, n, 600.0, 6300.0, (15.0, 250.0), (1.0, 15.0)) + noise(rng, n, 5, 30), 300, 6500)
        ch = surroundings(rng, n, force, False)
        if which == 0:
            sizes = [_sized(mount, force, ch, t, name, seed, target_n) for name in effects]
        x = deformation(Scene(force, ch, t, mount), effects, sizes, seed)
        tables.append(record(rng, force, ch, x, seed % 2 == 1))
    return tables, dict(zip(effects, sizes, strict=True))


def _sized(mount, force, ch, t, name, seed, target_n):
    plain = mount.deform(force)
    slope = np.maximum(np.gradient(np.sort(force)[::400], np.sort(plain)[::400]).mean(), 1.0)
    size = NOMINAL[name]
    for _ in range(3):
        changed = deformation(Scene(force, ch, t, mount), [name], [size], seed)
        size *= target_n / (slope * np.sqrt(np.mean((changed - plain) ** 2)))
    return float(size)
