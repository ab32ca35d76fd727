"""filterpy's KalmanFilter, without waiting for the parts of filterpy that nobody flies.

`from filterpy.kalman import KalmanFilter` also loads its particle filters, plots, scipy.stats and scipy.linalg: 1.1 s
of every restart in flight and 45 MB. Here the one file is loaded as it is, under its own name, while its packages are
empty; what it wants of scipy.stats (a log-likelihood) is fetched when it is asked for. Afterwards filterpy can be
imported as usual.
"""

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any

HELPERS = "filterpy.common.helpers"
PACKAGES = ("filterpy", "filterpy.kalman", "filterpy.stats", "filterpy.common")


def _logpdf(*arguments: Any, **options: Any) -> Any:
    return import_module("filterpy.stats").logpdf(*arguments, **options)


def _kalman_filter() -> Any:
    if "filterpy" in sys.modules:  # somebody wanted all of it
        return import_module("filterpy.kalman").KalmanFilter
    try:
        for name in PACKAGES:
            spec = find_spec(name)
            assert spec is not None
            package = ModuleType(name)
            package.__path__ = list(spec.submodule_search_locations or ())
            sys.modules[name] = package
        vars(sys.modules["filterpy.stats"])["logpdf"] = _logpdf
        vars(sys.modules["filterpy.common"]).update(vars(import_module(HELPERS)))
        return import_module("filterpy.kalman.kalman_filter").KalmanFilter
    finally:
        for name in (*PACKAGES, HELPERS):
            sys.modules.pop(name, None)


KalmanFilter: Any = _kalman_filter()
