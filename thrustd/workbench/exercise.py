"""Hidden-effect exercises: the twin hides an effect, the answer lies sealed until it is asked for."""

import os
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from thrustd.core.errors import UsageError
from thrustd.core.types import Progress
from thrustd.twin.disturbance import DISTURBANCES
from thrustd.twin.hide import TRUTH, hide
from thrustd.workbench.folder import Folder

NAME = "exercise"


def make_exercise(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """bench.csv, measured.csv and heldout.csv in a folder of their own; which effect it is, nobody sees."""
    number = 1
    while (folder.root / f"{NAME}-{number}").exists():
        number += 1
    name = f"{NAME}-{number}"
    effect = secrets.choice(sorted(DISTURBANCES))
    progress(0.1, "the twin is flying")
    part = folder.state / "sealed" / f"{name}.part"
    shutil.rmtree(part, ignore_errors=True)
    try:
        hide((effect,), secrets.randbelow(1 << 30), float(arguments["strength"]), part)
        os.replace(part / TRUTH, _sealed(folder, name))
        part.rename(folder.root / name)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return {"exercise": name}


def reveal(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """What was hidden: effects with their true parameters and their size."""
    name = arguments["exercise"]
    folder.new_path(name)
    path = _sealed(folder, name)
    if not path.is_file():
        raise UsageError(f"{name}: there is no sealed answer")
    truth = msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    effects = [
        {
            "effect": effect,
            "parameters": [{"name": name, "value": value} for name, value in truth["parameters"][effect].items()],
            "force_rms_n": truth["force_rms_n"][effect][0],
        }
        for effect in truth["effects"]
    ]
    return {"exercise": name, "effects": effects}


def _sealed(folder: Folder, name: str) -> Path:
    return folder.state / "sealed" / f"{name}.json"
