"""A self-contained HTML report: how the model came about, what it is worth, and the script that repeats it."""

import html
import secrets
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thrustd.core.errors import UsageError
from thrustd.core.types import Progress
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.search.spectra import folded
from thrustd.model.artifact import ModelSpec
from thrustd.model.effects import shelf
from thrustd.sinks.html_page import drawing, head, picture, table
from thrustd.sinks.whole_file import write_whole
from thrustd.workbench.asking import marked_recordings
from thrustd.workbench.curves import curve_drawing, curves_of
from thrustd.workbench.folder import Folder
from thrustd.workbench.session import read_session
from thrustd.workbench.story import Step, kept_report, script_of, steps_of

WORDS = "Free runs: the model sees deformation and channels, never the reference. Residual = measured - model."
NOTHING = ("none", "unknown")
MOST, WORTH = 8, 0.995  # candidates that are told: how many, and how much of the error each leaves at most


def write_html(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The story of the chosen model, then the model on the measured and the check recordings."""
    session = read_session(folder)
    names = [*session.measured, *session.heldout]
    if not session.model or not names:
        raise UsageError("report: choose a model and a measured recording first")
    progress(0.05, "reading")
    records = marked_recordings(folder, names)
    spec, steps = folder.model(session.model), steps_of(folder, session.model)
    models = {steps[0].model: folder.model(steps[0].model), session.model: spec}
    found = compare(models, records, progress=lambda share, note: progress(0.3 * share, note))
    last = [c for c in found.comparisons if c.model == session.model]
    said = f"{WORDS} Folder {folder.root.name}, {date.today()}."
    parts = [head(arguments.get("title") or session.model, said), _numbers(found.comparisons, session.heldout)]
    parts += [f'<p class="{_tone(found.comparisons, line)}">{html.escape(line)}</p>' for line in found.remarks]
    parts += [_ledger(last[0]), *(_step(folder, i, step) for i, step in enumerate(steps)), _effects(spec)]
    for i, comparison in enumerate(last):
        progress(0.35 + 0.6 * i / len(last), f"pictures of {comparison.recording}")
        both = [c for c in found.comparisons if c.recording == comparison.recording]
        parts.append(_comparison(comparison, both))
    parts.append(
        _columns(folder, dict.fromkeys([*names, *(r for s in steps if s.made for r in s.made.arguments["recordings"])]))
    )
    parts.append(_script(script_of(folder, steps, session)))
    reports = folder.state / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    number = f"{secrets.token_hex(8)}.html"
    write_whole(reports / number, "".join(parts))
    return {"report": number}


def _tone(comparisons: Iterable[Comparison], line: str) -> str:
    """What contradicts the model is bad; that it was fitted to a recording is only said."""
    return "bad" if any(c.check.contradicted and c.check.sentence == line for c in comparisons) else "faint"


def _columns(folder: Folder, names: Iterable[str]) -> str:
    """What the columns of the files were taken for."""
    rows = [
        (name, column.theirs, column.ours, f"{column.factor:g}", f"{column.offset:g}")
        for name in names
        for column in folder.mapping(name).columns
    ]
    heads = ("File", "column", "read as", "times", "plus")
    return "<h2>Columns</h2>" + table(heads, rows) if rows else ""


def _numbers(comparisons: Iterable[Comparison], heldout: Iterable[str]) -> str:
    checks = set(heldout)
    rows = [
        [c.recording + (" (nothing was fitted to it)" if c.recording in checks else ""), c.model, f"{c.rmse_n:.1f}",
         f"{c.mae_n:.1f}", f"{c.bias_n:+.1f}", f"{c.fit_pct:.2f}", f"{c.worst_n:+.0f}", f"{c.worst_at_s:.1f}"]
        for c in sorted(comparisons, key=lambda c: c.recording)
    ]  # fmt: skip
    heads = ("Recording", "model", "RMSE N", "mean |error| N", "bias N", "fit %", "worst N", "at s")
    return "<h2>How wrong: measured minus model</h2>" + table(heads, rows)


def _ledger(c: Comparison) -> str:
    if not c.ledger:
        return ""
    rows = [(f"+ {e.added}", f"{e.rmse_before_n:.1f}", f"{e.rmse_after_n:.1f}", e.data) for e in c.ledger]
    return "<h2>Error ledger</h2>" + table(("Added", "before N", "after N", "held-back blocks of"), rows)


def _step(folder: Folder, number: int, step: Step) -> str:
    """One model: what made it and what that gave, then what was said to be missing in it."""
    return f"<h2>Step {number + 1}: {html.escape(step.model)}</h2>" + _made(step) + _asked(folder, step)


def _made(step: Step) -> str:
    if step.made is None:
        return "<p>This model came with the folder.</p>"
    made, records = step.made.result, html.escape(", ".join(step.made.arguments["recordings"]))
    if step.made.kind == "fit":
        return (
            f"<p>Identified from {records}: {newtons(made['train_n'])} N on four fifths of it,"
            f" {newtons(made['validation_n'])} N on the fifth that was held out, in parts all over the record."
            + html.escape("".join(f" {line}." for line in made["warnings"]))
            + "</p>"
        )
    rows = [("held-back blocks", made["parent"], made["rmse_before_n"]), ("", made["model"], made["rmse_after_n"])]
    rows += [(one["recording"], one["model"], one["rmse_n"]) for one in made.get("heldout", [])]
    shown = [(where, model, newtons(rmse)) for where, model, rmse in rows]
    numbers = "".join(f"<li>{html.escape(p['sentence'])}</li>" for p in made["estimates"])
    added = html.escape(" and ".join(made["effects"]))
    return f"<p>{added} added to {html.escape(made['parent'])} on {records}.</p>" + (
        f"<ul>{numbers}</ul>" + table(("Judged on", "model", "RMSE N"), shown)
    )


def _asked(folder: Folder, step: Step) -> str:
    if step.asked is None:
        return ""
    answer = kept_report(folder, step.asked)
    if not answer:
        return ""
    verdict = answer["verdict"]
    after = "" if verdict[0] in NOTHING else f" → {newtons(answer['rmse_after_n'])} N promised"
    grade = "" if verdict == ["unknown"] else f" ({answer['grade']})"
    curves = "".join(
        f"; {html.escape(d['name'])} would leave {newtons(d['rmse_after_n'])} N" for d in answer["depends_on"]
    )
    rest = "; something else is missing too" if answer["more_left"] else ""
    said = (
        f"<p><b>Missing in it: {html.escape(', '.join(verdict))}</b>{grade}:"
        f" {newtons(answer['rmse_before_n'])} N{after} on held-back blocks{curves};"
        f" the floor is {newtons(answer['floor_n'])} N{rest}.</p>"
    )
    advice = "".join(f"<p>{html.escape(line)}</p>" for line in answer["advice"])
    rows = [
        (c["effect"], f"{c['rmse_before_n']:.1f}", f"{c['rmse_after_n']:.1f}", ", ".join(c["separable_from"]) or "-")
        for c in answer["candidates"][:MOST]
        if c["in_verdict"] or c["rmse_after_n"] < WORTH * c["rmse_before_n"]
    ]
    heads = ("Candidate", "before N", "after N", "looks like")
    return said + _evidence(answer.get("evidence", [])) + (table(heads, rows) if rows else "") + advice


def _evidence(sets: list[dict[str, Any]]) -> str:
    """Residual, and over it what each of the two best sets explains."""
    if not sets:
        return ""
    figure = Figure(figsize=(9.5, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    places = figure.subplots(2, len(sets), squeeze=False)
    for (top, below), one in zip(places.T, sets, strict=True):
        history, view = one["history"], one["view"]
        none = float("nan")
        low, high, part = ([none if v is None else v for v in history[key]] for key in ("low", "high", "explained"))
        top.fill_between(history["time_s"], low, high, color="#667383", alpha=0.5, lw=0.6)
        top.plot(history["time_s"], part, color="#d55e00", lw=1.2)
        top.set_title(f"{' + '.join(one['effects'])}: leaves {newtons(one['rmse_n'])} N", fontsize=9)
        top.set_xlabel("time [s]", fontsize=8)
        top.set_ylabel("measured - model [N]", fontsize=8)
        for curve, color, dash in zip(view["curves"], ("#0072b2", "#009e73"), ("-", "--"), strict=False):
            below.plot(curve["at"], curve["residual_n"], ".", color=color, label=f"residual, {curve['name']}")
            below.plot(curve["at"], curve["explained_n"], dash, color="#d55e00", lw=1.2)
        if view["log"]:
            below.set_xscale("log")
        below.set_xlabel(f"{view['title']} [{view['unit'] or '-'}]", fontsize=8)
        below.set_ylabel("mean residual [N]", fontsize=8)
        below.legend(fontsize=7)
    for place in places.ravel():
        place.tick_params(labelsize=7)
        place.grid(True, lw=0.3)
    return drawing(figure, "evidence on the measured recording; orange: explained by the effect")


def _effects(spec: ModelSpec) -> str:
    """What was found: every parameter that is not neutral; units are in the names. Intervals stand with the steps."""
    neutral = {word: {p.name: p.neutral for p in effect.parameters} for word, effect in shelf().items()}
    rows = []
    for e in spec.effects:
        own = neutral.get(e.name, {})
        moved = {name: value for name, value in e.parameters.items() if value != own.get(name)}
        rows += [(e.name, name, _said(value)) for name, value in folded(e.name, moved).items()]
    if not rows:
        return ""
    curves = "".join(map(curve_drawing, curves_of(spec)))
    return "<h2>Effects in the model</h2>" + table(("Effect", "parameter", "value"), rows) + curves


def _said(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _comparison(c: Comparison, both: Sequence[Comparison]) -> str:
    """Of the last model; beside the first one where they are two."""
    from thrustd.diagnose.compare.before_after import before_after_figure
    from thrustd.diagnose.compare.pictures import comparison_pictures

    words = "".join(f"<li>{html.escape(failure.sentence)}</li>" for failure in c.where_it_fails)
    with TemporaryDirectory() as scratch:
        pictures = "".join(picture(path.read_bytes(), path.stem) for path in comparison_pictures(c, Path(scratch)))
    if len(both) > 1:
        pictures = drawing(before_after_figure(both), f"{c.recording}, before and after") + pictures
    where = f"<ol>{words}</ol>" if words else f"<p>{html.escape(c.nowhere[0].upper() + c.nowhere[1:])}.</p>"
    return f"<h2>{html.escape(c.recording)}: where it fails</h2>{where}{pictures}"


def _script(script: str) -> str:
    return (
        "<h2>The same in Python</h2><p>In the folder of the recordings, marked stretches beside them:</p>"
        f"<pre>{html.escape(script)}</pre>"
    )
