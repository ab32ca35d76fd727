"""An engine that burns nothing in flight: air turns its spools and leaves slower than it came.

    F = - q A 2 r (1 - r) / (1 + 0.16 M^2)      q: dynamic pressure; A: of the nozzles; r: speed there over flight speed

What flows, rho_n A r V, times what it loses, V (1 - r); 1 / (1 + 0.16 M^2) is about rho_n over rho. It is the gross
thrust less the ram drag of the same stream tube, so a net thrust like that of the deck, which begins at idle. What the
intake then spills, 0.1 of its area times q, acts on the nacelle and is its drag.
Reference: Torenbeek, Synthesis of Subsonic Airplane Design, 1982, appendix G-8.3.
"""

from math import isfinite
from typing import Any

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

BELOW_IDLE_PCT = 25.0  # of N1: no engine that burns turns as slowly
NO_FUEL_KG_S = 0.003  # a tenth of idle
FLIES_N = -10.0  # what the air does to an engine on the ground is less


@compiled
def windmill(e: Any, readings: Floats) -> None:
    """Thrust of the engine `e` (ENGINE of `source`) if it burns nothing, and whether it does not; NaN: as before."""
    mach = readings[e.mach]
    pressure_pa = dynamic_pressure_pa(mach, readings[e.altitude])
    if isfinite(pressure_pa):
        e.off_n = 0.0 - pressure_pa * e.off_m2 / (1.0 + 0.16 * mach * mach)
    no_fuel = readings[e.fuel_flow] < NO_FUEL_KG_S and readings[e.n1] < BELOW_IDLE_PCT  # NaN is neither
    e.unlit = e.off_n < FLIES_N and no_fuel
