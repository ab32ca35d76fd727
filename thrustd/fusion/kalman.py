"""filterpy's KalmanFilter, without waiting for the parts of filterpy that nobody flies.

`from filterpy.kalman import KalmanFilter` also loads its particle filters, plots, scipy.stats and scipy.linalg: 1.1 s
of every restart in flight and 45 MB. Here the one file is loaded as it is, under its own name, while its packages are
empty; what it wants of scipy.stats (a log-likelihood) is fetched when it is asked for. Afterwards filterpy can be
imported as usual.

A sixth of the time of so small a filter is numpy's function `dot` asking what it was given, and `deepcopy` of a
number. So predict and update, filterpy's own code, find the arrays' own method and a plain copy under these names.
"""

import sys
from copy import copy
from importlib import import_module
from importlib.util import find_spec
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

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


def _with_quick_names(function: Any) -> Any:
    names = function.__globals__ | {"dot": np.ndarray.dot, "deepcopy": copy}
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__)


_FILTERPY: Any = _kalman_filter()
KalmanFilter: Any = type(
    "KalmanFilter", (_FILTERPY,), {name: _with_quick_names(vars(_FILTERPY)[name]) for name in ("predict", "update")}
)
