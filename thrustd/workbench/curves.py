"""Free curves of a model as they are drawn: heights over the channel with their 95 % interval."""

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thrustd.core.measures import SIGMAS_95
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effects import effect_named
from thrustd.model.free_curve import CURVE_OF, KNOTS, is_curve
from thrustd.sinks.html_page import drawing
from thrustd.workbench.figures import short

AXES = {
    "force": "added to the force [N]",
    "deformation": "added to the deformation [mm]",
    "gain": "added to a gain of 1 [-]",
}


def curves_of(spec: ModelSpec) -> list[dict[str, Any]]:
    """Every free curve that a model has."""
    return [_curve(effect) for effect in spec.effects if is_curve(effect.name)]


def _curve(effect: EffectSpec) -> dict[str, Any]:
    law = effect_named(effect.name)
    names = [f"height_{i:02d}" for i in range(KNOTS)]
    height = np.array([effect.parameters[name] for name in names])
    half = SIGMAS_95 * np.array([effect.std.get(name, 0.0) for name in names])
    return {
        "effect": law.word,
        "channel": law.word.removeprefix(CURVE_OF),
        "title": AXES[law.site],
        "at": [effect.parameters[f"at_{i:02d}"] for i in range(KNOTS)],
        "mean": short(height),
        "low": short(height - half),
        "high": short(height + half),
    }


def curve_drawing(curve: dict[str, Any]) -> str:
    """The same for a report."""
    figure = Figure(figsize=(6.0, 2.8), layout="constrained")
    FigureCanvasAgg(figure)
    place = figure.subplots()
    place.fill_between(curve["at"], curve["low"], curve["high"], color="#0072b2", alpha=0.25, lw=0)
    place.plot(curve["at"], curve["mean"], ".-", color="#0072b2", lw=1.4)
    place.set_xlabel(curve["channel"], fontsize=8)
    place.set_ylabel(curve["title"], fontsize=8)
    place.tick_params(labelsize=7)
    place.grid(True, lw=0.3)
    return drawing(figure, f"{curve['effect']}, band: 95 %")
