"""A diagnosis: verdict, candidates, what is left, advice; for machines and for people."""

from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.search.candidates import NotJudged
from thrustd.diagnose.search.dependence import Dependence
from thrustd.diagnose.search.explained import Explained
from thrustd.diagnose.search.floor import SHOWS
from thrustd.diagnose.search.told import ParameterEstimate, sentences, shown

ON_BLOCKS = "on held-back blocks"
SHOWN = 8  # candidates in the table
REMOVES = 0.99  # of the error before: who leaves more than that removes nothing


@dataclass(frozen=True, slots=True)
class CandidateReport:
    """One effect: what adding it would do on held-back blocks, its numbers, its look-alikes."""

    effect: str  # the word of ICD section 4
    name: str  # what `extend` takes: the effect or the variant of it that fits best
    rmse_before_n: float
    rmse_after_n: float
    parameters: tuple[ParameterEstimate, ...]
    separable_from: tuple[str, ...]  # look-alikes: what these data cannot separate it from
    evidence: str
    in_verdict: bool

    def to_json(self) -> dict[str, Any]:
        return {
            "effect": self.effect,
            "name": self.name,
            "rmse_before_n": self.rmse_before_n,
            "rmse_after_n": self.rmse_after_n,
            "parameters": {p.name: p.to_json() for p in self.parameters},
            "separable_from": list(self.separable_from),
            "evidence": self.evidence,
            "in_verdict": self.in_verdict,
        }


@dataclass(frozen=True, slots=True)
class DiagnoseReport:
    """The verdict and what it rests on."""

    model: str
    recordings: tuple[str, ...]
    verdict: tuple[str, ...]
    candidates: tuple[CandidateReport, ...]  # those of the verdict first, then by what they would remove
    depends_on: tuple[Dependence, ...]
    not_judged: tuple[NotJudged, ...]
    advice: tuple[str, ...]
    rmse_before_n: float
    rmse_after_n: float  # with all effects of the verdict
    own_error_n: float  # what the model leaves where nothing is missing
    promised: bool  # by its identification (else told by the residual's fast end alone)
    grade: str = "strong"  # of the verdict: strong, weak (something is left), cannot be told
    more_left: bool = False  # the rest follows a channel, or is much: something else is missing too
    explained: Explained | None = None  # sample by sample, for pictures
    unit: str = "N"
    judged: str = ON_BLOCKS
    noise_n: float | None = None  # of its own error: from sample to sample, or as promised; none: all of it

    def to_json(self) -> dict[str, Any]:
        return {
            "model": self.model,
            "unit": self.unit,
            "recordings": list(self.recordings),
            "verdict": list(self.verdict),
            "candidates": [c.to_json() for c in self.candidates],
            "depends_on": [_dependence_json(d) for d in self.depends_on],
            "not_judged": [{"effect": n.effect, "reason": n.reason} for n in self.not_judged],
            "advice": list(self.advice),
            "rmse_before_n": self.rmse_before_n,
            "rmse_after_n": self.rmse_after_n,
            "own_error_n": self.own_error_n,
            "own_error_promised": self.promised,
            "grade": self.grade,
            "floor_n": self.own_error_n,
            "noise_n": self.own_error_n if self.noise_n is None else self.noise_n,
            "more_left": self.more_left,
        }

    def print(self, console: Console) -> None:
        grade = "" if self.verdict == ("unknown",) else f" ({self.grade})"
        console.print(f"Verdict on {self.model}: {', '.join(self.verdict)}{grade}", style="bold")
        console.print(f"  {_yardstick(self)}")
        for candidate in self.candidates:
            if candidate.in_verdict:
                console.print(f"  {candidate.evidence}")
                for line in sentences(candidate.parameters):
                    console.print(f"    {line}")
                if candidate.separable_from:
                    console.print(f"    looks like: {', '.join(candidate.separable_from)}")
        if any(c.in_verdict or c.rmse_after_n < REMOVES * c.rmse_before_n for c in self.candidates):
            console.print(_table(self))
        for dependence in self.depends_on:
            console.print(
                f"the residual follows {dependence.channel}:"
                f" a free curve of it leaves {newtons(dependence.rmse_after_n)} {self.unit}",
            )
        for line in self.advice:
            console.print(f"  - {line}")


def _dependence_json(dependence: Dependence) -> dict[str, Any]:
    return {
        "channel": dependence.channel,
        "name": dependence.name,
        "rmse_before_n": dependence.rmse_before_n,
        "rmse_after_n": dependence.rmse_after_n,
        "at": dependence.at.tolist(),
        "residual_n": dependence.residual_n.tolist(),
    }


def _yardstick(report: DiagnoseReport) -> str:
    """Error before, after, and what should be left if nothing were missing."""
    fall = f"{newtons(report.rmse_before_n)} {report.unit}"
    if any(c.in_verdict for c in report.candidates):
        fall += f" -> {newtons(report.rmse_after_n)} {report.unit} with {' and '.join(report.verdict)}"
    floor = "the floor is" if report.judged == ON_BLOCKS else "what brochure and model may be wrong by is"
    said = f"error {report.judged}: {fall}; {floor} about {newtons(report.own_error_n)} {report.unit}"
    if report.noise_n is not None and report.own_error_n > SHOWS * report.noise_n:
        said += (
            f", as little as any reference here leaves; {newtons(report.noise_n)} {report.unit} of it are noise, and a"
            " law that is not listed may leave less"
        )
    return said


def _table(report: DiagnoseReport) -> Table:
    table = Table(title=f"Absent effects, by what they would leave {report.judged}")
    table.add_column("effect")
    for heading in (f"before {report.unit}", f"after {report.unit}"):
        table.add_column(heading, justify="right")
    table.add_column("amplitude, 95 %")
    table.add_column("looks like")
    worth = [c for c in report.candidates if c.in_verdict or c.rmse_after_n < REMOVES * c.rmse_before_n]
    for c in worth[:SHOWN]:
        after = newtons(c.rmse_after_n)
        table.add_row(c.effect, newtons(c.rmse_before_n), after, shown(c.parameters), ", ".join(c.separable_from))
    rest = len(report.candidates) - len(worth)
    table.caption = f"{rest} others remove nothing" if rest else None
    return table
