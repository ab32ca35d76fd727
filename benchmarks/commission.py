"""A stranger's aircraft from bench records to a scored flight: `python -m benchmarks.commission [--aircraft N]`.

Per aircraft: bench, weight and chamber records of other mounts, `commission`, zero, tethered run, and a flight with the
hostile knobs of the same seed: scored with the folder as it was made, then with the calibration.
"""

import argparse
import json
import statistics
import time
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.__main__ import main as thrustd
from thrustd.installation.shipped import shipped
from thrustd.records.files import write_recording
from thrustd.twin.bench import RIG, step_bench, weight_bench
from thrustd.twin.mount import LOWER, UPPER

HOURS, BENCH_HZ = 4.0, 20.0
MINUTES = 12.0


def said(*words: str) -> str:
    """Standard output of a verb; RuntimeError with what it complained of."""
    out, complaint = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(complaint):
        status = thrustd(list(words))
    if status == 2:
        raise RuntimeError(complaint.getvalue())
    return out.getvalue()


def records(folder: Path, seed: int, hours: float) -> list[str]:
    """Bench files of one aircraft, as options of `commission`."""
    made = {
        "upper": step_bench(hours, 1000 + seed, UPPER),
        "lower": step_bench(hours, 2000 + seed, LOWER),
        "weight": weight_bench(1.0, 3000 + seed, UPPER),
        "cold": step_bench(1.0, 4000 + seed, UPPER, RIG._replace(room_degc=-10.0)),
        "hot": step_bench(1.0, 5000 + seed, UPPER, RIG._replace(room_degc=50.0)),
    }
    for name, record in made.items():
        write_recording(record.resample(BENCH_HZ), folder / f"{name}.parquet")
    path = {name: str(folder / f"{name}.parquet") for name in made}
    bench = ["--bench", f"upper={path['upper']}", f"lower={path['lower']}"]
    return [*bench, "--weight", path["weight"], "--chamber", path["cold"], path["hot"]]


def flown(folder: Path, log: Path) -> list[tuple[float, float]]:
    """Per engine: RMSE of the fused thrust, N, and truth inside the band, %."""
    scores = json.loads(said("replay", str(log), "--config", str(folder / "hil.toml"), "--json"))["scores"]
    return [
        (scores[engine]["fused"]["rmse_n"], scores[engine]["fused"]["inside_95_pct"]) for engine in ("left", "right")
    ]


def one(folder: Path, seed: int, hours: float) -> tuple[float, list[tuple[float, float]], list[tuple[float, float]]]:
    """Seconds of processor time of `commission`, engines as made, engines calibrated."""
    given = records(folder, seed, hours)
    config, out = str(shipped("deploy/hil.toml", "config")), folder / "aircraft"
    began = time.process_time()
    said("commission", *given, "--aircraft", config, "-o", str(out))
    spent = time.process_time() - began
    hostile = ["--seed", str(seed), "--installation", "hostile", "--config", str(out / "hil.toml")]
    static, flight, file = folder / "static.mcap", folder / "flight.mcap", out / "calibration.toml"
    said("simulate", "--tethered", *hostile, "-o", str(static))
    said("simulate", "--minutes", str(MINUTES), *hostile, "-o", str(flight))
    before = flown(out, flight)
    said("zero", str(static), "-o", str(file))
    said("calibrate", "tether", str(static), "--cell", str(folder / "static-cell.csv"), "-o", str(file))
    text = (out / "hil.toml").read_text()
    (out / "hil.toml").write_text('calibration = "calibration.toml"\n' + text)
    return spent, before, flown(out, flight)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--aircraft", type=int, default=3, metavar="N")
    parser.add_argument("--hours", type=float, default=HOURS, help="of bench per mount")
    given = parser.parse_args()
    shown = Table("aircraft", "commission, s", "as made: N, % inside", "calibrated: N, % inside", title="commission")
    pairs: tuple[list[float], list[float]] = [], []
    for seed in range(101, 101 + given.aircraft):
        with TemporaryDirectory() as folder:
            spent, before, after = one(Path(folder), seed, given.hours)
        words = ["; ".join(f"{rmse:.0f} N, {inside:.1f} %" for rmse, inside in each) for each in (before, after)]
        shown.add_row(str(seed), f"{spent:.0f}", *words)
        print(seed, f"{spent:.0f} s", *words, flush=True)
        for kept, each in zip(pairs, (before, after), strict=True):
            kept += [rmse for rmse, _ in each]
    Console().print(shown)
    print(
        "median RMSE, N: as made, calibrated:", *(f"{statistics.median(each):.0f}" for each in pairs), np.size(pairs[0])
    )


if __name__ == "__main__":
    main()
