"""What proves a model is proved by all of it: no number of its curves, modes or effects can be changed unseen."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from thrustd.core.errors import ModelError
from thrustd.identify.artifact import provenance, witness_rows
from thrustd.model.artifact import read_model, write_model
from thrustd.model.compile import check_witness
from thrustd.records.recording import make_recording

SHIPPED = sorted((Path(__file__).parents[2] / "models").glob("*.json"))
CURVES = ("input_curve", "output_curve")
A_LITTLE = 1e-3  # of the curve's range: 1 um, 6 N


def altered(model: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The model with one number changed, once for each of its numbers that the force depends on."""
    for field in CURVES:
        for axis in "xy":
            numbers = model[field][axis]
            for i, number in enumerate(numbers):
                other = json.loads(json.dumps(model))
                other[field][axis][i] = number + A_LITTLE * (max(numbers) - min(numbers))
                yield f"{field}.{axis}[{i}]", other
    for i, mode in enumerate(model["linear"]["real_modes"]):
        for key in mode:
            other = json.loads(json.dumps(model))
            other["linear"]["real_modes"][i][key] *= 1.01
            yield f"linear.real_modes[{i}].{key}", other
    for i, effect in enumerate(model["effects"]):
        for key in effect["parameters"]:
            other = json.loads(json.dumps(model))
            here = other["effects"][i]["parameters"]
            here[key] = 1.01 * here[key] or 1.0
            yield f"{effect['name']}.{key}", other


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_no_number_of_a_shipped_model_can_be_changed_unseen(path):
    model = json.loads(path.read_text())
    changed = dict(altered(model))
    assert len(changed) > 40
    for what, other in changed.items():
        with pytest.raises(ModelError, match=r"witness row|increasing"):
            check_witness(read_model(json.dumps(other), what), what)
            pytest.fail(f"{path.stem}: {what} was changed and nobody saw it")


def test_the_rows_reach_over_the_valid_range_and_depend_on_nothing_but_the_model():
    spec = read_model(SHIPPED[0].read_text(), "model")
    rows = witness_rows(spec, spec.witness.rate_hz)
    low_mm, high_mm = spec.valid.deformation_mm
    assert min(rows.inputs["deformation_mm"]) < low_mm < high_mm < max(rows.inputs["deformation_mm"])
    assert write_model(spec) == SHIPPED[0].read_text()
    assert rows == spec.witness


def test_a_thermometer_without_a_value_gives_no_reference_temperature():
    """Nor a warning of numpy, which is an error here."""
    record = make_recording("rig", {"time_s": np.arange(9.0), "temperature_degC": np.full(9, np.nan)})
    assert "mean_temperature_degC" not in provenance([record], [], {})
