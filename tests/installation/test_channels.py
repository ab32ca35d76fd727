"""A model flies by channels of which something is known before they are heard."""

import msgspec
import numpy as np
import pytest

from thrustd.core.errors import ModelError
from thrustd.installation.installation import Installation, read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.artifact import EffectSpec, read_model
from thrustd.model.compile import compile_model, witness_of

HIL = read_installation(shipped("deploy/hil.toml", "config"))
LAW = {"expansion_mm_k": 0.001, "reference_degc": 20.0}


def with_effect(name: str) -> Installation:
    """The first mount's model with an expansion more."""
    file = HIL.config.mount[0].model
    spec = read_model(HIL.files[file], file)
    more = msgspec.structs.replace(spec, effects=[*spec.effects, EffectSpec(name, LAW)])
    rows = dict.fromkeys(compile_model(more, 100.0).channels, np.zeros(20))
    proven = msgspec.structs.replace(more, witness=witness_of(more, 100.0, rows))
    return Installation(HIL.config, {**HIL.files, file: msgspec.json.encode(proven)}, "test")


def test_an_expansion_by_the_mounts_own_temperature_flies() -> None:
    before, after = (one.parts().models[0].channels for one in (HIL, with_effect("thermal_expansion")))
    assert after.count("temperature_degC") == before.count("temperature_degC") + 1


def test_of_the_air_nothing_is_known_before_it_is_heard() -> None:
    with pytest.raises(ModelError, match="sat_degC', of which nothing is known before it is heard"):
        with_effect("thermal_expansion at sat_degC").parts()


def test_no_wire_brings_the_oil() -> None:
    with pytest.raises(ModelError, match="oil_degC', which the CAN table does not deliver"):
        with_effect("thermal_expansion at oil_degC").parts()
