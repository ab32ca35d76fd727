"""The thesis' table beside ours from the twin's bench: `python benchmarks/thesis_table.py [--hours H] [--validate H]`.

Prints every structure's error on unseen random steps, and what steps only, a sine only, and steps with a multisine are
worth on each other's data; draws docs/hysteresis-loops.png and docs/errors-one-hour.png (thesis figs. 14.5 and 14.6).
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.identify.fit_hw_pwl import fit_hw_pwl
from thrustd.identify.identify import score_structure
from thrustd.identify.report import as_table, errors_of
from thrustd.identify.segments import segments_of
from thrustd.identify.structures import Fitted, shelf
from thrustd.identify.structures.structure import of_spec
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


def table_of_structures(train: list[Recording], unseen: list[Recording], console: Console) -> dict[str, Fitted]:
    scores, fitted = [], {}
    for name, structure in shelf().items():
        found, score = score_structure(structure, train, unseen, None, None)
        scores.append(score)
        fitted[name] = found
    console.print(as_table(scores))
    beside = Table(title="RMSE on validation data, N")
    for column in ("structure", "thesis", "here"):
        beside.add_column(column)
    for score in scores:
        here = f"{score.validation.rmse_n:.0f}" if score.validation.stable else "unstable"
        beside.add_row(score.title, THESIS_N.get(score.structure, "-"), here)
    console.print(beside)
    return fitted


def table_of_programmes(hours: float, console: Console) -> None:
    """HW-PWL fitted on one kind of test, run on the others."""
    kinds = {
        "steps": [step_bench(hours, 11)],
        "sine 0.003 Hz": [sine_bench(hours / 4, 12)],
        "steps + multisine": [step_bench(hours, 11), multisine_bench(hours / 4, 13)],
    }
    unseen = {
        "steps": step_bench(hours / 2, 21),
        "sine 0.003 Hz": sine_bench(hours / 8, 22),
        "multisine": multisine_bench(hours / 8, 23),
    }
    table = Table(title="HW-PWL fitted on one kind of test, RMSE on others, N")
    table.add_column("fitted on")
    for name in unseen:
        table.add_column(name, justify="right")
    for name, records in kinds.items():
        fitted = of_spec(fit_hw_pwl(records).spec, 0)
        table.add_row(name, *(f"{errors_of(fitted, segments_of([r])).rmse_n:.0f}" for r in unseen.values()))
    console.print(table)


def draw_loops(fitted: dict[str, Fitted], folder: Path) -> None:
    (segment,) = segments_of([sine_bench(1.0, 31)])
    last = slice(-round(1000 / 3 / segment.dt_s), None)
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(14, 4), sharey=True, layout="constrained")
    u = segment.inputs["deformation_mm"][last]
    line = np.polyval(np.polyfit(u, segment.force_n[last], 1), u)
    for axis, name in zip(axes, SHOWN, strict=True):
        axis.plot(u, segment.force_n[last] - line, color="0.7", linewidth=2, label="measured")
        axis.plot(u, fitted[name].simulate(segment)[last] - line, color="tab:blue", linewidth=1, label="model")
        axis.set(title=shelf()[name].title, xlabel="deformation, mm")
    axes[0].set_ylabel("force minus a straight line, N")
    axes[0].legend()
    figure.suptitle("Models fitted on random steps, on a 0.003 Hz sine (compare thesis fig. 14.5)")
    figure.savefig(folder / "hysteresis-loops.png", dpi=100)


def draw_errors(fitted: dict[str, Fitted], unseen: Recording, folder: Path) -> None:
    segment = segments_of([unseen])[0]
    hour = slice(0, round(3600 / segment.dt_s), 20)
    figure, axis = plt.subplots(figsize=(12, 5), layout="constrained")
    for name in SHOWN:
        error_n = segment.force_n - fitted[name].simulate(segment)
        axis.plot(segment.time_s[hour] / 60, error_n[hour], linewidth=0.8, label=shelf()[name].title)
    axis.set(
        xlabel="time, min", ylabel="measured minus model, N", title="Errors over one hour (compare thesis fig. 14.6)"
    )
    axis.legend()
    figure.savefig(folder / "errors-one-hour.png", dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--validate", type=float, default=37.0)
    parser.add_argument("--docs", type=Path, default=Path(__file__).parent.parent / "docs")
    given = parser.parse_args()
    console = Console(width=150)
    train, unseen = [step_bench(given.hours, 1)], [step_bench(given.validate, 2)]
    fitted = table_of_structures(train, unseen, console)
    draw_loops(fitted, given.docs)
    draw_errors(fitted, unseen[0], given.docs)
    table_of_programmes(given.hours, console)


if __name__ == "__main__":
    main()
