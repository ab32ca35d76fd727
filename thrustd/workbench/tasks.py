"""What the worker does for each kind of order: calls the function the command line calls, keeps its report.

Every task takes (folder, arguments, progress) and returns a small JSON object; large answers go to
`.thrustd/reports/`. No number is made here. Modules are imported when they are first needed, so that a recording is on
the screen before the numerical libraries are loaded.
"""

import secrets
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from thrustd.core.types import Progress
from thrustd.workbench.folder import Folder
from thrustd.workbench.mapping import table_wanted
from thrustd.workbench.prepare import prepare, write_report

Arguments = Mapping[str, Any]
Task = Callable[[Folder, Arguments, Progress], dict[str, Any]]


def _call(module: str, name: str, *fields: str) -> Task:
    """`fields`: of the arguments, one by one; none: all of them in one piece."""

    def task(folder: Folder, arguments: Arguments, progress: Progress) -> dict[str, Any]:
        work: Callable[..., dict[str, Any]] = getattr(import_module(f"thrustd.workbench.{module}"), name)
        return work(folder, *([arguments[field] for field in fields] or [arguments]), progress)

    return task


def _kept(module: str, name: str, shown: Callable[[dict[str, Any]], dict[str, Any]]) -> Task:
    """A task whose answer is kept as a report; the job itself carries only what `shown` takes of it.

    `files`: what it was asked of, as it was read then, so that the page knows when the answer is out of date;
    `reading`: where their columns came from.
    """
    asked = _call(module, name)

    def task(folder: Folder, arguments: Arguments, progress: Progress) -> dict[str, Any]:
        recordings = [*arguments["recordings"], *arguments.get("heldout", ())]
        for recording in filter(table_wanted, recordings):
            prepare(folder, recording, progress)
        models = arguments.get("models") or filter(None, [arguments.get("model")])
        files = {file: folder.key(file) for file in (*recordings, *models)}
        reading = {recording: folder.reading(recording) for recording in recordings}
        answer = asked(folder, arguments, progress)
        kept = write_report(folder, secrets.token_hex(8), answer)
        return {"report": kept, "files": files, "reading": reading, **shown(answer)}

    return task


def _compared(answer: dict[str, Any]) -> dict[str, Any]:
    names = ("model", "recording", "rmse_n", "bias_n")
    worst = [failure["sentence"] for cell in answer["cells"][-1:] for failure in cell["where_it_fails"][:1]]
    cells = [{name: cell[name] for name in names} for cell in answer["cells"]]
    return {"cells": cells, "worst": worst}


def _fitted(answer: dict[str, Any]) -> dict[str, Any]:
    names = ("model", "recordings", "reads", "train_n", "validation_n", "fit_pct", "warnings")
    return {name: answer[name] for name in names}


def _diagnosed(answer: dict[str, Any]) -> dict[str, Any]:
    kept = ("verdict", "grade", "more_left", "floor_n", "rmse_before_n", "rmse_after_n", "not_judged")
    names = ("effect", "name", "rmse_before_n", "rmse_after_n", "in_verdict")
    return {
        **{name: answer[name] for name in kept},
        "candidates": [{name: c[name] for name in names} for c in answer["candidates"][:6]],
        "depends_on": [d["channel"] for d in answer["depends_on"]],
        "curves": [d["name"] for d in answer["depends_on"]],  # as `extend` takes them
        "curves_leave_n": [d["rmse_after_n"] for d in answer["depends_on"]],
    }


def _extended(answer: dict[str, Any]) -> dict[str, Any]:
    found = ("rmse_before_n", "rmse_after_n", "estimates", "curves", "heldout", "remarks")
    names = ("model", "reads", "parent", "effects", *found)
    return {name: answer[name] for name in names if name in answer}


TASKS: dict[str, Task] = {
    "prepare": _call("prepare", "prepare", "recording"),
    "adopt": _call("prepare", "adopt", "incoming", "name"),
    "simulate": _call("model_runs", "simulate_models", "recording", "models"),
    "replay": _call("replaying", "replay_log"),
    "exercise": _call("exercise", "make_exercise"),
    "reveal": _call("exercise", "reveal"),
    "fit": _kept("finding", "fit", _fitted),
    "compare": _kept("asking", "ask_compare", _compared),
    "diagnose": _kept("finding", "ask_diagnose", _diagnosed),
    "extend": _kept("finding", "ask_extend", _extended),
    "flighttest": _kept("flight_test", "ask_flight_test", lambda answer: {"title": answer["title"]}),
    "compile": _call("finding", "compile_for_flight"),
    "figure": _call("print_figure", "write_figure"),
    "report": _call("html_report", "write_html"),
}
