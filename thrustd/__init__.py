"""In-flight jet thrust from the deformation of the engine mounts.

    import thrustd as td
    bench, flight = td.read("bench.csv"), td.read("flight.mcap", mount="left_upper")
    model = td.identify(bench)
    found = td.diagnose(model, flight)
    better = td.extend(model, flight, found)
    td.compare([model, better], td.read("holdout.csv")).plot()

Ten names, each loaded when it is first asked for: `import thrustd` itself takes no time. `thrustd.api.flights` has more
of flights: transients, health.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thrustd.api.files import load, read, write
    from thrustd.api.flights import performance, points, replay
    from thrustd.api.loop import compare, diagnose, extend, identify

__version__ = "0.1.0"
__all__ = [
    "compare", "diagnose", "extend", "identify", "load", "performance", "points", "read", "replay", "write",
]  # fmt: skip
_ROOMS = {
    "files": ("load", "read", "write"),
    "flights": ("performance", "points", "replay"),
    "loop": ("compare", "diagnose", "extend", "identify"),
}
_HOME = {name: f"thrustd.api.{room}" for room, names in _ROOMS.items() for name in names}


class _Top(ModuleType):
    """`thrustd.identify` is the function, although a room of the package is called so too."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module 'thrustd' has no attribute {name!r}")
        return getattr(import_module(_HOME[name]), name)

    def __dir__(self) -> list[str]:
        return [*__all__, "__version__"]


sys.modules[__name__].__class__ = _Top
