"""A bench of the wrong mount: two mounts of an engine are as stiff against each other as the aircraft's file says.

What is compared is the identified model at rest under the same load: secants of raw records scatter by a tenth with the
order of the steps.
"""

from collections.abc import Mapping, Sequence
from math import exp, log

import numpy as np
from scipy.optimize import brentq

from thrustd.core.errors import RecordingError
from thrustd.installation.installation import Installation
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import compile_model
from thrustd.mounts.start import resting_n

LOAD = 0.6  # of the identified force
NEAR, APART = 0.05, 0.08  # of stiffnesses against each other, in logarithms
OFF = 0.5  # of one against the aircraft's file


def secant_n_mm(spec: ModelSpec, load_n: float) -> float:
    """Load over travel of the model at rest, N/mm; channels at rest."""
    model = compile_model(spec, 10.0)
    own = np.array([name == "deformation_mm" for name in model.channels], float)

    def force_n(mm: float) -> float:
        return resting_n(model, mm * own)

    low, high = spec.valid.deformation_mm

    def travel_mm(wanted_n: float) -> float:
        return float(brentq(lambda mm: force_n(mm) - wanted_n, low - 0.5 * high, 1.5 * high))

    return load_n / (travel_mm(load_n) - travel_mm(0.0))


def check_places(specs: Mapping[str, ModelSpec], installation: Installation) -> None:
    """RecordingError, one line, when benches seem to be of other mounts than they are given for."""
    config, rates = installation.config, installation.aircraft().spring_n_mm
    load_n = LOAD * min(spec.valid.force_n[1] for spec in specs.values())
    for engine in config.aircraft.engines:
        mine = [config.mount[i].name for i in config.mounts_of(engine)]
        found = [secant_n_mm(specs[mount], load_n) for mount in mine]
        for mount, stiff, rate in zip(mine, found, rates, strict=False):
            if not exp(-OFF) < stiff / rate < exp(OFF):
                said = f"{stiff:.0f} N/mm, expected about {rate:.0f} (spring_n_mm of the aircraft's file)"
                raise RecordingError(f"--bench {mount}: {said}; was it another unit or mount?")
        if len(mine) == 2:
            _check_pair(mine, found, rates)


def _check_pair(mine: Sequence[str], found: Sequence[float], rates: Sequence[float]) -> None:
    ratio, expected = log(found[0] / found[1]), log(rates[0] / rates[1])
    if abs(ratio - expected) < APART:
        return
    for wrong, word in ((0.0, "two of the same place"), (-expected, "each other's")):
        if abs(ratio - wrong) < NEAR:
            said = (
                f"{found[0]:.0f} and {found[1]:.0f} N/mm, expected as {rates[0]:.0f} and {rates[1]:.0f} (spring_n_mm)"
            )
            raise RecordingError(f"--bench {mine[0]}, {mine[1]}: {said}: they seem to be {word}")
