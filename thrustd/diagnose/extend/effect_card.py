"""The card of an effect: what `thrustd effects NAME` prints, with a small picture of its signature.

The signature is computed by the effect itself: a mount of 5500 N/mm under a triangle of deformation while the effect's
channel swings once, with and without the effect at a typical size. Drawn is what it adds to the force.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from thrustd.core.columns import Floats
from thrustd.diagnose.search.spectra import kind_of, together
from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects import shelf
from thrustd.model.elsewhere import TEMPERATURE, is_temperature
from thrustd.sinks.whole_file import whole_file

STIFFNESS_N_MM = 5500.0
DT_S = 0.05
SECONDS = 120.0
SWING = {  # channel: rest and swing in the sketch
    "accel_x_g": (0.0, 0.1),
    "accel_z_g": (1.0, 0.5),
    TEMPERATURE: (20.0, 20.0),
    "vibration_mm_s": (0.0, 50.0),
    "dynamic_pressure_Pa": (0.0, 8000.0),
}
WIDTH, HEIGHT = 60, 9


@dataclass(frozen=True, slots=True)
class Signature:
    """What an effect adds to the force in the sketch's manoeuvre."""

    time_s: Floats  # (n,)
    deformation_mm: Floats  # (n,) two triangles
    channel: Floats  # (n,) swing of the effect's channels, 0..1
    added_n: Floats  # (n,)


def signature(effect: Effect) -> Signature:
    """Run the effect at its first `starts` on two triangles of deformation; hours pass for what counts them."""
    n = int(SECONDS / DT_S)
    time_s = np.arange(n, dtype=np.float64) * DT_S
    deformation_mm: Floats = 0.1 + 0.8 * np.abs((2 * time_s / SECONDS + 0.5) % 1.0 - 0.5) * 2
    swing: Floats = np.where(time_s > SECONDS / 2, 0.5 - 0.5 * np.cos(4 * np.pi * time_s / SECONDS), 0.0)
    columns = {"deformation_mm": deformation_mm, "time_s": time_s * 60}
    for name in effect.channels:
        rest, size = SWING.get(TEMPERATURE if is_temperature(name) else name, (0.0, 1.0))
        columns.setdefault(name, rest + size * swing)
    unit = 1.0 if effect.site == "deformation" else STIFFNESS_N_MM
    v = deformation_mm * unit
    stage = effect.stage(effect.neutral() | {p.name: p.starts[0] for p in effect.parameters}, DT_S)
    added_n: Floats = (stage.from_rest(columns, v) - v) * (STIFFNESS_N_MM / unit)
    return Signature(time_s, deformation_mm, swing, added_n)


def card_text(effect: Effect) -> str:
    """Everything a person wants to know before believing in it, with a sketch for the terminal."""
    lines = [f"{effect.word}: {effect.title}"]
    if effect.variant_of:
        lines.append(f"  variant      {effect.name}")
    lines += [
        f"  equation     {effect.equation}",
        f"  acts on      {effect.site}",
        f"  reads        {', '.join(effect.channels) or 'the deformation alone'}",
    ]
    for p in parameters_of(effect):
        kind = "amplitude" if p.amplitude else "shape" if p.estimate else "reference"
        unit = f" {p.unit}" if p.unit not in ("", "-") else ""
        lines.append(f"  {p.name:<12} {p.meaning}; {kind}, {p.low:g} to {p.high:g}{unit}, neutral {p.neutral:g}")
        if p.expected:
            lines.append(f"  {'':<12} expected: {p.expected}")
    lines += [f"  separate by  {effect.separating_test}", f"  source       {effect.source}", ""]
    return "\n".join([*lines, physics(effect), "", *sketch(signature(effect))])


def card_json(effect: Effect) -> dict[str, Any]:
    """The card as plain values."""
    return {
        "effect": effect.word,
        "name": effect.name,
        "title": effect.title,
        "site": effect.site,
        "channels": list(effect.channels),
        "equation": effect.equation,
        "source": effect.source,
        "separating_test": effect.separating_test,
        "parameters": [
            {"name": p.name, "unit": p.unit, "neutral": p.neutral, "low": p.low, "high": p.high, "meaning": p.meaning,
             "expected": p.expected}
            for p in effect.parameters
        ],
        "physics": physics(effect),
    }  # fmt: skip


def physics(effect: Effect) -> str:
    """The docstring of the effect's file: equation, sign, source, range, what it leaves out."""
    module = sys.modules.get(getattr(effect.step or effect.lags, "__module__", ""))
    return (getattr(module, "__doc__", None) or "").strip()


def sketch(drawn: Signature) -> list[str]:
    """Added force over time as text, `WIDTH` by `HEIGHT` characters, with its scale."""
    parts = np.array_split(drawn.added_n, WIDTH)
    values = np.array([part[np.argmax(np.abs(part))] for part in parts])
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    span = (high - low) or 1.0
    rows = np.clip(((high - values) / span * (HEIGHT - 1)).round().astype(int), 0, HEIGHT - 1)
    zero = round(high / span * (HEIGHT - 1))
    grid = [["-" if row == zero else " "] * WIDTH for row in range(HEIGHT)]
    for column, row in enumerate(rows):
        grid[row][column] = "*"
    labels = [f"{high:+9.3g} N |", *[" " * 11 + "|"] * (HEIGHT - 2), f"{low:+9.3g} N |"]
    body = [label + "".join(line) for label, line in zip(labels, grid, strict=True)]
    return ["added force; two slow load triangles, its channel swings during the second", *body]


def card_picture(effect: Effect, path: Path) -> Path:
    """The signature as PNG: added force over time and over deformation."""
    drawn = signature(effect)
    figure = Figure(figsize=(7, 2.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(drawn.time_s, drawn.added_n, color="#d55e00", lw=1.2)
    right.plot(drawn.deformation_mm, drawn.added_n, color="#0072b2", lw=1.0)
    left.set(xlabel="time [s]", ylabel="added force [N]", title=effect.word)
    right.set(xlabel="deformation [mm]", title=effect.equation)
    right.title.set_fontsize(8)
    with whole_file(path) as part:
        figure.savefig(part, dpi=110, format="png")
    return path


def parameters_of(effect: Effect) -> list[Parameter]:
    """As a person reads them: those of a spectrum or a curve are one, called by their kind."""
    known = {p.name: p for p in effect.parameters}
    return [_one([known[name] for name in names]) for names in together(known)]


def _one(every: Sequence[Parameter]) -> Parameter:
    first = every[0]
    if len(every) == 1:
        return first
    words = list(zip(first.meaning.split(), every[-1].meaning.split(), strict=False))
    one_differs = sum(a != b for a, b in words) <= 1
    meaning = " ".join(a if a == b else f"{a} to {b}" for a, b in words) if one_differs else first.meaning
    return replace(first, name=kind_of(first.name), meaning=f"{len(every)} of them: {meaning}")


def shelf_text() -> str:
    """One line per effect."""
    effects = sorted(shelf().values(), key=lambda e: (e.word, e.name))
    return "\n".join(f"{e.name:<32} {e.site:<12} {e.title}" for e in effects)
