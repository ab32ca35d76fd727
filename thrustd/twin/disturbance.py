"""Hidden physics, forward: what each effect does to the force a mount carries, to the rubber, or to the reading.

The names are those of ICD section 4; the equations are the twin's own, from force to deformation. An effect has one
amplitude, which `hide` scales to the wanted size, and shape numbers drawn from the seed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.twin.environment import HYDRAULIC_BAR, ROOM_DEG_C, Channels
from thrustd.twin.mount import Kernel, MountPhysics, MountState, advance, at_rest, prepare, step

MOUNT_WEIGHT_N = 1081.0  # half of the 2162 N of the front mounts at 1 g, thesis eq. 4.5
MULLINS_BETA = 0.1  # by how much slower the virgin rubber comes back at large energies
PLAY_MM = 0.002  # travel in which a joint moves through its gap
CREEP_START_S = 60.0
CREEP_LAGS_S = np.geomspace(6.0, 6e6, 61)

Shape = dict[str, float]


@dataclass(slots=True)
class Scene:
    """One record while it is made: effects change it, then `deformation_mm` computes what the LVDT would see."""

    carried_n: Floats
    channels: Channels
    dt_s: float
    mount: MountPhysics
    stiffness: Floats | float = 1.0
    mullins: tuple[float, float] = (0.0, 1.0)  # softening, energy scale [N mm]
    readings: list[Callable[[Floats], Floats]] = field(default_factory=list)

    @property
    def hours(self) -> Floats:
        return np.asarray(np.arange(len(self.carried_n)) * (self.dt_s / 3600.0), dtype=np.float64)

    def deformation_mm(self) -> Floats:
        load_n = np.ascontiguousarray(self.carried_n / self.stiffness)
        warm_degc, normal_g = self.channels["temperature_degC"], self.channels["accel_z_g"]
        if self.mullins[0]:
            load_n = load_n / _softened(self.mount, load_n, self.dt_s, *self.mullins)
        mm = advance(self.mount, at_rest(self.mount), load_n, self.dt_s, warm_degc, normal_g)
        for reading in self.readings:
            mm = reading(mm)
        return mm


class Disturbance(NamedTuple):
    """One kind of hidden physics."""

    parameter: str  # what the amplitude is, unit included
    start: float  # a typical amplitude, from which the scaling begins
    signed: bool  # either sign happens
    apply: Callable[[Scene, float, Shape], None]
    shape: tuple[tuple[str, float, float], ...] = ()  # drawn between two limits
    depends_on: tuple[str, ...] = ()  # channels it follows


def _axial_inertia(scene: Scene, mass_kg: float, shape: Shape) -> None:
    scene.carried_n = scene.carried_n - mass_kg * STANDARD_GRAVITY_M_S2 * scene.channels["accel_x_g"]


def _nacelle_drag(scene: Scene, area_m2: float, shape: Shape) -> None:
    scene.carried_n = scene.carried_n - area_m2 * scene.channels["dynamic_pressure_Pa"]


def _engine_weight(scene: Scene, stiffening_1_n: float, shape: Shape) -> None:
    scene.mount = scene.mount._replace(weight_gain_per_g=stiffening_1_n * MOUNT_WEIGHT_N)


def _thermal_expansion(scene: Scene, expansion_mm_k: float, shape: Shape) -> None:
    scene.mount = scene.mount._replace(expansion_mm_k=expansion_mm_k)


def _thermal_stiffness(scene: Scene, stiffness_1_k: float, shape: Shape) -> None:
    scene.stiffness = scene.stiffness * (1 + stiffness_1_k * (scene.channels["temperature_degC"] - ROOM_DEG_C))


def _ageing(scene: Scene, ageing_1_h: float, shape: Shape) -> None:
    """Towards a new stiffness, first order: `ageing_1_h` is the rate at the start."""
    scene.stiffness = scene.stiffness * (
        1 - ageing_1_h * shape["settling_h"] * np.expm1(-scene.hours / shape["settling_h"])
    )


def _payne(scene: Scene, softening: float, shape: Shape) -> None:
    """Kraus: the filler network breaks up with the amplitude of the vibration."""
    ratio = (scene.channels["vibration_mm_s"] / shape["vibration_c_mm_s"]) ** (2 * shape["exponent_m"])
    scene.stiffness = scene.stiffness * (1 - softening * ratio / (1 + ratio))


def _mullins(scene: Scene, softening: float, shape: Shape) -> None:
    scene.mullins = (softening, shape["energy_n_mm"])


def _hysteresis(scene: Scene, friction_n: float, shape: Shape) -> None:
    scene.mount = scene.mount._replace(dahl_n=friction_n, dahl_n_mm=friction_n / shape["yield_mm"])


def _viscous_damping(scene: Scene, damping_n_s_mm: float, shape: Shape) -> None:
    scene.mount = scene.mount._replace(damping_n_s_mm=damping_n_s_mm)


def _creep(scene: Scene, per_decade: float, shape: Shape) -> None:
    """Step response b log10(1 + t / t0); its exact spectrum of lags is exp(-t0 / tau) / tau / ln 10."""
    spacing = np.log(CREEP_LAGS_S[1] / CREEP_LAGS_S[0])
    weights = per_decade * np.exp(-CREEP_START_S / CREEP_LAGS_S) * spacing / np.log(10)

    def reading(mm: Floats) -> Floats:
        crept = mm.copy()
        for weight, lag_s in zip(weights, CREEP_LAGS_S, strict=True):
            keep = np.exp(-scene.dt_s / lag_s)
            crept += weight * lfilter([1 - keep], [1, -keep], mm)
        return crept

    scene.readings.append(reading)


def _free_play(scene: Scene, gap_mm: float, shape: Shape) -> None:
    """A joint in the load path: when the motion turns round, it moves through its gap before the mount does."""
    scene.readings.append(lambda mm: mm + gap_mm / 2 * _side(mm, PLAY_MM))


def _sensor_drift(scene: Scene, drift_mm_h: float, shape: Shape) -> None:
    scene.readings.append(lambda mm: mm + drift_mm_h * scene.hours)


def _sensor_scale(scene: Scene, scale_error: float, shape: Shape) -> None:
    scene.readings.append(lambda mm: mm * (1 + scale_error))


def _time_delay(scene: Scene, delay_s: float, shape: Shape) -> None:
    time_s = np.arange(len(scene.carried_n)) * scene.dt_s
    scene.readings.append(lambda mm: np.interp(time_s - delay_s, time_s, mm))


def _vibration_rectification(scene: Scene, shift_mm: float, shape: Shape) -> None:
    """Shift at 100 mm/s, with the square of the vibration."""
    scene.readings.append(lambda mm: mm + shift_mm * (scene.channels["vibration_mm_s"] / 100.0) ** 2)


def _hydraulic_line(scene: Scene, force_n: float, shape: Shape) -> None:
    """In no library: a stiff line pulls on the engine when its pressure leaves the normal one, either way."""
    off = (scene.channels["hydraulic_pressure_bar"] - HYDRAULIC_BAR) / 10.0
    scene.carried_n = scene.carried_n - force_n * off**2 / (1 + off**2)


def _bleed_duct(scene: Scene, force_n: float, shape: Shape) -> None:
    """In no library: a bleed duct pushes once the valve is open past its knee."""
    scene.carried_n = scene.carried_n - force_n * np.tanh(3 * scene.channels["bleed_valve_pct"] / 100 - 1.5)


@compiled
def _softened_run(
    kernel: Kernel, state: MountState, load_n: Floats, softening: float, scale: float, eta: Floats
) -> None:
    top = 0.0
    for n in range(load_n.size):
        x = state.scalar[0]
        energy = 0.5 * kernel.k1 * x * x + 0.25 * kernel.k3 * x**4
        top = max(top, energy)
        eta[n] = 1.0 - softening * np.tanh((top - energy) / (scale + MULLINS_BETA * top))
        step(kernel, state, load_n[n] / eta[n])


def _softened(mount: MountPhysics, load_n: Floats, dt_s: float, softening: float, scale: float) -> Floats:
    """Mullins, Ogden-Roxburgh in the form of Dorfmann and Ogden: eta = 1 - r tanh((W_max - W) / (m + beta W_max)).

    W is the elastic energy stored in the rubber [N mm]; the energy of the sample before decides.
    """
    eta = np.empty_like(load_n)
    _softened_run(prepare(mount, dt_s), at_rest(mount), load_n, softening, scale, eta)
    return eta


@compiled
def _side(mm: Floats, travel_mm: float) -> Floats:
    """Which side of its gap the joint rests on, -1 .. 1, following the motion of the mount."""
    side = np.empty_like(mm)
    at = 0.0
    for n in range(mm.size):
        at += (mm[n] - mm[max(n - 1, 0)]) / travel_mm
        at = min(max(at, -1.0), 1.0)
        side[n] = at
    return side


DISTURBANCES: dict[str, Disturbance] = {
    "axial_inertia": Disturbance("mass_kg", 186.5, False, _axial_inertia),
    "engine_weight": Disturbance("stiffening_1_n", 1e-5, False, _engine_weight),
    "hysteresis": Disturbance("friction_n", 60.0, False, _hysteresis, (("yield_mm", 0.015, 0.08),)),
    "creep": Disturbance("creep_per_decade", 0.02, False, _creep),
    "viscous_damping": Disturbance("damping_n_s_mm", 2000.0, False, _viscous_damping),
    "thermal_expansion": Disturbance("expansion_mm_k", 0.002, True, _thermal_expansion),
    "thermal_stiffness": Disturbance("stiffness_1_k", -0.002, True, _thermal_stiffness),
    "free_play": Disturbance("gap_mm", 0.02, False, _free_play),
    "mullins_softening": Disturbance("softening", 0.05, False, _mullins, (("energy_n_mm", 300.0, 1200.0),)),
    "payne": Disturbance("softening", 0.05, False, _payne, (("vibration_c_mm_s", 8.0, 20.0), ("exponent_m", 0.5, 0.8))),
    "ageing": Disturbance("ageing_1_h", 0.02, True, _ageing, (("settling_h", 3.0, 20.0),)),
    "sensor_drift": Disturbance("drift_mm_h", 0.01, True, _sensor_drift),
    "sensor_scale": Disturbance("scale_error", 0.01, True, _sensor_scale),
    "nacelle_drag": Disturbance("drag_area_m2", 0.02, False, _nacelle_drag),
    "time_delay": Disturbance("delay_s", 0.3, False, _time_delay),
    "vibration_rectification": Disturbance("shift_mm", 0.3, True, _vibration_rectification),
}
UNLISTED: dict[str, Disturbance] = {  # in nobody's library; the verdict is `unknown`
    "hydraulic_line": Disturbance("force_n", 100.0, True, _hydraulic_line, (), ("hydraulic_pressure_bar",)),
    "bleed_duct": Disturbance("force_n", 60.0, True, _bleed_duct, (), ("bleed_valve_pct",)),
}
