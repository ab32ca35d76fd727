"""Machine code in a fresh clone: made once, by two processes, before every process of the tests would make it.

`python -m tests.compiled`; does nothing but look where it has been made.
"""

from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from pkgutil import walk_packages

import numpy as np

OTHERS = "wire", "sync", "mounts", "fusion", "brochure", "pipeline", "sinks", "sources", "twin", "identify"


def _import(*folders: str) -> None:
    for folder in folders:
        package = import_module(f"thrustd.{folder}")
        for module in walk_packages(package.__path__, f"{package.__name__}."):
            import_module(module.name)


def in_flight() -> None:
    """More than half of it is what decides which sensor is believed."""
    _import("sensors")


def on_the_ground() -> None:
    """All else on which the pipeline stands, every effect, and a fit."""
    _import(*OTHERS)
    from tests.diagnose.scene import record
    from thrustd.identify.identify import identify
    from thrustd.model.effects import shelf

    for effect in shelf().values():
        stage = effect.stage(effect.neutral(), 0.05)
        stage.from_rest(dict.fromkeys(stage.channels, np.ones(2)), np.ones(2))
    identify([record(n=2400)])


if __name__ == "__main__":
    with ProcessPoolExecutor(2) as processes:
        for made in [processes.submit(in_flight), processes.submit(on_the_ground)]:
            made.result()
