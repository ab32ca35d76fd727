"""An engine that burns nothing in flight: air turns its spools and leaves slower than it came.

    F = - q A 2 r (1 - r) / (1 + 0.16 M^2)      q: dynamic pressure; A: of the nozzles; r: speed there over flight speed

What flows, rho_n A r V, times what it loses, V (1 - r); 1 / (1 + 0.16 M^2) is about rho_n over rho. It is the gross
thrust less the ram drag of the same stream tube, so a net thrust like that of the deck, which begins at idle. What the
intake then spills, 0.1 of its area times q, acts on the nacelle and is its drag.

An aircraft's file that says nothing of its engines does not make them free of drag: their nozzles are then as large as
the deck's take-off thrust needs, F / JET_PA, and the sigma is that of a stranger (`assumed`).
Reference: Torenbeek, Synthesis of Subsonic Airplane Design, 1982, appendix G-8.3.
"""

from math import hypot, isfinite
from typing import Any

from thrustd.brochure.deck_data import ThrustSurface, corrected_thrust
from thrustd.core.aircraft import Windmilling
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

BELOW_IDLE_PCT = 25.0  # of N1 and N2: no engine that burns turns as slowly
NO_FUEL_KG_S = 0.003  # a tenth of idle
FLIES_N = -10.0  # what the air does to an engine on the ground is less
JET_PA, JET_STD = 8e4, 0.3  # rho v^2 of a jet at take-off: 0.75 kg/m3 at 327 m/s of a JT15D-4; assumed of others
SPEED_RATIO, RATIO_STD = 0.8, 0.4  # r (1 - r) = 0.16 between Torenbeek's 0.24 (low bypass) and 0.07 (high)


def assumed(thrust: ThrustSurface) -> Windmilling:
    """Of engines that nobody has described."""
    take_off_n = corrected_thrust(thrust, thrust.fuel_flow_box_kg_s[1], 0.0)
    return Windmilling(take_off_n / JET_PA, SPEED_RATIO, hypot(JET_STD, RATIO_STD))


@compiled
def windmill(e: Any, readings: Floats) -> None:
    """Thrust of the engine `e` (ENGINE of `source`) if it burns nothing; NaN: as before. And who says whether it does.

    `unlit`: somebody says that it burns nothing, and nobody that it does; who is NaN says nothing.
    """
    mach = readings[e.mach]
    pressure_pa = dynamic_pressure_pa(mach, readings[e.altitude])
    if isfinite(pressure_pa):
        e.off_n = 0.0 - pressure_pa * e.off_m2 / (1.0 + 0.16 * mach * mach)
    fuel_kg_s, n1_pct, n2_pct = readings[e.fuel_flow], readings[e.n1], readings[e.n2]
    e.burns = fuel_kg_s >= NO_FUEL_KG_S or n1_pct >= BELOW_IDLE_PCT or n2_pct >= BELOW_IDLE_PCT
    said = fuel_kg_s < NO_FUEL_KG_S or n1_pct < BELOW_IDLE_PCT or n2_pct < BELOW_IDLE_PCT
    e.unlit = said and not e.burns
