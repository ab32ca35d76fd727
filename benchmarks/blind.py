"""The blind benchmark: hide effects, diagnose, extend, and count. `python -m benchmarks.blind [options]`.

Per seed one mount: its quiet bench is identified once as `thrustd identify` does, then every effect is hidden in turn
at every strength (thrustd.twin.hide). The truth is read only for scoring. Mounts of generators that are not ours are in
`make foreign`.
Every case is one line of JSON in `--results`; cases that stand there are not run again, and the table is of all lines.

    python -m benchmarks.blind                                      everything, hours on one core
    python -m benchmarks.blind --seeds 1 --strengths 3 --kinds single
    python -m benchmarks.blind --table                              only the table of what has been run
"""

import argparse
import json
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from rich.console import Console

from benchmarks.blind_table import print_table
from benchmarks.kept import Kept
from thrustd.core.errors import ThrustdError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.diagnose_report import DiagnoseReport
from thrustd.identify.identify import identify
from thrustd.model.artifact import ModelSpec
from thrustd.records.recording import Recording
from thrustd.twin.disturbance import DISTURBANCES, MULLINS_BETA
from thrustd.twin.hide import Case, hidden_case

EFFECTS = sorted(DISTURBANCES)
UNKNOWN = {"hydraulic_line": "hydraulic_pressure_bar", "bleed_duct": "bleed_valve_pct"}  # and what they follow
DAHL_YIELD = (
    0.776  # Bouc-Wen's yield over Dahl's: least squares of 1 - h, -1 + exp(1 - h) on -1 + 2 exp(-h) over 8 yields
)
QUIET_RECORDS = 10  # cases with nothing hidden per seed: other flights of the same mount


class Records(NamedTuple):
    bench: Recording
    measured: Recording
    heldout: Recording
    parameters: dict[str, float]  # truth, by "effect.parameter"


class Wanted(NamedTuple):
    """One case: `flight` numbers the flights of one mount (0: the first)."""

    kind: str
    effects: tuple[str, ...]
    seed: int
    strength: float
    flight: int = 0

    @property
    def key(self) -> str:
        effects = "+".join(self.effects) or "none"
        return f"twin {self.kind} {effects} {self.seed} {self.strength:g} {self.flight}"


def make(case: Wanted) -> Records:
    hidden = hidden_case(case.effects or ("none",), case.seed, case.strength, flight=case.flight)
    return Records(hidden.bench, hidden.measured, hidden.heldout, twin_truth(hidden))


def twin_truth(hidden: Case) -> dict[str, float]:
    """True parameters by "effect.parameter", in the effect's own terms where twin and effect differ in their law.

    Dahl's yield becomes that of the Bouc-Wen loop nearest to its reversal curve in least squares. The twin's weight
    takes a share off the deformation x, the effect adds one to the force F; with F = k x + k3 x^3 the second is the
    first times x F'(x) / F, averaged with F^2 as least squares does.
    """
    truth = {f"{e}.{p}": v for e, values in hidden.truth["parameters"].items() for p, v in values.items()}
    if "hysteresis.yield_mm" in truth:
        truth["hysteresis.yield_mm"] *= DAHL_YIELD
    x, mount = hidden.measured["deformation_mm"], hidden.truth["mount"]
    if "mullins_softening.softening" in truth:
        stored_n_mm = float(np.max(mount["stiffness_n_mm"] * x**2 / 2 + mount["cubic_n_mm3"] * x**4 / 4))
        reach_n_mm = truth["mullins_softening.energy_n_mm"] + MULLINS_BETA * stored_n_mm
        truth["mullins_softening.softening"] *= float(np.tanh(stored_n_mm / reach_n_mm))
    if "engine_weight.stiffening_1_n" in truth:
        force_n = mount["stiffness_n_mm"] * x + mount["cubic_n_mm3"] * x**3
        steeper_n = force_n + 2 * mount["cubic_n_mm3"] * x**3  # x times the slope of the force
        truth["engine_weight.stiffening_1_n"] *= float(np.sum(steeper_n * force_n) / np.sum(force_n**2))
    return truth


def run(case: Wanted, model: ModelSpec) -> dict[str, Any]:
    """One case as a line of the results."""
    records = make(case)
    line: dict[str, Any] = case._asdict() | {"key": case.key}
    begin = time.process_time()
    report = diagnose(model, [records.measured])
    line |= {"cpu_s": time.process_time() - begin, "said": list(report.verdict), **judged(case, report)}
    line |= {"own_n": report.own_error_n, "before_n": report.rmse_before_n, "after_n": report.rmse_after_n}
    line["best"] = [[c.effect, round(c.rmse_after_n, 2), list(c.separable_from)] for c in report.candidates[:4]]
    line["depends_on"] = [d.channel for d in report.depends_on]
    if case.effects and line["right"]:
        line |= extended(model, records, report)
    return line


def judged(case: Wanted, report: DiagnoseReport) -> dict[str, bool]:
    """Right, and if not, whether the truth was at least named as a look-alike."""
    said, first = set(report.verdict), report.verdict[0]
    named = {alike for c in report.candidates if c.in_verdict for alike in c.separable_from} | said
    excused = bool(case.effects) and set(case.effects) <= named
    if not case.effects:
        return {"right": said == {"none"}, "excused": False}
    if case.kind == "unknown":
        channels = [d.channel for d in report.depends_on]
        return {"right": said == {"unknown"} and UNKNOWN[case.effects[0]] in channels[:1], "excused": False}
    if case.kind == "single":
        return {"right": first == case.effects[0], "exact": said == set(case.effects), "excused": excused}
    return {"right": set(case.effects) <= said, "exact": said == set(case.effects), "excused": excused}


def extended(model: ModelSpec, records: Records, report: DiagnoseReport) -> dict[str, Any]:
    """Fall of the error on the held-out record, and whether the truth lies inside its 95 % interval.

    What is unknown is added as the free curve of the channel that it follows.
    """
    names = [c.name for c in report.candidates if c.in_verdict] or [d.name for d in report.depends_on[:1]]
    try:
        result = extend(model, [records.measured], names)
    except ThrustdError as problem:
        return {"refused": str(problem)}
    before, after = compare({"before": model, "after": result.spec}, [records.heldout]).comparisons
    line: dict[str, Any] = {"heldout_before_n": before.rmse_n, "heldout_after_n": after.rmse_n, "intervals": []}
    truths = dict(records.parameters)
    if "hysteresis_dahl" in names and "hysteresis.yield_mm" in truths:  # the twin's own law: nothing is converted
        truths["hysteresis.yield_mm"] /= DAHL_YIELD
    for p in result.parameters:
        truth = truths.get(f"{p.effect}.{p.name}")
        if truth is not None:
            line["intervals"].append([f"{p.effect}.{p.name}", truth, p.value, p.std])
    return line


def wanted(options: argparse.Namespace) -> Iterator[Wanted]:
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        kinds = options.kinds
        if "single" in kinds:
            for strength in options.strengths:
                yield from (Wanted("single", (e,), seed, strength) for e in options.effects)
        if "unknown" in kinds:
            yield from (Wanted("unknown", (e,), seed, 3.0) for e in UNKNOWN)
        if "pair" in kinds:
            rng = np.random.default_rng([seed, 5])
            for _ in range(4):
                one, two = rng.choice(EFFECTS, 2, replace=False)
                yield Wanted("pair", (str(one), str(two)), seed, 3.0)
        if "none" in kinds:
            yield from (Wanted("none", (), seed, 1.0, flight) for flight in range(QUIET_RECORDS))


def quiet_error_n(model: ModelSpec, case: Wanted) -> float:
    """Error of the same model on the held-out record of the same mount where nothing is hidden."""
    plain = make(case._replace(effects=(), strength=1.0))
    return float(compare({"quiet": model}, [plain.heldout]).comparisons[0].rmse_n)


def kept(folder: Path, case: Wanted) -> tuple[ModelSpec, float]:
    """Model and quiet error of a seed from the folder, or made and put there."""
    path = folder / f"twin-{case.seed}.json"
    if path.exists():
        quiet_n = json.loads(path.with_suffix(".quiet").read_text())
        return msgspec.json.decode(path.read_bytes(), type=ModelSpec), quiet_n
    model = identify([make(case._replace(effects=(), flight=0)).bench], name=f"seed{case.seed}").spec
    quiet_n = quiet_error_n(model, case._replace(flight=0))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".quiet").write_text(json.dumps(quiet_n))
    path.write_bytes(msgspec.json.encode(model))
    return model, quiet_n


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--strengths", type=float, nargs="+", default=[3.0, 1.0, 2.0])
    parser.add_argument("--kinds", nargs="+", default=["none", "single", "pair", "unknown"])
    parser.add_argument("--effects", nargs="+", default=EFFECTS)
    parser.add_argument("--results", type=Path, default=Path("out/blind.jsonl"))
    parser.add_argument("--models", type=Path, default=Path("out/blind-models"), help="identified models are kept here")
    parser.add_argument("--table", action="store_true", help="print the table of what has been run, run nothing")
    options = parser.parse_args()
    console = Console(width=200)
    lines = Kept(options.results).rows()
    if not options.table:
        done = {line["key"] for line in lines}
        for case in wanted(options):
            if case.key not in done:
                lines.append(one(case, options, console))
    print_table(lines, console)


def one(case: Wanted, options: argparse.Namespace, console: Console) -> dict[str, Any]:
    model, quiet_n = kept(options.models, case)
    try:
        line = run(case, model) | {"quiet_n": quiet_n}
    except Exception as problem:  # a crash is a result too: counted as wrong, told with its trace
        trace = traceback.format_exc()
        line = case._asdict() | {
            "key": case.key,
            "right": False,
            "said": ["crash"],
            "problem": repr(problem),
            "trace": trace,
        }
    Kept(options.results).add(line)
    mark = "ok   " if line["right"] else "alike" if line.get("excused") else "WRONG"
    fall = f"{line['heldout_after_n'] / quiet_n:.2f} x" if "heldout_after_n" in line else ""
    console.print(f"{mark} {case.key} -> {', '.join(line['said'])} {fall}", highlight=False, soft_wrap=True)
    return line


if __name__ == "__main__":
    main()
