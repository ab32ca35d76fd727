"""A bench in another unit or of another mount, by the spring rates of the aircraft's file.

A unit shows in the raw record, before anything is identified. Whose bench it is shows in the identified model at rest
under the same load: secants of raw records scatter by a tenth with the order of the steps. Of two mounts,
ln(k_1 / k_2) is a by the file, x by the models. It lies around a as they were given, around -a if they were swapped,
with one sigma s:

    ln(p(x | as given) / p(x | swapped)) = 2 a x / s^2
"""

import re
from collections.abc import Mapping, Sequence
from math import exp, expm1, log

import numpy as np
from scipy.optimize import brentq

from thrustd.core.aircraft import NO_MOUNT, places
from thrustd.core.errors import RecordingError
from thrustd.installation.installation import Installation
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import compile_model
from thrustd.mounts.start import resting_n
from thrustd.records.units import slips

LOAD = 0.6  # of the identified force
NEAR, APART = 0.05, 0.08  # of stiffnesses against each other, in logarithms
SPREAD = 0.07  # one sigma of that ratio around the file's: two mounts of 5 % each
SURE = 5.0  # log odds, 150 to 1
OFF = 0.5  # of one against the aircraft's file
UNIT_OFF = 3.0  # times: of a raw record, which shakes or walks; the smallest factor between two units is 4.4


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


def check_units(stiff_n_mm: Mapping[str, Sequence[float]], installation: Installation) -> None:
    """RecordingError, one line, when a raw record of a mount, N/mm, is in another unit by the aircraft's file."""
    config, data = installation.config, installation.aircraft()
    for row in places(config, data):
        for i, rate in zip(row, data.spring_n_mm, strict=False):
            for stiff in stiff_n_mm[config.mount[i].name] if i != NO_MOUNT else ():
                if not 1.0 / UNIT_OFF < stiff / rate < UNIT_OFF:
                    said = f"{stiff:.4g} N/mm, expected about {rate:.0f} (spring_n_mm of the aircraft's file)"
                    asked = " or ".join(slips(stiff / rate, OFF)) or "it another mount"
                    raise RecordingError(f"--bench {config.mount[i].name}: {said}; is {asked}?")


def check_places(specs: Mapping[str, ModelSpec], installation: Installation) -> dict[str, str]:
    """What nothing tells, by mount; RecordingError, one line, when benches seem to be of other mounts than given."""
    config, rates = installation.config, installation.aircraft().spring_n_mm
    untold = {}
    load_n = LOAD * min(spec.valid.force_n[1] for spec in specs.values())
    for engine in config.aircraft.engines:
        mine = [config.mount[i].name for i in config.mounts_of(engine)]
        found = [secant_n_mm(specs[mount], load_n) for mount in mine]
        for mount, stiff, rate in zip(mine, found, rates, strict=False):
            if not exp(-OFF) < stiff / rate < exp(OFF):
                said = f"{stiff:.0f} N/mm, expected about {rate:.0f} (spring_n_mm of the aircraft's file)"
                raise RecordingError(f"--bench {mount}: {said}; was it another unit or mount?")
        if len(mine) == 2 and (said := _pair(mine, found, rates)):
            untold[mine[0]] = said
    return untold


def _pair(mine: Sequence[str], found: Sequence[float], rates: Sequence[float]) -> str:
    """Empty where the two are told apart."""
    ratio, expected = log(found[0] / found[1]), log(rates[0] / rates[1])
    odds = 2.0 * expected * ratio / SPREAD**2  # as given against swapped
    said = f"{found[0]:.0f} and {found[1]:.0f} N/mm, expected as {rates[0]:.0f} and {rates[1]:.0f} (spring_n_mm)"
    twice = abs(ratio) < NEAR and abs(ratio - expected) > APART < abs(expected)
    if twice or odds < -SURE:
        word = "two of the same place" if twice else "each other's"
        raise RecordingError(f"--bench {mine[0]}, {mine[1]}: {said}: they seem to be {word}")
    if odds > SURE:
        return ""
    return (
        f"nothing on hand tells its bench from that of {mine[1]}: {said}; were they swapped, each alone would be"
        f" {100.0 * abs(expm1(ratio)):.1f} % off, and both together less"
    )


def misnamed(benches: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """By mount, a file whose name speaks of another one: no reason to refuse it, all that tells mounts alike apart."""
    words = {mount: set(mount.split("_")) for mount in benches}
    known, found = set[str]().union(*words.values()), {}
    for mount, names in benches.items():
        for name in names:
            said = known.intersection(re.split(r"[^a-z0-9]+", name.lower()))
            shared = any(said <= words[other] for other, theirs in benches.items() if name in theirs)
            if said and not shared:
                found[mount] = f"its bench {name} is named after another mount"
    return found
