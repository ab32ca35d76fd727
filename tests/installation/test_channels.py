"""A model flies by channels of which something is known before they are heard."""

import json

import pytest

from thrustd.core.errors import ModelError
from thrustd.installation.installation import Installation, read_installation
from thrustd.installation.shipped import shipped

HIL = read_installation(shipped("deploy/hil.toml", "config"))
LAW = {"expansion_mm_k": 0.001, "reference_degc": 20.0}


def with_effect(name: str) -> Installation:
    """The first mount's model with an expansion more."""
    file = HIL.config.mount[0].model
    model = json.loads(HIL.files[file])
    model["effects"] = [*model.get("effects", []), {"name": name, "parameters": LAW}]
    model.pop("witness", None)
    return Installation(HIL.config, {**HIL.files, file: json.dumps(model).encode()}, "test")


def test_an_expansion_by_the_mounts_own_temperature_flies() -> None:
    assert with_effect("thermal_expansion").parts().models[0].channels.count("temperature_degC") == 1


def test_of_the_air_nothing_is_known_before_it_is_heard() -> None:
    with pytest.raises(ModelError, match="sat_degC', of which nothing is known before it is heard"):
        with_effect("thermal_expansion at sat_degC").parts()


def test_no_wire_brings_the_oil() -> None:
    with pytest.raises(ModelError, match="oil_degC', which the CAN table does not deliver"):
        with_effect("thermal_expansion at oil_degC").parts()
