"""A known HW-PWL system: curves with kinks, three modes, output noise of 1 %."""

import numpy as np

from thrustd.model.artifact import ComplexMode, LinearBlock, ModelSpec, PiecewiseLinear, RealMode, ValidRange
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording

REAL = LinearBlock(1.55, [RealMode(0.05, -0.3), RealMode(2.0, -0.15), RealMode(20.0, -0.1)])
OSCILLATING = LinearBlock(0.0, [RealMode(2.0, -0.3)], [ComplexMode(1.5, 9.0, 1.3, 0.2)])


def truth(linear=REAL, scale=1.0, zero=0.0, output=6000.0):
    x = np.linspace(0.0, 1.2, 11)
    f = 1.2 * (x / 1.2 + 0.5 * (x / 1.2) ** 3) / 1.5
    h = np.linspace(-0.1, 1.3, 11)
    return ModelSpec(
        schema="thrustd-model/1",
        name="truth",
        structure="hw-pwl",
        input_curve=PiecewiseLinear((zero + scale * x).tolist(), f.tolist()),
        linear=linear,
        output_curve=PiecewiseLinear(h.tolist(), (output * (h / 1.2 - 0.2 * np.sin(2 * h))).tolist()),
        valid=ValidRange((0.0, 1.2), (0.0, 6600.0)),
    )


def record(spec, n, seed=0, noise=0.01, rate_hz=100.0, scale=1.0, zero=0.0, hold=400, name="bench"):
    """Random levels held for a while; returns the recording and the noise's sigma."""
    rng = np.random.default_rng(seed)
    holds = rng.integers(hold // 4, 2 * hold, 8 * n // hold + 2)
    u = np.repeat(rng.uniform(0.0, 1.2, len(holds)), holds)[:n]
    u = zero + scale * np.clip(u + 0.01 * rng.normal(size=n), 0.0, 1.2)
    clean = compile_model(spec, rate_hz).simulate(u[:, None])
    sigma = noise * float(np.std(clean))
    columns = {"time_s": np.arange(n) / rate_hz, "deformation_mm": u, "force_N": clean + sigma * rng.normal(size=n)}
    return make_recording(name, columns), sigma


def free_run_rmse(spec, recording, skip=0):
    """Error of a model started at rest."""
    model = compile_model(spec, recording.sample_hz)
    force_n = model.simulate(model.inputs(recording.channels))
    return float(np.sqrt(np.mean((recording["force_N"] - force_n)[skip:] ** 2)))
