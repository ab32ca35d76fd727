"""Evidence on the user's own data: what the pictures say of laws that were put in by hand."""

import numpy as np
import pytest

from thrustd.diagnose.search.explained import Explained, Stretch
from thrustd.workbench.evidence import BUCKETS, evidence_json

DT = 0.05
T = np.arange(0, 1200, DT)
D = 0.6 + 0.3 * np.sin(T / 20)
RISING = np.cos(T / 20) > 0


def scene(law, word, residual, channels=None):
    """One record on which the law explains nine tenths of the residual."""
    stretch = Stretch(T, DT, {"deformation_mm": D, "time_s": T} | (channels or {}), residual, (0.9 * residual,))
    (picture,) = evidence_json(Explained(((word,),), ((law,),), (12.0,), (stretch,)))
    return picture


def test_friction_is_a_loop_by_direction():
    view = scene("hysteresis_coulomb", "hysteresis", np.where(RISING, 80.0, -80.0))["view"]
    loading, unloading = view["curves"]
    assert (loading["name"], unloading["name"], view["unit"]) == ("loading", "unloading", "mm")
    middle = slice(4, -4)  # near the ends it turns
    assert np.allclose(loading["residual_n"][middle], 80, atol=15)
    assert np.allclose(unloading["residual_n"][middle], -80, atol=15)
    assert np.allclose(loading["explained_n"][middle], 72, atol=14)


def test_creep_is_seen_in_holds():
    steps = np.where((T // 200) % 2 == 0, 0.3, 0.9)
    since = T % 200
    residual = 40 * np.log10(1 + since)
    stretch = Stretch(T, DT, {"deformation_mm": steps, "time_s": T}, residual, (residual,))
    (picture,) = evidence_json(Explained((("creep",),), (("creep",),), (12.0,), (stretch,)))
    view = picture["view"]
    assert view["log"] and view["unit"] == "s"
    for curve in view["curves"]:
        assert curve["residual_n"][-1] > curve["residual_n"][0] + 30


def test_heat_is_drawn_over_temperature_and_an_inertia_over_its_channel():
    temperature = 20 + T / 60
    view = scene("thermal_expansion", "thermal_expansion", 3 * (temperature - 30), {"temperature_degC": temperature})[
        "view"
    ]
    (curve,) = view["curves"]
    assert view["title"] == "temperature_degC" and np.polyfit(curve["at"], curve["residual_n"], 1)[0] == pytest.approx(
        3, rel=0.02
    )
    accel = 0.1 * np.sin(T / 7)
    assert scene("axial_inertia", "axial_inertia", 200 * accel, {"accel_x_g": accel})["view"]["title"] == "accel_x_g"


def test_the_history_keeps_the_extremes_and_holes():
    residual = np.zeros(len(T))
    residual[5000] = 999.0
    residual[10_000:10_200] = np.nan
    history = scene("hysteresis", "hysteresis", residual)["history"]
    assert max(v for v in history["high"] if v is not None) == 999.0
    assert len(history["time_s"]) <= BUCKETS + 2 and history["explained"][-1] is None
    assert evidence_json(None) == []
