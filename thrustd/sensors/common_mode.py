"""Both engines' mounts against both engines' brochure routes: which shared sensor moved?

    y = mean over engines of (mounts - brochure) / scale, usual deviations removed

A fault of Mach, altitude, temperature or longitudinal acceleration moves y on every engine at once. The guilty one is
the sensor whose own change over the last seconds explains the change of y, by the sensitivities

    dy = 1.2 dM        thrust at constant fuel flow or N1 falls by 1.2 % per 0.01 Mach (deck, Mach 0.2 to 0.5)
    dy = 0.004 dT      per kelvin, mean of the fuel-flow and spool-speed routes (deck)
    dy = 0.00007 dh    per metre, the same
    dy = m g dn_x / s  engine mass 373 kg (thesis, eq. 4.5)
"""

from collections.abc import Mapping

from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.sensors.opinions import SCALE_FLOOR_N, Floats
from thrustd.sensors.signal_watch import DRIFT_STEPS, SignalWatch

ENGINE_MASS_KG = 373.0
HOLD_S = 0.5
SENSITIVITY = {"mach": 1.2, "sat_degC": 0.004, "pressure_altitude_m": 0.00007}
EXPLAINS = (0.4, 2.5)  # predicted over observed: the sensitivities are rough


@compiled
def differ(differences: Floats) -> bool:
    """Mounts and brochure of every engine differ, to the same side; rows as `Opinions.differences`, NaN is silence."""
    above = below = 0
    for i in range(len(differences)):
        difference, limit = differences[i]
        above += difference > limit
        below += -difference > limit
    return max(above, below) == len(differences)


def guilty(differences: Floats, watches: Mapping[str, SignalWatch], thrust_n: float) -> str:
    """The shared signal whose change explains that they differ, or ""."""
    gains = {**SENSITIVITY, "accel_x_g": ENGINE_MASS_KG * STANDARD_GRAVITY_M_S2 / max(thrust_n, SCALE_FLOOR_N)}
    difference = sum(differences[:, 0].tolist()) / len(differences)
    best, best_miss = "", 1.0
    for name, gain in gains.items():
        ratio = gain * watches[name].change(DRIFT_STEPS) / difference
        miss = abs(ratio - 1.0)
        if EXPLAINS[0] <= ratio <= EXPLAINS[1] and miss < best_miss:
            best, best_miss = name, miss
    return best
