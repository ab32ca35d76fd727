"""The loop on records of others, through the command line: `python -m benchmarks.foreign [FOLDER] [SET ...]`.

`--records OUT` only writes the measured sets as the CSV files that docs/other-rubber.md names.

FOLDER holds `measured/*.npz` and `foreign/` (default: ../shared/data beside the project), which are no part of it.
Measured sets: a cubic is identified on a record, then `diagnose` and `extend` take turns on it until nothing is named;
printed is what each step named and what `compare` says of the model afterwards, in the output's own unit. Mounts of an
independent generator: what `tools/score_foreign.py` beside the data prints, then the processor time of `diagnose` on
each, and whether its 95 % intervals hold the size that was hidden, where the law has that very number. Everything is in
sample where a set has one record of its kind only, and says so.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.core.signals import STANDARD_GRAVITY_M_S2

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
STEPS = 4  # at most
DAMPER_HZ, N_PER_V = 200.0, 35.15
HIDDEN = {  # of answers.json: the parameter that is this number
    "fric": "friction_n",
    "soft": "softening",
    "gap": "gap_mm",
    "delay": "delay_s",
    "area": "drag_area_m2",
    "mass": "mass_kg",
    "mm_per_K": "expansion_mm_k",
}


class Set(NamedTuple):
    """One record as columns of a file, and what the command line is told of them."""

    file: str
    title: str
    columns: dict[str, Floats]
    words: tuple[str, ...]


def bearing(data: Any) -> list[Set]:
    columns = {"shear_cm": data["u"], "load_tonf": data["y"]}
    return [
        Set(
            "bearing", "rubber bearing, tonf", columns, ("--input", "shear_cm", "--output", "load_tonf", "--rate", "20")
        )
    ]


def elastomer(data: Any) -> list[Set]:
    words = ("--input", "strain", "--output", "stress_kPa", "--time", "t_s")
    found = []
    for i, name in enumerate(data["seg_name"]):
        part = slice(int(data["seg_start"][i]), int(data["seg_stop"][i]))
        if "relaxation" in str(name):
            columns = {"t_s": data["t"][part], "strain": data["u"][part], "stress_kPa": data["y"][part]}
            found.append(
                Set(f"oca{str(name).removeprefix('shear_relaxation')}", f"elastomer {name}, kPa", columns, words)
            )
    return found


def damper(data: Any) -> list[Set]:
    speed, force = data["u"][:2000], data["y"][:2000]
    moved = np.cumsum(speed) / DAMPER_HZ
    words = ("--input", "x_cm", "--output", "force_N", "--rate", f"{DAMPER_HZ:g}")
    both = [("keio", "as recorded", force), ("keio_turned", "force turned", -force)]
    return [Set(file, f"MR damper, {how}, N", {"x_cm": moved, "force_N": f}, words) for file, how, f in both]


def drive(data: Any) -> list[Set]:
    part = slice(int(data["seg_start"][0]), int(data["seg_stop"][0]))
    step_s, moved = float(data["Ts"]), data["y"][part].ravel()
    columns = {
        "t_s": np.arange(len(moved)) * step_s,
        "q_m": moved,
        "accel_x_g": savgol_filter(moved, 51, 3, 2, step_s) / STANDARD_GRAVITY_M_S2,
        "force_N": N_PER_V * data["u"][part].ravel(),
    }
    return [
        Set("emps", "drive, force from motion, N", columns, ("--input", "q_m", "--output", "force_N", "--time", "t_s"))
    ]


SETS = {
    "hdrb_rubber_bearing": bearing,
    "oca_shear_elastomer": elastomer,
    "mrdamper_keio": damper,
    "emps": drive,
}


def called(*words: object) -> dict[str, Any] | str:
    """What a verb printed as JSON, or its one line of refusal."""
    done = subprocess.run([sys.executable, "-m", "thrustd", *map(str, words), "--json"], capture_output=True, text=True)
    if done.returncode:
        return done.stderr.strip().splitlines()[-1]
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def written(one: Set, folder: Path) -> Path:
    table = np.column_stack([np.asarray(column, float) for column in one.columns.values()])
    np.savetxt(folder / f"{one.file}.csv", table, delimiter=",", header=",".join(one.columns), comments="")
    return folder / f"{one.file}.csv"


def walk(one: Set, folder: Path) -> None:
    """Press on until nothing is named."""
    record, model = written(one, folder), folder / "model_0.json"
    print(f"\n{one.title}")
    called("identify", record, *one.words, "--structure", "polynomial-ols", "-o", model)
    print(f"  cubic{'':44s} {left(model, record, one):9.4g}")
    for step in range(STEPS):
        before = cpu_s()
        found = called("diagnose", model, record, *one.words, *trusting(one))
        if isinstance(found, str):
            print(f"  {found}")
            return
        verdict = found["verdict"] if isinstance(found["verdict"], list) else [found["verdict"]]
        said = f"{' + '.join(verdict)} ({found['grade']})"
        floor, spent = f"floor {found['floor_n']:.2g}", f"{cpu_s() - before:.1f} s"
        print(f"  {said:49s} {found['rmse_after_n']:9.4g} held back  {floor}  {spent}")
        if set(verdict) <= {"none", "unknown"}:
            return
        wider = folder / f"model_{step + 1}.json"
        asked = [word for effect in verdict for word in ("--effect", effect)]
        added = called("extend", model, record, *one.words, *trusting(one), *asked, "-o", wider)
        if isinstance(added, str):
            print(f"  {added}")
            return
        model = wider
        print(f"    added, whole record{'':29s} {left(model, record, one):9.4g}", flush=True)


def trusting(one: Set) -> list[str]:
    return ["--trust-units"] if "accel_x_g" in one.columns else []


def left(model: Path, record: Path, one: Set) -> float:
    found = called("compare", model, record, *one.words, *trusting(one))
    return float("nan") if isinstance(found, str) else float(found["comparisons"][0]["rmse_n"])


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def mounts(data: Path, work: Path) -> None:
    """What `diagnose` costs on each, and where its intervals hold what was hidden; behind the judge, by its models."""
    spent_s, held = [], []
    for name, answer in json.loads((data / "answers.json").read_text()).items():
        before = cpu_s()
        found = called("diagnose", work / name / "base.json", data / name / "measured.parquet")
        spent_s.append(cpu_s() - before)
        said = []
        for candidate in found["candidates"] if isinstance(found, dict) else ():
            for key, number in HIDDEN.items():
                told = candidate["parameters"].get(number)
                if key in answer and told and candidate["in_verdict"]:
                    true, half = answer[key], SIGMAS_95 * told["std"]
                    held.append(abs(told["value"] - true) <= half)
                    said.append(f"{number} {told['value']:.4g} +- {half:.2g}, true {true:.4g}")
        print(f"{name} {answer['hidden'][:44]:44s} {spent_s[-1]:7.1f} s  {'; '.join(said)}", flush=True)
    print(f"95 % intervals that hold the truth: {sum(held)} of {len(held)}")
    print(f"diagnose, processor time: {np.median(spent_s):.1f} s median, {max(spent_s):.1f} s at most")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=DATA, type=Path)
    parser.add_argument("sets", nargs="*", default=[*SETS, "mounts"], metavar="SET", help=", ".join([*SETS, "mounts"]))
    parser.add_argument(
        "--records", type=Path, metavar="OUT", help="write the measured sets as CSV files, nothing else"
    )
    given = parser.parse_args()
    for name in given.sets:
        path = given.folder / "measured" / f"{name}.npz"
        if name in SETS and path.exists():
            for one in SETS[name](np.load(path)):
                if given.records:
                    given.records.mkdir(parents=True, exist_ok=True)
                    print(f"{written(one, given.records)}: {one.title}; {' '.join(one.words)}")
                    continue
                with tempfile.TemporaryDirectory() as folder:
                    walk(one, Path(folder))
        elif name in SETS:
            print(f"{name}: not beside the project")
    judge = given.folder.parent / "tools" / "score_foreign.py"
    if "mounts" in given.sets and judge.exists() and not given.records:
        print("\nmounts of an independent generator, N", flush=True)
        work = Path("out/foreign")
        subprocess.run([sys.executable, judge, "--bin", Path(sys.executable).parent, "--work", work], check=False)
        mounts(given.folder / "foreign", work)


if __name__ == "__main__":
    main()
