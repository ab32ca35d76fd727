"""Compiled functions are kept where there is a place, and work where there is none."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

SOURCE = """
from thrustd.compiled import compiled

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
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
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
