"""Effects of the user's own, from a Python file that is named explicitly: `--effect-file my_effect.py`.

The file defines `EFFECT` (or `EFFECTS`, a list) as the files in thrustd/model/effects do. It is run as code: only
when asked for, and with the rights of the user who asks.
"""

import importlib.util
import sys
from pathlib import Path

from thrustd.core.errors import ModelError
from thrustd.model.effect import Effect
from thrustd.model.effects import put_on_shelf


def load_effect_file(path: Path | str) -> tuple[Effect, ...]:
    """Run the file, put its effects on the shelf and return them; ModelError in one line when it has none."""
    path = Path(path)
    if not path.is_file():
        raise ModelError(f"{path}: no such file, expected a Python file that defines EFFECT")
    name = f"thrustd_effect_file_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ModelError(f"{path.name}: not a Python file, expected one that defines EFFECT")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # numba looks its functions up there
    try:
        spec.loader.exec_module(module)
    except Exception as problem:
        raise ModelError(f"{path.name}: cannot be run: {type(problem).__name__}: {problem}") from None
    found = tuple(getattr(module, "EFFECTS", ())) or tuple(filter(None, [getattr(module, "EFFECT", None)]))
    if not found or not all(isinstance(effect, Effect) for effect in found):
        raise ModelError(f"{path.name}: defines no EFFECT, expected thrustd.model.effect.Effect")
    for effect in found:
        put_on_shelf(effect, path.name)
    return found
