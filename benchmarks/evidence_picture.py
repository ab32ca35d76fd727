"""Evidence and unseen error by the number of knots and of time constants: `python -m benchmarks.evidence_picture`.

An hour of random steps of the twin's bench at 10 Hz is fitted with more and more of both; judged on four hours of other
steps. What the priors do: beyond enough, more of either changes neither the evidence nor the error.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from thrustd.core.measures import rms
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import FIRST, first_point, prepared
from thrustd.identify.regression.shape import Shape
from thrustd.identify.regression.solve import Solution, prior_of, solve
from thrustd.identify.segments import segments_of
from thrustd.twin.bench import step_bench

KNOTS, LAGS = (5, 6, 8, 10, 14, 18, 24, 32, 48), (1, 2, 3, 4, 6, 8, 12, 16, 20, 28)
RATE_HZ = 10.0


def log_evidence(found: Solution, noise_variance: float) -> float:
    """Laplace's approximation with the noise level of the richest model, so that models compare: up to a constant."""
    prior = prior_of(found.shape, found.precisions)
    t = found.point.vector(found.shape)
    free = found.free
    information = (found.normal.matrix / noise_variance + prior)[np.ix_(free, free)]
    misfit = found.normal.squares / noise_variance + float(t @ prior @ t)
    both = [np.linalg.slogdet(matrix)[1] for matrix in (prior[np.ix_(free, free)], information)]
    return 0.5 * float(both[0] - both[1] - misfit)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/evidence.png"))
    given = parser.parse_args()
    train = segments_of([step_bench(1.0, 1).resample(RATE_HZ)])
    unseen = segments_of([step_bench(4.0, 99).resample(RATE_HZ)])
    shape, records = prepared(train)

    def fitted(other: Shape) -> Solution:
        return solve(other, first_point(other, records), records, FIRST)

    def missed(found: Solution) -> float:
        scale, zero = found.shape.output_scale, found.shape.zero
        runs = [Record(s.inputs["deformation_mm"], s.force_n / scale, s.dt_s, zero) for s in unseen]
        errors = np.concatenate([r.y - simulate(found.shape, found.point, r) for r in runs])
        return scale * rms(errors)

    noise = fitted(shape).noise_variance
    knots = [fitted(replace(shape, f_grid=shape.f_grid._replace(n=n))) for n in KNOTS]
    reach = shape.taus_s[[0, -1]]
    lags = [fitted(replace(shape, taus_s=np.geomspace(float(reach[0]), float(reach[1]), n))) for n in LAGS]
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    for axis, counts, found, label in ((axes[0], KNOTS, knots, "coefficients of the curve"),
                                       (axes[1], LAGS, lags, "time constants")):  # fmt: skip
        axis.plot(counts, [missed(f) for f in found], "o-", color="tab:red")
        axis.set(xlabel=label, ylabel="unseen error, N", ylim=(0, None))
        beside = axis.twinx()
        levels = np.array([log_evidence(f, noise) for f in found])
        beside.plot(counts, levels - levels.max(), "s--", color="tab:blue")
        beside.set(ylabel="log evidence less its largest", yscale="symlog")
        for n, f, level in zip(counts, found, levels, strict=True):
            print(f"{label} {n:3d}: log evidence {level - levels.max():10.1f}, unseen {missed(f):7.2f} N")
    figure.savefig(given.out, dpi=100)


if __name__ == "__main__":
    main()
