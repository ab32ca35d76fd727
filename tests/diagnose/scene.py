"""A small world for diagnosis: a mount known exactly, and records made from it."""

import numpy as np

from thrustd.model.artifact import (
    EffectSpec,
    ErrorMap,
    LinearBlock,
    ModelSpec,
    Polynomial,
    RealMode,
    ValidRange,
)
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording

DT_S = 0.05
NOISE_N = 12.0


def mount(k1=5000.0, k3=1000.0, gains=(0.05, 0.04), taus_s=(0.4, 60.0), effects=(), own_n=NOISE_N):
    """Quasi-linear viscoelastic: a cubic curve, then relaxation."""
    return ModelSpec(
        schema="thrustd-model/1",
        name="mount",
        structure="hammerstein",
        input_curve=Polynomial(0.0, 1.0, [0.0, k1, 0.0, k3]),
        linear=LinearBlock(1.0 + sum(gains), [RealMode(t, -g) for g, t in zip(gains, taus_s, strict=True)]),
        output_curve=Polynomial(0.0, 1.0, [0.0, 1.0]),
        valid=ValidRange((0.0, 1.3), (0.0, 6500.0)),
        effects=list(effects),
        error=ErrorMap([0.0, 7000.0], [0.0, 1e6], [[own_n]]),
    )


def columns(n=12_000, seed=0):
    """Deformation in steps and manoeuvre channels that move independently."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(0.1, 1.1, n // 600 + 1), 600)[:n]
    ramp = np.convolve(np.pad(levels, (40, 0), mode="edge"), np.ones(41) / 41, mode="valid")

    def wave(period_s, size):
        t = np.arange(n) * DT_S
        return size * sum(np.sin(2 * np.pi * t / (period_s * f) + rng.uniform(0, 6)) for f in (1.0, 0.61, 0.37))

    return {
        "time_s": np.arange(n) * DT_S,
        "deformation_mm": ramp,
        "accel_x_g": wave(40.0, 0.04),
        "accel_z_g": 1 + wave(70.0, 0.1),
        "temperature_degC": 20 + 20 * np.arange(n) / n + wave(300.0, 0.5),
        "dynamic_pressure_Pa": 8000 + wave(220.0, 1500.0),
        "cabin_psi": 14.0 + wave(130.0, 0.4),
        "vibration_mm_s": np.zeros(n),
    }


def record(effects=(), seed=0, added=None, name="measured", n=12_000):
    """A recording of `mount` with effects, 12 N of load-cell noise; `added`: further force from the columns."""
    data = columns(n, seed)
    model = compile_model(mount(effects=effects), 1 / DT_S)
    force = model.simulate(model.inputs(data))
    if added is not None:
        force = force + added(data)
    noise = np.random.default_rng([seed, 1]).normal(0, NOISE_N, n)
    return make_recording(name, data | {"force_N": force + noise})


def inertia(mass_kg):
    return EffectSpec("axial_inertia", {"mass_kg": mass_kg})
