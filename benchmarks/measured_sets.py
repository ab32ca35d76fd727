"""Measured records of others: `python -m benchmarks.measured_sets FOLDER [SET ...]`.

FOLDER holds npz files of public benchmark records (arrays u, y, Ts or t, seg_name, seg_start, seg_stop, n_init), which
are not part of this project. RMSE of the free run, test segments where a set has them, otherwise in sample; the state
at most from the first n_init samples, and beside it from the first tenth.
"""

import argparse
import os
from itertools import product
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from time import process_time

import numpy as np

from thrustd.core.measures import rms
from thrustd.identify.first_state import simulated
from thrustd.identify.segments import FORCE, Segment, segments_of
from thrustd.identify.structures import structure_named
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.records.recording import make_recording

DEFAULT = "hw-pwl+prandtl-ishlinskii"
SETS = ("wh2009", "robot_arm_abb", "ced_prbs", "hdrb_rubber_bearing", "oca_shear_elastomer")
PAIRS = {
    "wh2009": [("train", "test")],
    "robot_arm_abb": [("est", "val1")],
    "ced_prbs": [(f"prbs{i}_train", f"prbs{i}_test") for i in (1, 2, 3)],
    "hdrb_rubber_bearing": [("all", "all")],
    "oca_shear_elastomer": [(f"shear_relaxation{x}", f"shear_relaxation{x}") for x in ("", "_0d1", "_1", "_2", "_5")],
}
STRUCTURES = {"wh2009": "wiener-hammerstein", "ced_prbs": "hw-pwl"}
EVERY = {"robot_arm_abb": 10}  # sample, and means of so many


def segments(data: dict[str, np.ndarray], name: str, every: int = 1, means: bool = False) -> list[Segment]:
    at = list(data["seg_name"]).index(name)
    part = slice(int(data["seg_start"][at]), int(data["seg_stop"][at]), 1 if means else every)
    u, y = data["u"][part].astype(float), data["y"][part].astype(float)
    if means:
        u, y = (column[: len(column) // every * every].reshape(-1, every).mean(axis=1) for column in (u, y))
    step_s = float(data["Ts"]) * every
    time_s = data["t"][part].astype(float) if "t" in data else np.arange(len(u)) * (step_s if step_s > 0 else 1.0)
    new = np.concatenate(([True], np.diff(time_s) > 0))
    return segments_of([make_recording(name, {"time_s": time_s[new], "deformation_mm": u[new], FORCE: y[new]})])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("sets", nargs="*", default=SETS, metavar="SET", help=", ".join(SETS))
    given = parser.parse_args()
    print("set                  fitted to               in sample  from rest  first tenth   CPU")
    for name in given.sets:
        data = dict(np.load(given.folder / f"{name}.npz"))
        skip = int(data["n_init"])
        structure = structure_named(STRUCTURES.get(name, DEFAULT))
        taken = [(EVERY[name], means) for means in (False, True)] if name in EVERY else [(1, False)]
        for (fitted_to, judged_on), (every, means) in product(PAIRS[name], taken):
            train = segments(data, fitted_to, every, means)
            started = process_time()
            fitted = structure.fit(train, BlockFits(), None)
            spent = process_time() - started
            seen = np.concatenate([s.force_n - fitted.simulate(s) for s in train])
            errors = []
            for s in segments(data, judged_on, every, means):
                rest = fitted.simulate(s)
                errors.append(((s.force_n - rest)[skip:], (s.force_n - simulated(fitted.simulate, s, rest))[skip:]))
            rested, begun = (np.concatenate(column) for column in zip(*errors, strict=True))
            figures = list(map(rms, (seen, rested, begun)))
            print(
                f"{name:20s} {'means of ' + fitted_to if means else fitted_to:20s} "
                + " ".join(f"{f:11.5g}" for f in figures)
                + f" {spent:8.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
