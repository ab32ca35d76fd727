"""The measured force beside the modelled one, before an effect is asked for what is left: another unit, single samples.

    gain = sum(F_model F) / sum(F_model^2)      of what both are above their means

A gain of 0.225 is no effect but pounds; a few samples further from the model than all that it knows are no load.
"""

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.checks import single_samples
from thrustd.model.artifact import ModelSpec
from thrustd.records.roles import Roles
from thrustd.records.units import CONVERSIONS, slips

CLOSE = 0.05  # in logarithms: of a gain to the ratio of two units, the smallest of which is 4.4
TOGETHER = 0.9  # correlation: a model that goes otherwise says nothing of a unit
FAR = 3.0  # widths of the model's range, from that and from what it says


def another_unit(model_n: Floats, measured_n: Floats, roles: Roles) -> str:
    """What the measured force is to the model's, when that is the ratio of two units; empty where it is not."""
    both = np.isfinite(model_n) & np.isfinite(measured_n)
    if roles.output_unit not in CONVERSIONS["N"] or not both.any():
        return ""
    model, measured = (column[both] - column[both].mean() for column in (model_n, measured_n))
    own, cross = float(model @ model), float(model @ measured)
    if cross <= TOGETHER * np.sqrt(own * float(measured @ measured)):
        return ""
    gain = cross / own
    here, there = (slips(times, CLOSE, roles.output_unit) for times in (gain, 1.0 / gain))
    said = f"force_N is {gain:.3g} times what the model says: is "
    if here:
        return roles.in_words(said + " or ".join(here) + "?")
    return roles.in_words(f"{said}the model made of {' or '.join(there)}?") if there else ""


def no_load(model_n: Floats, measured_n: Floats, time_s: Floats, spec: ModelSpec, roles: Roles) -> str:
    """The first of a few samples that no load is; empty where there are none."""
    low, high = spec.valid.force_n
    with np.errstate(invalid="ignore"):
        beyond = np.maximum(low - measured_n, measured_n - high)
        far = np.minimum(beyond, np.abs(measured_n - model_n)) > FAR * (high - low)
    said = roles.output, roles.output_unit
    return single_samples(said, measured_n, time_s, far, spec.valid.force_n, "no load is")
