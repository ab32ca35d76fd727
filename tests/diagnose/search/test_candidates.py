"""What a record can say nothing of: an effect without any law whose channels are there and move."""

import numpy as np

from tests.diagnose.scene import columns
from thrustd.diagnose.search.candidates import judgeable
from thrustd.model.effects import shelf
from thrustd.records.recording import make_recording


def _judged(**other):
    data = columns()
    force = {"force_N": 5000.0 * data["deformation_mm"]}
    data = {name: column for name, column in (data | force).items() if name not in other["without"]}
    return judgeable(list(shelf().values()), [make_recording("measured", data)], [])


def test_an_effect_is_judged_where_one_of_its_laws_can_be():
    able, unable = _judged(without={"accel_z_g"})
    assert {effect.name for effect in able if effect.word == "axial_inertia"} == {"axial_inertia"}
    assert "axial_inertia" not in {one.effect for one in unable}
    assert "engine_weight" in {one.effect for one in unable}


def test_one_without_its_channel_is_said_once():
    _, unable = _judged(without={"accel_x_g"})
    reasons = [one.reason for one in unable if one.effect == "axial_inertia"]
    assert reasons == ["channel accel_x_g is not in the data"]


def test_a_channel_without_a_value_does_not_stand_still():
    data = columns()
    data |= {"force_N": 5000.0 * data["deformation_mm"], "accel_z_g": np.full_like(data["accel_z_g"], np.nan)}
    _, unable = judgeable(list(shelf().values()), [make_recording("measured", data)], [])
    assert {one.reason for one in unable if one.effect == "engine_weight"} == {"channel accel_z_g has no value at all"}
