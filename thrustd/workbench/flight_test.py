"""Questions of a flight test, as the page asks them: tables and sentences as on the terminal, the same picture."""

import secrets
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib import style

from thrustd.core.types import Progress
from thrustd.flighttest import questions
from thrustd.flighttest.answer import Answer
from thrustd.flighttest.mass_sheet import MassSheet
from thrustd.records.rows import write_rows
from thrustd.sinks.whole_file import whole_file
from thrustd.workbench.folder import Folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def ask_flight_test(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """What the command line prints, as JSON; its picture for light and dark pages, its rows as CSV."""
    progress(0.05, "reading")
    answer = _answer(folder, arguments, progress)
    progress(0.8, "drawing")
    reports = folder.state / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    number = secrets.token_hex(8)
    for scheme in ("light", "dark"):
        _draw(answer.draw, reports / f"{number}-{scheme}.svg", scheme == "dark")
        for place, draw in enumerate(answer.more.values()):
            _draw(draw, reports / f"{number}-{place}-{scheme}.svg", scheme == "dark")
    write_rows(answer.found.rows(), reports / f"{number}.csv")
    tables = [table._asdict() for table in answer.tables]
    return {
        "title": answer.title,
        "words": answer.words,
        "lines": list(answer.lines),
        "tables": tables,
        "more": list(answer.more),
        "files": number,
    }


def _answer(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> Answer:
    question, marks = arguments["question"], arguments["marks"] or None
    paths = [folder.path(name) for name in arguments["recordings"]]
    if question == "performance":
        sheets = [MassSheet(**arguments["mass"])] if arguments["mass"] else []
        return questions.performance(paths, sheets, marks=marks, advance=progress)
    if question == "health":
        return questions.health(paths, advance=lambda share, what: progress(0.7 * share, what))
    return questions.transients(paths[0]) if question == "transients" else questions.points(paths[0], marks=marks)


def _draw(draw: "Callable[[], Figure]", path: Path, dark: bool) -> None:
    with style.context("dark_background") if dark else nullcontext(), whole_file(path) as part:
        draw().savefig(part, format="svg", transparent=True)
