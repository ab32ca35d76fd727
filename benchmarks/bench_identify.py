"""Random Hammerstein-Wiener systems at the size of the thesis: `python -m benchmarks.bench_identify [--systems N]`.

Orders 2 to 4, time constants 0.05 to 300 s, gains of either sign, curves of ten segments with kinks, 1 % output noise,
100 Hz, 2.9 million samples. Prints per system the free-run error over the noise floor on the data fitted to and on
unseen data, processor time and peak memory of the default regression and of its artifact.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import resource
from time import process_time

import numpy as np

from thrustd.core.measures import rms
from thrustd.identify.regression.hypotheses import explained
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import LinearBlock, ModelSpec, PiecewiseLinear, RealMode, ValidRange
from thrustd.model.compile import compile_model

RATE_HZ = 100.0
NOISE = 0.01


def system(seed: int) -> ModelSpec:
    rng = np.random.default_rng([seed, 9])
    order = int(rng.integers(2, 5))
    tau_s = np.sort(10 ** rng.uniform(-1.3, 2.5, order))
    gain = rng.uniform(0.05, 0.35, order) * rng.choice([1.0, 1.0, 1.0, -0.5], order)
    x, h_x = np.linspace(0.0, 1.2, 11), np.linspace(-0.6, 1.8, 11)
    f = np.concatenate(([0.0], np.cumsum(rng.uniform(0.4, 1.8, 10))))
    h = np.concatenate(([0.0], np.cumsum(rng.uniform(0.5, 1.6, 10))))
    h = 6500 * (h - np.interp(0.0, h_x, h)) / np.interp(1.2, h_x, h)
    modes = [RealMode(float(tau), -float(g)) for tau, g in zip(tau_s, gain, strict=True)]
    return ModelSpec(
        "thrustd-model/1",
        f"system {seed}",
        "hw-pwl",
        PiecewiseLinear(x.tolist(), (1.2 * f / f[-1]).tolist()),
        LinearBlock(1.0 + float(gain.sum()), modes),
        PiecewiseLinear(h_x.tolist(), h.tolist()),
        ValidRange((0.0, 1.2), (0.0, 6500.0)),
    )


def record(spec: ModelSpec, n: int, seed: int) -> tuple[Segment, float]:
    """Levels held for 10 to 120 s with a little wander; the segment and its noise floor in N."""
    rng = np.random.default_rng(seed)
    holds = rng.integers(1000, 12000, n // 1000 + 2)
    u = np.repeat(rng.uniform(0.02, 1.18, len(holds)), holds)[:n] + 0.005 * rng.standard_normal(n)
    clean = compile_model(spec, RATE_HZ).simulate(u[:, None])
    floor_n = NOISE * float(np.std(clean))
    return Segment(spec.name, 0.0, 1 / RATE_HZ, {DEFORMATION: u}, clean + floor_n * rng.standard_normal(n)), floor_n


def free_run(spec: ModelSpec, segment: Segment) -> float:
    model = compile_model(spec, RATE_HZ)
    force_n = model.simulate(model.inputs(segment.inputs))
    return rms(segment.force_n - force_n)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=2_900_000)
    parser.add_argument("--systems", type=int, default=10)
    given = parser.parse_args()
    warm, _ = record(system(77), 20_000, 7)
    explained([warm])  # compile before the clock starts
    print("system  order  training  unseen   fit CPU  peak memory")
    for seed in range(given.systems):
        truth = system(seed)
        data, floor_n = record(truth, given.samples, 1)
        started = process_time()
        found = explained([data])
        spent = process_time() - started
        spec = spec_of(found, [data], "found")
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        training = free_run(spec, data) / floor_n
        del data
        unseen, unseen_floor_n = record(truth, given.samples, 2)
        new = free_run(spec, unseen) / unseen_floor_n
        order = len(truth.linear.real_modes)
        print(f"{seed:6d} {order:6d} {training:9.4f} {new:8.4f} {spent:7.1f} s {peak_mb:9.0f} MB", flush=True)


if __name__ == "__main__":
    main()
