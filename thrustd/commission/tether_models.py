"""What the model of a mount makes of a tethered run's readings, were something of the mount another.

A column of the regression is what the model's force changes by, per part of it. Growth is driven through the whole
model, because it lasts for minutes: on that way the rubber is stiffer than at rest, and its friction follows.
"""

from dataclasses import dataclass
from math import sqrt

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.config import Mount
from thrustd.installation.installation import Installation
from thrustd.model.artifact import ModelSpec
from thrustd.model.calibrated import calibrated, each_more
from thrustd.model.compile import compile_model, rubs
from thrustd.mounts.start import at_rest, resting_n

MORE = 0.1  # of friction, of a slope
GROWS_MM_K = 5e-4  # as far as transducers and mounts grow apart, one sigma
POINTS = 101  # of a curve at rest


@dataclass(frozen=True, slots=True)
class Rubbing:
    """Friction of one model along a run's readings."""

    elements_n: Floats  # (n, k) what each of its elements adds
    slips_n: Floats  # (k,) its size
    std: float  # of each, as part of its size, one sigma

    @property
    def friction_n(self) -> Floats:
        """(n,) of all of them."""
        return np.asarray(self.elements_n.sum(axis=1))


def rubbing(spec: ModelSpec, shown_mm: Floats, rate_hz: float, std_n: float) -> Rubbing:
    """Along readings that begin at rest; `std_n`: of the friction of a mount against its bench."""
    mm = _known(shown_mm)
    mm -= mm[0]
    own = msgspec.structs.replace(spec, effects=[one for one in spec.effects if rubs(one)])
    as_it_is, found, slips_n = _along(own, mm, rate_hz), [np.zeros((len(mm), 0))], []
    for slip_n, one in each_more(own, 1.0 + MORE):
        more_n = (_along(one, mm, rate_hz) - as_it_is) / MORE
        found.append((more_n - more_n[0])[:, None])  # what holds the weight is in the zero
        slips_n.append(abs(slip_n))
    every = sqrt(sum(each**2 for each in slips_n))
    return Rubbing(np.hstack(found), np.array(slips_n), std_n / every if every > 0.0 else 0.0)


def grown_n(spec: ModelSpec, shown_mm: Floats, warmer_k: Floats, rate_hz: float) -> Floats:
    """Force (n,) per mm/K by which readings grow with the temperature of the mount, from where a run begins."""
    mm, most_mm = _known(shown_mm), GROWS_MM_K * warmer_k
    less_n, more_n = (_along(spec, each_mm, rate_hz) for each_mm in (mm - most_mm, mm + most_mm))
    return np.asarray((more_n - less_n) / (2.0 * GROWS_MM_K))


def beyond_n(installation: Installation, mount: Mount, shown_mm: Floats, rate_hz: float) -> Floats:
    """Force (n,) per part by which the curve is steeper beyond its bench, where the weight holds the mount out there.

    It rests elsewhere on its curve then, with no more force: nothing at rest, most from where its bench begins.
    """
    place, spec = installation.place(mount.name), installation.bench_model(mount)
    grid_mm, known = np.linspace(np.nanmin(shown_mm), np.nanmax(shown_mm), POINTS), place.calibration
    rests = []
    for factor in (1.0, 1.0 + MORE):
        steeper = msgspec.structs.replace(known, beyond=known.beyond * factor)
        model = compile_model(calibrated(spec, place._replace(calibration=steeper), mount.model), rate_hz)
        if model.spec.valid.deformation_mm[0] <= 0.0:
            return np.zeros(len(shown_mm))
        row = at_rest(model, {})
        rests.append(np.array([resting_n(model, row(mm)) for mm in grid_mm.tolist()]))
    return np.asarray(np.interp(shown_mm, grid_mm, (rests[1] - rests[0]) / MORE))


def _known(shown_mm: Floats) -> Floats:
    """Without holes."""
    good, row = np.isfinite(shown_mm), np.arange(len(shown_mm))
    return np.asarray(np.interp(row, row[good], shown_mm[good]))


def _along(spec: ModelSpec, mm: Floats, rate_hz: float) -> Floats:
    """What it says (n,) along readings (n,), all else at rest."""
    model = compile_model(spec, rate_hz)
    row, out = at_rest(model, {}), mm.copy()
    inputs = np.tile(row(mm.item(0))[1:], (len(mm), 1))
    inputs[:, [name == "deformation_mm" for name in model.channels[1:]]] = mm[:, None]
    model.run(model.start(row(mm.item(0))), inputs, out)
    return out
