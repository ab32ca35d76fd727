"""How a model came about: its identification, then verdict, evidence, promise and result of every step; and the script.

Everything is taken from the jobs and reports that the page has kept; steps that it did not make are not told.
"""

import keyword
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from thrustd.workbench.folder import Folder
from thrustd.workbench.jobs import Job, read_jobs
from thrustd.workbench.session import Session


class Step(NamedTuple):
    """One model of the chain: what made it, and the newest diagnosis of it."""

    model: str
    made: Job | None  # "fit" or "extend"; None: it came from elsewhere
    asked: Job | None  # "diagnose"


def steps_of(folder: Folder, model: str) -> list[Step]:
    """The chain of a model, the first one first."""
    jobs = [job for job in reversed(read_jobs(folder.state / "jobs")) if job.state == "done"]
    steps: list[Step] = []
    name: str | None = model
    while name and all(step.model != name for step in steps):
        made = next((j for j in jobs if j.kind in ("fit", "extend") and j.result.get("model") == name), None)
        steps.append(Step(name, made, next(_asked(jobs, name), None)))
        name = made.result.get("parent") if made is not None else None
    return steps[::-1]


def _asked(jobs: Sequence[Job], model: str) -> Iterator[Job]:
    return (job for job in jobs if job.kind == "diagnose" and job.arguments["model"] == model)


def kept_report(folder: Folder, job: Job) -> dict[str, Any]:
    """The whole answer of a job; empty when it was deleted."""
    path = folder.state / "reports" / str(job.result.get("report", ""))
    if not path.is_file():
        return {}
    answer: dict[str, Any] = msgspec.json.decode(path.read_bytes())
    return answer


def script_of(folder: Folder, steps: Sequence[Step], session: Session) -> str:
    """Python that makes the last model again from the files of the folder, and judges it."""
    lines = ["import thrustd as td", ""]
    names: dict[str, str] = {}
    used = [name for step in steps if step.made for name in step.made.arguments["recordings"]]
    for name in dict.fromkeys((*used, *session.measured, *session.heldout)):
        names[name] = _variable(name, list(names.values()))
        lines.append(f"{names[name]} = {_read(folder, name)}")
    lines.append("")
    for step in steps:
        lines.append(_made(step, names))
    judged = ", ".join(names[name] for name in (*session.measured, *session.heldout) if name in names)
    lines += [f"print(td.compare(model, [{judged}]))", 'td.write(model, "again.json")', ""]
    return "\n".join(lines)


def _read(folder: Folder, name: str) -> str:
    mapping = folder.mapping(name)
    said = [repr(name)]
    if mapping.columns:
        said.append(f"rename={[column.spelled for column in mapping.columns]!r}")
    if mapping.rate_hz is not None:
        said.append(f"rate_hz={mapping.rate_hz!r}")
    return f"td.read({', '.join(said)})"


def _made(step: Step, names: dict[str, str]) -> str:
    """The line that makes this model of the one before."""
    stem = Path(step.model).stem
    if step.made is None:
        return f"model = td.load({step.model!r})"
    records = ", ".join(names[name] for name in step.made.arguments["recordings"])
    if step.made.kind == "fit":
        return f"model = td.identify([{records}], name={stem!r})"
    effects = list(step.made.arguments["effects"])
    return f"model = td.extend(model, [{records}], {effects!r}, name={stem!r})"


def _variable(name: str, taken: list[str]) -> str:
    """A name in Python for a recording."""
    word = re.sub(r"\W+", "_", Path(name).stem).strip("_").lower() or "record"
    word = f"record_{word}" if word[0].isdigit() or keyword.iskeyword(word) or word in ("td", "model") else word
    while word in taken:
        word += "_"
    return word
