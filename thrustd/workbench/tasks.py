"""What the worker does for each kind of order: calls the function the command line calls, keeps its report.

Every task takes (folder, arguments, progress) and returns a small JSON object; large answers go to
`.thrustd/reports/`. No number is made here.
"""

from collections.abc import Callable, Mapping
from typing import Any

from thrustd.workbench.folder import Folder
from thrustd.workbench.prepare import adopt, prepare

Progress = Callable[[float, str], None]
Task = Callable[[Folder, Mapping[str, Any], Progress], dict[str, Any]]


def _prepare(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    return prepare(folder, arguments["recording"], progress)


def _simulate(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    from thrustd.workbench.model_runs import simulate_models

    return simulate_models(folder, arguments["recording"], arguments["models"], progress)


def _adopt(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    return adopt(folder, arguments["incoming"], arguments["name"], progress)


TASKS: dict[str, Task] = {
    "prepare": _prepare,
    "simulate": _simulate,
    "adopt": _adopt,
}
