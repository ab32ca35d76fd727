"""A user's own effect from a file, and the cards of all of them."""

import pytest

from thrustd.core.errors import ModelError
from thrustd.diagnose.extend.effect_card import card_picture, card_text, shelf_text
from thrustd.diagnose.extend.effect_file import load_effect_file
from thrustd.model import effects
from thrustd.model.effects import effect_named, shelf

OWN = '''"""Cabin pressure pushes on the pylon: F = F_core + k p."""
import numpy as np
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import jit

@jit
def step(x, c, u, v):
    return v + c[0] * u[0]

def prepare(p, dt_s):
    return np.array([p["k_n_psi"]])

EFFECT = Effect("cabin_push", "cabin pressure on the pylon", "force", ("cabin_psi",),
    (Parameter("k_n_psi", "N/psi", 0.0, -1e3, 1e3, (10.0,), "force per pressure"),),
    step, prepare, 0, "F = F_core + k p", "a guess", "change the cabin pressure on the ground")
'''


@pytest.fixture(autouse=True)
def shelf_as_it_was(monkeypatch):
    monkeypatch.setattr(effects, "_more", {})
    yield
    shelf.cache_clear()


@pytest.mark.parametrize("name", sorted(shelf()))
def test_every_effect_has_a_card_with_its_physics(name):
    text = card_text(effect_named(name))
    assert effect_named(name).equation in text
    assert "separate by" in text
    assert "*" in text.splitlines()[-1] or any("*" in line for line in text.splitlines()[-9:])
    assert name in shelf_text()


def test_a_card_has_a_picture(tmp_path):
    assert card_picture(effect_named("hysteresis"), tmp_path / "card.png").stat().st_size > 5000


def test_an_effect_of_a_file_joins_the_shelf(tmp_path):
    path = tmp_path / "cabin.py"
    path.write_text(OWN)
    (effect,) = load_effect_file(path)
    assert effect_named("cabin_push") is effect
    assert "Cabin pressure pushes" in card_text(effect)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "defines no EFFECT"),
        ("raise RuntimeError('no')", "cannot be run: RuntimeError"),
        (OWN.replace("cabin_push", "hysteresis"), "effect 'hysteresis' already exists"),
        ("EFFECT = 3", "defines no EFFECT"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "bad.py"
    path.write_text(text)
    with pytest.raises(ModelError, match=words) as raised:
        load_effect_file(path)
    assert "\n" not in str(raised.value)


def test_a_missing_file_is_refused():
    with pytest.raises(ModelError, match="no such file"):
        load_effect_file("nowhere.py")
