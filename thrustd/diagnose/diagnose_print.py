"""A diagnosis for people: verdict, candidates, what is left, advice."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from thrustd.diagnose.newtons import newtons

if TYPE_CHECKING:
    from thrustd.diagnose.diagnose import DiagnoseReport

SHOWN = 8  # candidates in the table
WORTH = 0.99  # of the error before: who leaves more than that removes nothing


def print_report(report: "DiagnoseReport", console: Console) -> None:
    console.print(f"[bold]Verdict on {report.model}:[/bold] {', '.join(report.verdict)}", highlight=False)
    console.print(f"  {_yardstick(report)}", highlight=False)
    for candidate in report.candidates:
        if candidate.in_verdict:
            console.print(f"  {candidate.evidence}", highlight=False)
            for number in candidate.parameters:
                console.print(f"    {number.sentence}", highlight=False)
            if candidate.separable_from:
                console.print(f"    looks like: {', '.join(candidate.separable_from)}", highlight=False)
    if any(c.in_verdict or c.rmse_after_n < WORTH * c.rmse_before_n for c in report.candidates):
        console.print(_table(report))
    for dependence in report.depends_on:
        console.print(
            f"the residual follows {dependence.channel}:"
            f" a free curve of it leaves {newtons(dependence.rmse_after_n)} N",
            highlight=False,
        )
    for line in report.advice:
        console.print(f"  - {line}", highlight=False, markup=False)


def _yardstick(report: "DiagnoseReport") -> str:
    """Error before, after, and what should be left if nothing were missing."""
    fall = f"{newtons(report.rmse_before_n)} N"
    if any(c.in_verdict for c in report.candidates):
        fall += f" -> {newtons(report.rmse_after_n)} N with {' and '.join(report.verdict)}"
    source = "the identification promises" if report.promised else "the best that anything reached is"
    return f"error on held-back blocks, start-up aside: {fall}; {source} {newtons(report.own_error_n)} N here"


def _table(report: "DiagnoseReport") -> Table:
    table = Table(title="Absent effects, by what they would leave on held-back blocks")
    table.add_column("effect")
    for heading in ("before N", "after N"):
        table.add_column(heading, justify="right")
    table.add_column("amplitude")
    table.add_column("looks like")
    worth = [c for c in report.candidates if c.in_verdict or c.rmse_after_n < WORTH * c.rmse_before_n]
    for c in worth[:SHOWN]:
        numbers = ", ".join(f"{p.name} {p.value:.3g} +- {p.std:.1g}" for p in c.parameters[:1])
        after = newtons(c.rmse_after_n)
        table.add_row(c.effect, newtons(c.rmse_before_n), after, numbers, ", ".join(c.separable_from))
    rest = len(report.candidates) - len(worth)
    table.caption = f"{rest} others remove nothing" if rest else None
    return table
