"""HW-PWL estimation at the size of the thesis: `python benchmarks/bench_identify.py [--samples N] [--unseen N]`.

System: order 3, time constants 0.05, 2 and 200 s, curves of ten segments, 1 % output noise, 100 Hz. Prints the free-run
error over the noise floor on the data fitted to and on unseen data, time and processor time of the fit, peak memory,
and the time to simulate 13.4 million samples. OPENBLAS_NUM_THREADS=1 gives what one thread takes.
"""

import argparse
import resource
import time

import numpy as np

from thrustd.identify.fit_hw_pwl import HwSettings, fit_hw_pwl
from thrustd.model.artifact import LinearBlock, ModelSpec, PiecewiseLinear, RealMode, ValidRange
from thrustd.model.compile import compile_model
from thrustd.records.recording import Recording, make_recording

RATE_HZ = 100.0
NOISE = 0.01


def system() -> ModelSpec:
    x = np.linspace(0.0, 1.2, 11)
    f = 1.2 * (x / 1.2 + 0.6 * (x / 1.2) ** 3) / 1.6
    h_x = np.linspace(-0.1, 1.3, 11)
    h = 6500 * (h_x / 1.2 - 0.2 * np.sin(2.0 * h_x))
    modes = [RealMode(0.05, -0.3), RealMode(2.0, -0.15), RealMode(200.0, -0.1)]
    return ModelSpec(
        "thrustd-model/1",
        "known system",
        "hw-pwl",
        PiecewiseLinear(x.tolist(), f.tolist()),
        LinearBlock(1.55, modes),
        PiecewiseLinear(h_x.tolist(), h.tolist()),
        ValidRange((0.0, 1.2), (0.0, 6500.0)),
    )


def record(spec: ModelSpec, n: int, seed: int) -> tuple[Recording, float]:
    """Levels held for 10 to 120 s with a little wander; the recording and its noise floor in N."""
    rng = np.random.default_rng(seed)
    holds = rng.integers(1000, 12000, n // 1000 + 2)
    u = np.repeat(rng.uniform(0.02, 1.18, len(holds)), holds)[:n] + 0.005 * rng.standard_normal(n)
    clean = compile_model(spec, RATE_HZ).simulate(u[:, None])
    floor_n = NOISE * float(np.std(clean))
    force_n = clean + floor_n * rng.standard_normal(n)
    columns = {"time_s": np.arange(n) / RATE_HZ, "deformation_mm": u, "force_N": force_n}
    return make_recording(f"seed {seed}", columns), floor_n


def free_run(spec: ModelSpec, data: Recording) -> float:
    model = compile_model(spec, RATE_HZ)
    force_n = model.simulate(model.inputs(data.channels))
    return float(np.sqrt(np.mean((data["force_N"] - force_n) ** 2)))


def simulation_s(spec: ModelSpec, n: int) -> float:
    model = compile_model(spec, RATE_HZ)
    rows = np.random.default_rng(0).uniform(0, 1.2, n)[:, None]
    model.simulate(rows[:1000])
    started = time.perf_counter()
    model.simulate(rows)
    return time.perf_counter() - started


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=2_900_000)
    parser.add_argument("--unseen", type=int, default=2_900_000)
    parser.add_argument("--order", type=int, default=3)
    given = parser.parse_args()
    spec = system()
    warm, _ = record(spec, 20_000, 7)
    fit_hw_pwl([warm], HwSettings(order=given.order))  # compile before the clock starts
    data, floor_n = record(spec, given.samples, 1)
    before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    wall, cpu = time.perf_counter(), time.process_time()
    found = fit_hw_pwl([data], HwSettings(order=given.order))
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    unseen, unseen_floor_n = record(spec, given.unseen, 2)
    print(f"fit of {given.samples} samples: {wall:.1f} s, {cpu:.1f} s of processor time")
    print(f"memory: peak {peak_mb:.0f} MB, {before_mb:.0f} MB of it before the fit (data and libraries)")
    print(f"error / noise floor: training {free_run(found.spec, data) / floor_n:.4f}, "
          f"unseen {free_run(found.spec, unseen) / unseen_floor_n:.4f}")  # fmt: skip
    taus = sorted(mode.tau_s for mode in found.spec.linear.real_modes)
    print("time constants:", ", ".join(f"{tau:.4g} s" for tau in taus))
    print(f"simulation of 13.4 million samples: {simulation_s(found.spec, 13_400_000):.2f} s")


if __name__ == "__main__":
    main()
