"""Which hypothesis of the bank leads: a fault is found above FOUND, and over below OVER."""

from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.motion import at_odds
from thrustd.sensors.onsets import INSTALLED_OFF, MOUNTS_OFF, NOBODYS, SCALE_OFF, WELL

FOUND, OVER = 0.98, 0.2


@compiled
def likely(which: int, p: Any) -> float:
    """How likely it is that its sensors are at fault: both mounts are by whatever is wrong with them."""
    return float(p[MOUNTS_OFF] + p[SCALE_OFF] if which in (MOUNTS_OFF, SCALE_OFF) else p[which])


@compiled
def lead_of(found: int, out: Floats) -> int:
    """The hypothesis that leads from now on: of an installation the filter knows nothing, and the mixture holds it."""
    best = int(np.argmax(out[:, 0]))
    if likely(best, out[:, 0]) > FOUND:
        return WELL if best == INSTALLED_OFF else best
    return WELL if likely(found, out[:, 0]) < OVER else found


@compiled
def keep_failure(heard: Any, lead: int, out: Floats) -> None:
    """Since when somebody has failed and nothing tells who: that is found, and over, as a fault of one of them is."""
    p = at_odds(out) if lead in NOBODYS else 0.0
    if p <= OVER:
        heard.somebody_s = 0.0
    elif heard.somebody_s == 0.0 and p > FOUND:
        heard.somebody_s = heard.t_s[0]
