"""A self-contained HTML report of the latest answers: tables, sentences, ledger and pictures in one file."""

import html
import secrets
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.comparison import Comparison
from thrustd.model.artifact import ModelSpec
from thrustd.sinks.html_page import head, picture, table
from thrustd.sinks.whole_file import whole_file
from thrustd.workbench.asking import marked_recordings
from thrustd.workbench.folder import Folder
from thrustd.workbench.session import read_session

Progress = Callable[[float, str], None]

WORDS = "Free runs: the model sees deformation and channels, never the reference. Residual = measured - model."


def write_html(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The chosen model on the measured and held-back recordings, with the latest diagnosis of it."""
    session = read_session(folder)
    names = [*session.measured, *session.heldout]
    if not session.model or not names:
        raise UsageError("report: choose a model and a measured recording first")
    progress(0.05, "reading")
    records = marked_recordings(folder, names)
    spec = folder.model(session.model)
    found = compare({session.model: spec}, records, progress=lambda share, note: progress(0.3 * share, note))
    parts = [
        head(arguments.get("title") or session.model, WORDS),
        _numbers(found.comparisons),
        _ledger(found.comparisons[0]),
    ]
    parts += [_effects(spec), _diagnosis(folder, session.model)]
    for i, comparison in enumerate(found.comparisons):
        progress(0.35 + 0.6 * i / len(found.comparisons), f"pictures of {comparison.recording}")
        parts.append(_comparison(comparison))
    reports = folder.state / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    number = f"{secrets.token_hex(8)}.html"
    with whole_file(reports / number) as part:
        part.write_text("".join(parts), encoding="utf-8")
    return {"report": number}


def _numbers(comparisons: Iterable[Comparison]) -> str:
    rows = [
        [c.recording, f"{c.rmse_n:.1f}", f"{c.mae_n:.1f}", f"{c.bias_n:+.1f}", f"{c.fit_pct:.2f}", f"{c.worst_n:+.0f}",
         f"{c.worst_at_s:.1f}"]
        for c in comparisons
    ]  # fmt: skip
    heads = ("Recording", "RMSE N", "mean |error| N", "bias N", "fit %", "worst N", "at s")
    return "<h2>How wrong: measured minus model</h2>" + table(heads, rows)


def _ledger(c: Comparison) -> str:
    if not c.ledger:
        return ""
    rows = [(f"+ {e.added}", f"{e.rmse_before_n:.1f}", f"{e.rmse_after_n:.1f}", e.data) for e in c.ledger]
    return "<h2>Error ledger</h2>" + table(("Added", "before N", "after N", "held-back blocks of"), rows)


def _effects(spec: ModelSpec) -> str:
    """What was found: every parameter of every effect with one sigma; units are in the names."""
    if not spec.effects:
        return ""
    rows = [
        (e.name, name, f"{value:.4g}", f"{e.std[name]:.2g}" if name in e.std else "")
        for e in spec.effects
        for name, value in e.parameters.items()
    ]
    return "<h2>Effects in the model</h2>" + table(("Effect", "parameter", "value", "one sigma"), rows)


def _diagnosis(folder: Folder, model: str) -> str:
    answer = _latest_diagnosis(folder, model)
    if answer is None:
        return ""
    rows = [
        (c["effect"], f"{c['rmse_before_n']:.1f}", f"{c['rmse_after_n']:.1f}", ", ".join(c["separable_from"]) or "-")
        for c in answer["candidates"][:8]
    ]
    verdict = html.escape(", ".join(answer["verdict"]))
    advice = "".join(f"<p>{html.escape(line)}</p>" for line in answer["advice"])
    heads = ("Candidate", "before N", "after N", "looks like")
    return f"<h2>What is missing: {verdict}</h2>" + table(heads, rows) + advice


def _latest_diagnosis(folder: Folder, model: str) -> dict[str, Any] | None:
    """The newest kept answer about this model."""
    for path in sorted((folder.state / "reports").glob("*.json"), key=lambda p: p.stat().st_mtime, reverse=True):
        answer: dict[str, Any] = msgspec.json.decode(path.read_bytes())
        if "verdict" in answer and answer.get("model") == model:
            return answer
    return None


def _comparison(c: Comparison) -> str:
    from thrustd.diagnose.compare.pictures import comparison_pictures

    words = "".join(f"<li>{html.escape(failure.sentence)}</li>" for failure in c.where_it_fails)
    with TemporaryDirectory() as scratch:
        pictures = "".join(picture(path.read_bytes(), path.stem) for path in comparison_pictures(c, Path(scratch)))
    where = f"<ol>{words}</ol>" if words else "<p>Nowhere in particular: the error is spread as evenly as the time.</p>"
    return f"<h2>{html.escape(c.recording)}: where it fails</h2>{where}{pictures}"
