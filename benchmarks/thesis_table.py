"""The thesis' table beside ours from the twin's bench: `python -m benchmarks.thesis_table [--pictures DIR]`.

Prints every structure's error on random steps of another seed, whether the thesis' order comes out again, and what
steps only, a sine only, and steps with a multisine are worth on each other's data. The bench is simulated at 100 Hz;
everything is fitted and judged on means of 0.1 s (`--rate`). With `--pictures`: figs. 14.5 and 14.6 of the thesis.
"""

import argparse
from pathlib import Path
from time import process_time
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.identify.identify import score_structure
from thrustd.identify.report import as_table, errors_of
from thrustd.identify.segments import segments_of
from thrustd.identify.structures import Fitted, shelf
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.records.recording import Recording
from thrustd.twin.bench import multisine_bench, sine_bench, step_bench

THESIS_N = {  # table 14.1 and sections 14.2 to 14.5, RMSE on validation data, N
    "maxwell": "150 to 300",
    "kelvin-voigt": "150 to 300",
    "polynomial-ols": "103",
    "arx": "about 300",
    "armax": "about 300",
    "oe-2-2": "142 (144)",
    "oe-6-4": "143",
    "narx": "poor, unstable",
    "hammerstein": "59",
    "wiener": "61",
    "hw-pwl": "56",
}
SHOWN = ("polynomial-ols", "oe-2-2", "hw-pwl", "hw-pwl+prandtl-ishlinskii")


FAR = 0.65  # of the static polynomial's error: "far better"; 61 / 103 in the thesis
STATIC = "polynomial-ols"


class Claim(NamedTuple):
    """The error of every structure in `names` lies on the right side of `factor` times that of `than`."""

    text: str
    names: tuple[str, ...]
    worse: bool
    than: str
    factor: float = 1.0

    def met(self, rmse_n: dict[str, float]) -> bool:
        limit_n = self.factor * rmse_n[self.than]
        return all((rmse_n[name] > limit_n) == self.worse for name in self.names)


CLAIMS = (
    Claim("Maxwell, Kelvin-Voigt worse than static", ("maxwell", "kelvin-voigt"), True, STATIC),
    Claim("ARX, ARMAX worse than static", ("arx", "armax"), True, STATIC),
    Claim("OE worse than static", ("oe-2-2", "oe-6-4"), True, STATIC),
    Claim(f"Hammerstein, Wiener, HW-PWL below {FAR} static", ("hammerstein", "wiener", "hw-pwl"), False, STATIC, FAR),
    Claim("HW-PWL + Prandtl-Ishlinskii better than HW-PWL", ("hw-pwl+prandtl-ishlinskii",), False, "hw-pwl"),
    Claim("HW-PWL + Bouc-Wen better than HW-PWL", ("hw-pwl+bouc-wen",), False, "hw-pwl"),
)


def table_of_structures(train: list[Recording], unseen: list[Recording], console: Console) -> dict[str, Fitted]:
    scores, fitted, fits = [], {}, BlockFits()
    for name, structure in shelf().items():
        fitted[name], score = score_structure(structure, train, unseen, fits)
        scores.append(score)
    console.print(as_table(scores))
    beside = Table(title="RMSE on validation data, N")
    for column in ("structure", "thesis", "here"):
        beside.add_column(column, justify="left" if column == "structure" else "right")
    for score in scores:
        here = f"{score.validation.rmse_n:.0f}" if score.validation.stable else "unstable"
        beside.add_row(score.title, THESIS_N.get(score.structure, "-"), here)
    console.print(beside)
    rmse_n = {s.structure: s.validation.rmse_n if s.validation.stable else np.inf for s in scores}
    for claim in CLAIMS:
        console.print(f"{'met    ' if claim.met(rmse_n) else 'NOT met'}  {claim.text}", highlight=False)
    return fitted


def table_of_programmes(hours: float, rate_hz: float, console: Console) -> None:
    """HW-PWL fitted on one kind of test, run on the others (other seeds)."""
    steps = step_bench(hours, 11).resample(rate_hz)
    kinds = {
        "steps": [steps],
        "sine 0.003 Hz": [sine_bench(hours / 4, 12).resample(rate_hz)],
        "steps + multisine": [steps, multisine_bench(hours / 4, 13).resample(rate_hz)],
    }
    unseen = {
        "steps": step_bench(hours / 2, 21).resample(rate_hz),
        "sine 0.003 Hz": sine_bench(hours / 4, 22).resample(rate_hz),
        "multisine": multisine_bench(hours / 4, 23).resample(rate_hz),
    }
    table = Table(title="HW-PWL fitted on one kind of test, RMSE on others, N (thesis: on the sine 108 and 13)")
    table.add_column("fitted on")
    for name in unseen:
        table.add_column(name, justify="right")
    rmse_n = {}
    for name, records in kinds.items():
        fitted = shelf()["hw-pwl"].fit(segments_of(records), BlockFits(), None)
        rmse_n[name] = [errors_of(fitted, segments_of([r])).rmse_n for r in unseen.values()]
        table.add_row(name, *(f"{value:.0f}" for value in rmse_n[name]))
    console.print(table)
    on_sine = {name: row[1] for name, row in rmse_n.items()}
    for name in ("sine 0.003 Hz", "steps + multisine"):
        verdict = "met    " if on_sine[name] < on_sine["steps"] else "NOT met"
        console.print(f"{verdict}  on a sine, fitted on {name} better than fitted on steps", highlight=False)


def draw_loops(fitted: dict[str, Fitted], rate_hz: float, folder: Path) -> None:
    (segment,) = segments_of([sine_bench(1.0, 31).resample(rate_hz)])
    last = slice(-round(1000 / 3 / segment.dt_s), None)
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(14, 4), sharey=True, layout="constrained")
    u = segment.inputs["deformation_mm"][last]
    line = np.polyval(np.polyfit(u, segment.force_n[last], 1), u)
    for axis, name in zip(axes, SHOWN, strict=True):
        axis.plot(u, segment.force_n[last] - line, color="0.7", linewidth=2, label="measured")
        axis.plot(u, fitted[name].simulate(segment)[last] - line, color="tab:blue", linewidth=1, label="model")
        axis.set_title(shelf()[name].title, fontsize=10)
        axis.set_xlabel("deformation, mm")
    axes[0].set_ylabel("force minus a straight line, N")
    axes[0].legend()
    figure.suptitle("Models fitted on random steps, on a 0.003 Hz sine (compare thesis fig. 14.5)")
    figure.savefig(folder / "hysteresis-loops.png", dpi=100)


def draw_errors(fitted: dict[str, Fitted], unseen: Recording, folder: Path) -> None:
    segment = segments_of([unseen])[0]
    hour = slice(0, round(3600 / segment.dt_s))
    figure, axis = plt.subplots(figsize=(12, 5), layout="constrained")
    for name in SHOWN:
        error_n = segment.force_n - fitted[name].simulate(segment)
        axis.plot(segment.time_s[hour] / 60, error_n[hour], linewidth=0.7, label=shelf()[name].title)
    axis.axhline(0.0, color="0.4", linewidth=0.6)
    axis.margins(x=0.01)
    axis.set(
        xlabel="time, min", ylabel="measured minus model, N", title="Errors over one hour (compare thesis fig. 14.6)"
    )
    figure.legend(loc="outside lower center", ncols=len(SHOWN), frameon=False)
    figure.savefig(folder / "errors-one-hour.png", dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--validate", type=float, default=37.0)
    parser.add_argument("--rate", type=float, default=10.0, help="Hz; means of so long are fitted and judged")
    parser.add_argument("--pictures", type=Path, help="folder to draw them into")
    given = parser.parse_args()
    console = Console(width=150)
    train = [step_bench(given.hours, 1).resample(given.rate)]
    unseen = [step_bench(given.validate, 2).resample(given.rate)]
    fitted = table_of_structures(train, unseen, console)
    if given.pictures is not None:
        given.pictures.mkdir(parents=True, exist_ok=True)
        draw_loops(fitted, given.rate, given.pictures)
        draw_errors(fitted, unseen[0], given.pictures)
    table_of_programmes(given.hours, given.rate, console)
    console.print(
        f"{given.hours:g} h to fit, {given.validate:g} h to validate, means of {1 / given.rate:g} s; "
        f"{process_time():.0f} s of processor time",
        highlight=False,
    )


if __name__ == "__main__":
    main()
