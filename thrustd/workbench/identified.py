"""What an identification found, as the page draws it: errors, static curve, relaxation, loop, residual."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.measures import rms
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.search.spectra import folded
from thrustd.identify.identify import Identified
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import compile_model, linear_of
from thrustd.model.effects import effect_named
from thrustd.records.recording import Recording
from thrustd.workbench.figures import history_json, short

CURVE_POINTS = 120
RELAXATION_POINTS = 160
DOTS = 4_000  # of the loop
MOST_MODES = 8  # named, the largest


def identified_json(found: Identified, name: str, records: Sequence[Recording]) -> dict[str, Any]:
    """Numbers and pictures of a model on the records it was identified from."""
    spec, score = found.spec, found.scores[0]
    static = _static(spec)
    runs = compare({name: spec}, records).comparisons
    return {
        "model": name,
        "recordings": [record.name for record in records],
        "structure": spec.structure,
        "usable": found.usable,
        "warnings": list(found.warnings),
        "train_n": score.train.rmse_n,
        "validation_n": score.validation.rmse_n,
        "fit_pct": score.validation.fit_pct,
        "parameters": score.n_parameters,
        "rmse_n": rms(np.concatenate([c.residual_n for c in runs])),
        "force_n": spec.valid.force_n,
        "static": static,
        "relaxation": _relaxation(spec),
        "effects": [
            {"name": e.name, "title": effect_named(e.name).title, "parameters": folded(e.name, _moved(e.parameters))}
            for e in spec.effects
        ],
        "loops": [_loop(static, c.channels["deformation_mm"], c.reference_n, c.model_n) for c in runs],
        "histories": [history_json(c) for c in runs],
    }


def _moved(parameters: Mapping[str, float]) -> dict[str, float]:
    """Without elements of a spectrum that carry nothing."""
    return {name: value for name, value in parameters.items() if value}


def _static(spec: ModelSpec) -> dict[str, Any]:
    """Force (N) of the mount at rest under a deformation (mm), over the range that was identified."""
    compiled = compile_model(spec, 100.0)
    deformation = np.linspace(*spec.valid.deformation_mm, CURVE_POINTS)
    rows = np.zeros((CURVE_POINTS, len(compiled.channels)))
    rows[:, 0] = deformation
    for i, channel in enumerate(compiled.channels):
        if channel == "deformation_mm":
            rows[:, i] = deformation
    force = np.array([compiled.simulate(row[None, :], compiled.start(row))[-1] for row in rows])
    return {
        "deformation_mm": short(deformation),
        "force_n": short(force),
        "stiffness_n_mm": short(np.gradient(force, deformation)),
    }


def _relaxation(spec: ModelSpec) -> dict[str, Any]:
    """Share of the force at rest that stands t seconds after a step, and the time constants it is made of."""
    block = linear_of(spec)
    modes = [(mode.tau_s, mode.gain) for mode in block.real_modes if mode.gain != 0.0]
    rest = block.direct + sum(gain for _, gain in modes)
    longest = max((tau for tau, _ in modes), default=1.0)
    time_s = np.geomspace(0.01, 5 * longest, RELAXATION_POINTS)
    share = (block.direct + sum(gain * -np.expm1(-time_s / tau) for tau, gain in modes)) / rest
    modes.sort(key=lambda mode: -abs(mode[1]))
    return {
        "time_s": short(time_s),
        "share": short(share * np.ones_like(time_s)),
        "modes": [{"tau_s": tau, "share": gain / rest} for tau, gain in sorted(modes[:MOST_MODES])],
    }


def _loop(static: dict[str, Any], deformation: Floats, measured: Floats, model: Floats) -> dict[str, Any]:
    """Measured and model force beyond the static curve, N: what direction, rate and time add."""
    rest = np.interp(deformation, static["deformation_mm"], static["force_n"])
    measured, model = measured - rest, model - rest
    step = max(1, len(deformation) // DOTS)
    return {
        "deformation_mm": short(deformation[::step]),
        "measured_n": short(measured[::step]),
        "model_n": short(model[::step]),
    }
