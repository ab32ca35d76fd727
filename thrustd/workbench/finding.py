"""Identify, diagnose, extend and compile, as the page asks for them: the functions of the command line."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from thrustd.core.types import Progress
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.comparison import CompareReport
from thrustd.diagnose.extend.effect_card import parameters_of
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.diagnose_report import CandidateReport
from thrustd.diagnose.search.spectra import kind_of
from thrustd.diagnose.search.told import ParameterEstimate, gathered, many_of, sentence_of
from thrustd.identify.identify import identify
from thrustd.identify.segments import DEFORMATION, FORCE
from thrustd.model.artifact import ModelSpec, write_model
from thrustd.model.compile import compile_model, model_stages, rate_difference_n
from thrustd.model.effects import effect_named
from thrustd.records.files import file_sha256
from thrustd.records.recording import TIME
from thrustd.sinks.whole_file import write_whole
from thrustd.workbench.asking import marked_recordings
from thrustd.workbench.curves import curves_of
from thrustd.workbench.evidence import evidence_json
from thrustd.workbench.figures import dependence_json, history_json
from thrustd.workbench.folder import Folder
from thrustd.workbench.identified import identified_json

CARD = ("title", "equation", "source", "channels", "site", "separating_test")


def fit(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """A first model from bench recordings, as `thrustd identify` makes it."""
    records = marked_recordings(folder, arguments["recordings"])
    name = arguments["out"]
    found = identify(records, name=Path(name).stem, progress=lambda share: progress(0.9 * share, "fit"))
    save_model(folder, name, found.spec)
    progress(0.95, "pictures")
    return identified_json(found, name, records) | {"reads": _reads(found.spec)}


def _reads(spec: ModelSpec) -> list[str]:
    """Columns that the numbers of a model are made of; its mean temperature is kept with it."""
    channels = (channel for stage in model_stages(spec, 1.0) for channel in stage.channels)
    return sorted({TIME, DEFORMATION, FORCE, "temperature_degC", *channels})


def ask_diagnose(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The report of `thrustd diagnose`, with the physics card of every candidate."""
    records = marked_recordings(folder, arguments["recordings"])
    report = diagnose(
        folder.model(arguments["model"]), records, name=arguments["model"], beside=True, progress=progress
    )
    answer = report.to_json()
    answer["candidates"] = [_candidate(c) for c in report.candidates]
    answer["evidence"] = evidence_json(report.explained)
    answer["depends_on"] = [
        dependence_json(d) | {"name": d.name, "rmse_before_n": d.rmse_before_n, "rmse_after_n": d.rmse_after_n}
        for d in report.depends_on
    ]
    return answer


def _candidate(candidate: CandidateReport) -> dict[str, Any]:
    effect = effect_named(candidate.name)
    card = {key: getattr(effect, key) for key in CARD}
    card["parameters"] = [{"name": p.name, "meaning": p.meaning, "unit": p.unit} for p in parameters_of(effect)]
    return candidate.to_json() | {"card": card, "estimates": _estimates(candidate.parameters)}


def _estimates(numbers: Sequence[ParameterEstimate]) -> list[dict[str, Any]]:
    """As the page shows them: a spectrum or a curve in one, `said` in words."""
    found = []
    for every in gathered(numbers):
        first, many = every[0], len(every) > 1
        one = {"name": kind_of(first.name), "effect": first.effect, "expected": first.expected, "said": many_of(every)}
        found.append((one if many else asdict(first)) | {"sentence": sentence_of(every)})
    return found


def ask_extend(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The model with an effect added, and both models on the held-back recordings. The old one stays as it is."""
    records = marked_recordings(folder, arguments["recordings"])
    parent, name = arguments["model"], arguments["out"]
    report = extend(
        folder.model(parent), records, list(arguments["effects"]), name=Path(name).stem,
        progress=lambda share, note: progress(0.05 + 0.75 * share, note),
    )  # fmt: skip
    progress(0.85, "before and after")
    both, checks = {parent: folder.model(parent), name: report.spec}, arguments["heldout"]
    found = compare(both, [*records, *marked_recordings(folder, checks)])
    judged = {
        "heldout": [
            {"model": c.model, "recording": c.recording, "rmse_n": c.rmse_n, "contradicted": c.check.contradicted}
            for c in found.comparisons
            if c.recording in checks
        ],
        "remarks": [*report.remarks, *_remarks(found, parent, checks)],
        "histories": [history_json(c) for c in found.comparisons],
    }
    save_model(folder, name, report.spec)
    return report.to_json() | {
        "reads": _reads(report.spec),
        "parent": parent,
        "model": name,
        "estimates": _estimates(report.parameters),
        "curves": [curve for curve in curves_of(report.spec) if curve["effect"] in report.effects],
        **judged,
    }


def _remarks(found: CompareReport, parent: str, checks: Sequence[str]) -> list[str]:
    """What the check recordings lack, and whether they contradict the new model."""
    old = {c.check.sentence for c in found.comparisons if c.model == parent}
    return [line for line in found.remarks if line not in old and line.startswith(tuple(checks))]


def compile_for_flight(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Prove that a model, whose witness rows came out again when it was read, compiles at a rate."""
    name, rate_hz = arguments["model"], float(arguments["rate_hz"])
    spec, path = folder.model(name), folder.path(arguments["model"])
    progress(0.2, f"compiling at {rate_hz:g} Hz")
    compiled = compile_model(spec, rate_hz)
    assert spec.witness is not None  # nothing without one is read
    own = compile_model(spec, spec.witness.rate_hz)
    return {
        "model": name, "rate_hz": rate_hz, "channels": list(dict.fromkeys(compiled.channels)),
        "witness_rows": len(spec.witness.force_n), "between_rates_n": rate_difference_n(own, compiled),
        "path": str(path), "bytes": path.stat().st_size, "sha256": file_sha256(path),
    }  # fmt: skip


def save_model(folder: Folder, name: str, spec: ModelSpec) -> None:
    """Whole or not at all."""
    write_whole(folder.new_path(name), write_model(spec))
