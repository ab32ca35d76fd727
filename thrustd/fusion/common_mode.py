"""Both engines' mounts against both engines' brochure routes: which shared sensor moved?

    y = mean over engines of (mounts - brochure) / scale, usual deviations removed

A fault of Mach, altitude, temperature or longitudinal acceleration moves y on every engine at once. The guilty one is
the sensor whose own change over the last seconds explains the change of y, by the sensitivities

    dy = 1.2 dM        thrust at constant fuel flow or N1 falls by 1.2 % per 0.01 Mach (deck, Mach 0.2 to 0.5)
    dy = 0.004 dT      per kelvin, mean of the fuel-flow and spool-speed routes (deck)
    dy = 0.00007 dh    per metre, the same
    dy = m g dn_x / s  engine mass 373 kg (thesis, eq. 4.5)
"""

from thrustd.fusion.opinions import SCALE_FLOOR_N
from thrustd.fusion.signal_watch import DRIFT_STEPS, STEP_S, SignalWatch
from thrustd.signals import STANDARD_GRAVITY_M_S2

ENGINE_MASS_KG = 373.0
HOLD_S = 0.5
SENSITIVITY = {"mach": 1.2, "sat_degC": 0.004, "pressure_altitude_m": 0.00007}
EXPLAINS = (0.4, 2.5)  # predicted over observed: the sensitivities are rough


class CommonMode:
    """Mutable: how long the groups have disagreed."""

    def __init__(self) -> None:
        self._outside_s = 0.0

    def step(self, found: list[list[float]], watches: dict[str, SignalWatch], thrust_n: float) -> str:
        """The shared signal found guilty at this step, or "". `found`: see `Opinions.group_differences`."""
        outside = bool(found) and all(abs(d) > limit for d, limit in found)  # NaN is not
        outside = outside and len({difference > 0 for difference, _ in found}) == 1
        self._outside_s = self._outside_s + STEP_S if outside else 0.0
        if self._outside_s < HOLD_S:
            return ""
        return self._guilty(sum(d for d, _ in found) / len(found), watches, thrust_n)

    def _guilty(self, difference: float, watches: dict[str, SignalWatch], thrust_n: float) -> str:
        gains = dict(SENSITIVITY)
        gains["accel_x_g"] = ENGINE_MASS_KG * STANDARD_GRAVITY_M_S2 / max(thrust_n, SCALE_FLOOR_N)
        best, best_miss = "", 1.0
        for name, gain in gains.items():
            ratio = gain * watches[name].change(DRIFT_STEPS) / difference
            miss = abs(ratio - 1.0)
            if EXPLAINS[0] <= ratio <= EXPLAINS[1] and miss < best_miss:
                best, best_miss = name, miss
        return best
