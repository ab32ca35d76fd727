"""Both engines' mounts against both engines' brochure routes: which shared sensor moved?

    y = mean over engines of (mounts - brochure) / scale, usual deviations removed

A fault of Mach, altitude, temperature or longitudinal acceleration moves y on every engine at once. The guilty one is
the sensor whose own change over the last seconds explains the change of y, by the sensitivities

    dy = 1.2 dM        thrust at constant fuel flow or N1 falls by 1.2 % per 0.01 Mach (deck, Mach 0.2 to 0.5)
    dy = 0.004 dT      per kelvin, mean of the fuel-flow and spool-speed routes (deck)
    dy = 0.00007 dh    per metre, the same
    dy = m g dn_x / s  engine mass 373 kg (thesis, eq. 4.5)
"""

from math import isfinite

from thrustd.fusion.opinions import FUEL_FLOW, LOWER, N1, N2, SCALE_FLOOR_N, TOLERANCE, UPPER, Opinions
from thrustd.fusion.signal_watch import DRIFT_STEPS, STEP_S, SignalWatch
from thrustd.signals import STANDARD_GRAVITY_M_S2

ENGINE_MASS_KG = 373.0
THRESHOLD = 0.05
HOLD_S = 0.5
SENSITIVITY = {"mach": 1.2, "sat_degC": 0.004, "pressure_altitude_m": 0.00007}
EXPLAINS = (0.4, 2.5)  # predicted over observed: the sensitivities are rough


def group_difference(engine: Opinions) -> tuple[float, float]:
    """(mounts minus brochure, tolerance) of one engine, relative; NaN when one group is silent."""
    mounts = [engine.deviation[i] for i in (UPPER, LOWER) if isfinite(engine.deviation[i]) and not engine.faulty[i]]
    routes = [i for i in (FUEL_FLOW, N1, N2) if isfinite(engine.deviation[i]) and not engine.faulty[i]]
    if not mounts or not routes:
        return float("nan"), 0.0
    brochure = [engine.deviation[i] for i in routes]
    difference = sum(mounts) / len(mounts) - sum(brochure) / len(brochure)
    return difference, THRESHOLD + max(engine.tolerance(i) for i in routes) - TOLERANCE[FUEL_FLOW]


class CommonMode:
    """Mutable: how long the groups have disagreed."""

    def __init__(self) -> None:
        self._outside_s = 0.0

    def step(self, engines: list[Opinions], watches: dict[str, SignalWatch], thrust_n: float) -> str:
        """The shared signal found guilty at this step, or ""."""
        found = [group_difference(engine) for engine in engines]
        same_sign = len({difference > 0 for difference, _ in found}) == 1
        outside = bool(found) and same_sign and all(abs(d) > limit for d, limit in found if isfinite(d))
        outside = outside and all(isfinite(d) for d, _ in found)
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
