"""Effects of known size are put into a model without data."""

import msgspec
import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.core.errors import ModelError, UsageError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.diagnose.extend.given import read_given, with_given
from thrustd.model.artifact import read_model
from thrustd.model.compile import check_witness, compile_model, witness_of


@pytest.fixture
def bare():
    """The shipped mount without what the bench could not show."""
    spec = read_model((ROOT / "models" / "left-upper.json").read_text(), "left-upper")
    kept = [e for e in spec.effects if e.name not in ("axial_inertia", "engine_weight")]
    bare = msgspec.structs.replace(spec, effects=kept)
    inputs = {name: np.array(rows) for name, rows in spec.witness.inputs.items()}
    return msgspec.structs.replace(bare, witness=witness_of(bare, spec.witness.rate_hz, inputs))


def test_the_mass_of_the_engine_is_in_the_force(bare):
    heavy = with_given(bare, read_given(["axial_inertia.mass_kg=186.5"]))
    check_witness(heavy, "heavy")
    model, before = compile_model(heavy, 100.0), compile_model(bare, 100.0)
    assert "accel_x_g" in model.channels
    still = {"deformation_mm": np.full(50, 0.5), "temperature_degC": np.full(50, 20.0)}
    pushed = still | {"accel_x_g": np.full(50, 0.1)}
    gained = model.simulate(model.inputs(pushed)) - before.simulate(before.inputs(still))
    assert gained[-1] == pytest.approx(0.1 * 186.5 * STANDARD_GRAVITY_M_S2)
    assert heavy.effects[-1].std == {}
    assert heavy.provenance["given"] == ["axial_inertia.mass_kg = 186.5"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("axial_inertia.mass_kg=heavy", "expected EFFECT.PARAMETER=NUMBER"),
        ("mass_kg=100", "expected EFFECT.PARAMETER=NUMBER"),
        ("axial_inertia.mass_kg=1e9", "mass_kg = 1e.09, expected"),
        ("axial_inertia.weight_kg=1", "no parameter 'weight_kg', expected one of mass_kg"),
    ],
)
def test_what_cannot_be_is_refused(bare, text, words):
    with pytest.raises((ModelError, UsageError), match=words):
        with_given(bare, read_given([text]))


def test_an_effect_is_put_in_once(bare):
    heavy = with_given(bare, read_given(["axial_inertia.mass_kg=186.5"]))
    with pytest.raises(ModelError, match="already in the model"):
        with_given(heavy, read_given(["axial_inertia.mass_kg=100"]))


def test_the_verb_takes_no_data_beside(capsys, tmp_path):
    model = str(ROOT / "models" / "left-upper.json")
    given = ["extend", model, "data.csv", "--given", "nacelle_drag.area_m2=0.1", "-o", str(tmp_path / "m.json")]
    assert main(given) == 2
    assert "takes no recordings" in capsys.readouterr().err
    assert main(["extend", model, "--effect", "axial_inertia", "-o", str(tmp_path / "m.json")]) == 2
    assert "no recording" in capsys.readouterr().err
