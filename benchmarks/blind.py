"""The blind benchmark: hide effects, diagnose, extend, and count. `python benchmarks/blind.py [options]`.

Per seed one mount: its quiet bench is identified once, then every effect is hidden in turn at every strength. The
truth is read only for scoring. Two generators: `twin` (thrustd.twin.hide) and `own` (blind_mount.py, other equations,
strength in units of 12 N). Prints one line per case as it goes, then the confusion matrix and the figures of issue 5.

    python benchmarks/blind.py --seeds 5 --strengths 1 2 3          everything, about an hour on two cores
    python benchmarks/blind.py --seeds 1 --strengths 3 --kinds single
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.diagnose.compare import compare
from thrustd.diagnose.diagnose import diagnose
from thrustd.diagnose.extend import extend
from thrustd.errors import ThrustdError
from thrustd.identify.artifact import finished
from thrustd.identify.fit_hw_pwl import fit_hw_pwl
from thrustd.model.artifact import ModelSpec
from thrustd.model.effects import shelf
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.hide import hidden_case

sys.path.insert(0, str(Path(__file__).parent))
import blind_mount

EFFECTS = sorted({effect.word for effect in shelf().values()})
UNKNOWN = {"twin": ("hydraulic_line", "bleed_duct"), "own": ("unknown_cabin", "unknown_n1")}
FOLLOWS = {
    "hydraulic_line": "hydraulic_pressure_bar",
    "bleed_duct": "bleed_valve_pct",
    "unknown_cabin": "cabin_psi",
    "unknown_n1": "n1_pct",
}
OWN_UNIT_N = 12.0


@dataclass(frozen=True, slots=True)
class Records:
    bench: Recording
    measured: Recording
    heldout: Recording
    parameters: dict[str, float]  # truth, by "effect.parameter"


@dataclass(slots=True)
class Score:
    confusion: Counter[tuple[str, str]] = field(default_factory=Counter)
    right: Counter[str] = field(default_factory=Counter)
    total: Counter[str] = field(default_factory=Counter)
    unfair: int = 0  # wrong without its look-alike named
    falls: list[float] = field(default_factory=list)  # held-out error over that of the model where nothing is hidden
    inside: list[bool] = field(default_factory=list)  # truth within 1.96 sigma
    seconds: list[float] = field(default_factory=list)


def make(generator: str, effects: tuple[str, ...], seed: int, strength: float) -> Records:
    if generator == "own":
        tables, sizes = blind_mount.exercise(list(effects), seed, strength * OWN_UNIT_N)
        names = ("bench", "measured", "heldout")
        return Records(*(make_recording(n, t) for n, t in zip(names, tables, strict=True)), sizes)
    case = hidden_case(effects or ("none",), seed, strength)
    truth = {f"{e}.{p}": v for e, values in case.truth.get("parameters", {}).items() for p, v in values.items()}
    return Records(case.bench, case.measured, case.heldout, truth)


def base_model(bench: Recording, seed: int) -> ModelSpec:
    """What `thrustd identify` makes of the quiet bench."""
    return finished(fit_hw_pwl([bench], name=f"seed{seed}").spec, [bench], [bench], {})


def judged(generator: str, effects: tuple[str, ...], seed: int, strength: float, model: ModelSpec) -> tuple:
    records = make(generator, effects, seed, strength)
    begin = time.perf_counter()
    report = diagnose(model, [records.measured])
    return records, report, time.perf_counter() - begin


def score_case(
    score: Score, generator: str, effects: tuple[str, ...], seed: int, strength: float, model: ModelSpec, quiet_n: float
) -> str:
    records, report, seconds = judged(generator, effects, seed, strength, model)
    score.seconds.append(seconds)
    unlisted = [e for e in effects if e in FOLLOWS]
    truth = {"unknown"} if unlisted else set(effects) or {"none"}
    said = set(report.verdict)
    kind = "none" if not effects else "unknown" if unlisted else "pair" if len(effects) > 1 else f"single {strength:g}x"
    right = said == truth
    if unlisted:
        right = right and bool(report.depends_on) and FOLLOWS[unlisted[0]] == report.depends_on[0].channel
    elif len(effects) == 1:
        right = report.verdict[0] == effects[0]
        alike = report.candidates[0].separable_from if report.candidates else ()
        score.unfair += not right and effects[0] not in alike
    score.total[kind] += 1
    score.right[kind] += right
    score.confusion["+".join(effects) or "none", "+".join(report.verdict)] += 1
    note = ""
    if effects and not unlisted and right:
        note = extended(score, model, records, report, quiet_n)
    mark = "ok   " if right else "WRONG"
    return f"{mark} seed {seed} {strength:g}x {'+'.join(effects) or 'none'} -> {', '.join(report.verdict)} {note}"


def extended(score: Score, model: ModelSpec, records: Records, report, quiet_n: float) -> str:
    names = [c.name for c in report.candidates if c.in_verdict]
    try:
        result = extend(model, [records.measured], names)
    except ThrustdError as problem:
        return f"extend: {problem}"
    after = compare({"after": result.spec}, [records.heldout]).comparisons[0].rmse_n
    score.falls.append(after / quiet_n)
    for p in result.parameters:
        truth = records.parameters.get(f"{p.effect}.{p.name}")
        if truth is not None:
            score.inside.append(abs(p.value - truth) <= 1.96 * p.std)
    return f"held-out {after:.1f} N, nothing hidden {quiet_n:.1f} N"


def report_score(score: Score, console: Console) -> None:
    table = Table(title="Verdicts: rows hidden, columns said")
    said = sorted({b for _, b in score.confusion})
    table.add_column("hidden")
    for name in said:
        table.add_column(name, justify="right")
    for hidden in sorted({a for a, _ in score.confusion}):
        table.add_row(hidden, *(str(score.confusion[hidden, s] or "") for s in said))
    console.print(table)
    for kind in sorted(score.total):
        console.print(f"{kind}: {score.right[kind]} of {score.total[kind]} right")
    console.print(f"wrong without its look-alike named: {score.unfair}")
    if score.falls:
        falls = np.array(score.falls)
        console.print(
            f"held-out error after extend over that where nothing is hidden: median {np.median(falls):.3f},"
            f" 90 % below {np.quantile(falls, 0.9):.3f}; {np.mean(falls <= 1.15):.0%} of {falls.size} at most 1.15"
        )
    if score.inside:
        console.print(f"true parameter inside its 95 % interval: {np.mean(score.inside):.0%} of {len(score.inside)}")
    console.print(f"diagnose: median {np.median(score.seconds):.1f} s, longest {max(score.seconds):.1f} s")


def cases(kinds: list[str], strengths: list[float], seed: int, generator: str, effects: list[str]) -> list[tuple]:
    found: list[tuple[tuple[str, ...], float]] = []
    if "none" in kinds:
        found.append(((), 1.0))
    if "single" in kinds:
        found += [((e,), s) for e in effects for s in strengths]
    if "pair" in kinds:
        rng = np.random.default_rng([seed, 5])
        for _ in range(4):
            one, two = rng.choice(EFFECTS, 2, replace=False)
            found.append(((str(one), str(two)), 3.0))
    if "unknown" in kinds:
        found += [((e,), 3.0) for e in UNKNOWN[generator]]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--strengths", type=float, nargs="+", default=[1.0, 2.0, 3.0])
    parser.add_argument("--kinds", nargs="+", default=["none", "single", "pair", "unknown"])
    parser.add_argument("--effects", nargs="+", default=EFFECTS)
    parser.add_argument("--generator", choices=("twin", "own"), default="twin")
    parser.add_argument("--models", type=Path, help="folder that keeps the identified models between runs")
    options = parser.parse_args()
    console, score = Console(width=200), Score()
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        plain = make(options.generator, (), seed, 1.0)
        model = kept(options.models, options.generator, seed, plain.bench)
        quiet_n = compare({"quiet": model}, [plain.heldout]).comparisons[0].rmse_n
        for effects, strength in cases(options.kinds, options.strengths, seed, options.generator, options.effects):
            line = score_case(score, options.generator, effects, seed, strength, model, quiet_n)
            console.print(line, highlight=False)
    report_score(score, console)


def kept(folder: Path | None, generator: str, seed: int, bench: Recording) -> ModelSpec:
    """The model of a seed from the folder, or identified and put there."""
    path = folder / f"{generator}-{seed}.json" if folder else None
    if path and path.exists():
        return msgspec.json.decode(path.read_bytes(), type=ModelSpec)
    model = base_model(bench, seed)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(msgspec.json.encode(model))
    return model


if __name__ == "__main__":
    main()
