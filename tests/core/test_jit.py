"""Compiled functions are kept where there is a place, and work where there is none; what they call may change."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from thrustd.core.jit import _Compiling, compiled, entry, say_compiling

SOURCE = """
from thrustd.core.jit import compiled

def twice(x):
    return 2 * x

twice = compiled(twice)
assert twice(21) == 42
print(bool(twice.stats.cache_path))
"""


def run(folder, **environment):
    """-> whether there was a place. A file where its folder should be refuses even root."""
    script = folder / "script.py"
    script.write_text(SOURCE)
    path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    answer = subprocess.run(
        [sys.executable, str(script)],
        env={**kept, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.strip() == "True"


def test_with_a_place_and_without_one(tmp_path):
    assert run(tmp_path, HOME=str(tmp_path))
    shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
    (tmp_path / "__pycache__").write_text("")
    (tmp_path / "home").write_text("")
    assert not run(tmp_path, HOME=str(tmp_path / "home"))


CALLER = """
from callee import FACTOR, Shape, raised
from thrustd.core.jit import compiled

def total(x):
    return FACTOR * raised(x) + Shape.ROUND.value

total = compiled(total)
print(total(1.0), sum(total.stats.cache_hits.values()))
"""


def test_machine_code_goes_with_what_it_calls(tmp_path):
    """Functions and constants of another file are in it, which numba does not look at."""

    def answer(factor, added, shape):
        (tmp_path / "callee.py").write_text(
            f"from enum import IntEnum\nfrom thrustd.core.jit import compiled\nFACTOR = {factor}\n"
            f"Shape = IntEnum('Shape', {{'ROUND': {shape}}})\nraised = compiled(lambda x: x + {added})\n"
        )
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "PYTHONDONTWRITEBYTECODE": "1"}
        environment["NUMBA_CACHE_DIR"] = str(tmp_path / "kept")
        words = [sys.executable, str(tmp_path / "caller.py")]
        return subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout.split()

    (tmp_path / "caller.py").write_text(CALLER)
    assert answer(2, 3, 5) == ["13.0", "0"]
    assert answer(2, 3, 5) == ["13.0", "1"]
    assert answer(2, 4, 5) == ["15.0", "0"]
    assert answer(3, 4, 5) == ["20.0", "0"]
    assert answer(3, 4, 6) == ["21.0", "0"]


def _sum_of(row):
    total = 0.0
    for value in row:
        total += value
    return total


def test_the_entry_is_the_function_itself():
    whole = compiled(_sum_of, "f8(f8[::1])")
    row = np.random.default_rng(1).normal(size=100)
    assert entry(whole)(row) == whole(row) == _sum_of(row)
    for other in (row.astype(np.float32), row.tolist(), None):
        with pytest.raises(TypeError):
            entry(whole)(other)


NAMED = """
from typing import NamedTuple
import numba
from thrustd.core.jit import compiled, named

class {pair}(NamedTuple):
    one: float
    two: float

def added(pair: {pair}):
    return pair.one + pair.two

print(compiled(added, numba.float64(named({pair}, numba.float64, numba.float64)))({pair}(1.0, 2.0)))
"""


def test_an_index_that_names_a_type_which_is_gone_is_not_read(tmp_path):
    kept = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "NUMBA_CACHE_DIR": str(tmp_path)}
    for pair in ("Pair", "Couple"):
        (tmp_path / "script.py").write_text(NAMED.format(pair=pair))
        command = [sys.executable, "-c", "import script"]
        answer = subprocess.run(command, cwd=tmp_path, env=kept, capture_output=True, text=True)
        assert answer.stdout.strip() == "3.0", answer.stderr


@pytest.mark.parametrize("person", [True, False])
def test_a_person_is_told_once_that_a_first_start_takes_a_minute(person, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: person, raising=False)
    listener = _Compiling()
    for _ in range(9):
        listener.on_start(None)
    assert not capsys.readouterr().err
    for _ in range(30):
        listener.on_start(None)
    assert capsys.readouterr().err.count("first start on this machine") == person


def test_a_script_on_a_pipe_hears_it_too(capsys, monkeypatch):
    listener = _Compiling()
    monkeypatch.setattr("thrustd.core.jit._COMPILING", listener)
    say_compiling()
    for _ in range(30):
        listener.on_start(None)
    assert capsys.readouterr().err.count("first start on this machine") == 1
