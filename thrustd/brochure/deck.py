"""The brochure deck: net thrust of one engine from fuel flow or N1, Mach, pressure altitude and temperature.

With the total-pressure and total-temperature ratios  delta_t = p_t / 101325 Pa,  theta_t = T_t / 288.15 K

    w  = fuel flow / (delta_t sqrt(theta_t))            corrected fuel flow [kg/s]
    n  = N1 / sqrt(theta_t)                             corrected fan speed [%]
    F  = delta_t * G(w, M)                              net thrust [N],   G(w, M) in thrustd.brochure.deck_data
    w  = exp(H_engine(n) + k M) theta_t^e               the N1 route: the fuel flow which the fan speed stands for

G is fitted to the brochure program's own pairs and to static reference points, H to flights (see
`thrustd.identify.brochure_fit`). Outside the fitted region `extrapolating` is set and the band widens.
Similarity of the corrected quantities: Walsh & Fletcher, Gas Turbine Performance, ch. 4; atmosphere: ISO 2533.
"""

from math import exp, isfinite, nan, sqrt
from typing import Literal, NamedTuple

import msgspec

from thrustd.brochure.deck_data import DeckData, N1Curve, check_deck, corrected_thrust, hermite
from thrustd.errors import DeckError

Route = Literal["fuel_flow", "n1", "none"]

SEA_LEVEL_PRESSURE_PA = 101325.0  # ISO 2533
SEA_LEVEL_TEMPERATURE_K = 288.15  # ISO 2533
TROPOPAUSE_M = 11000.0  # ISO 2533
ZERO_CELSIUS_K = 273.15


class DeckInputs(NamedTuple):
    """What the deck may use at one instant; NaN = missing or stale."""

    fuel_flow_kg_s: float
    n1_pct: float
    n2_pct: float
    mach: float
    pressure_altitude_m: float
    sat_degc: float
    n1_rate_pct_s: float


class DeckEstimate(NamedTuple):
    """Thrust of one engine by the brochure method; `std_n` is one sigma, the engine's own bias included."""

    thrust_n: float
    std_n: float
    route: Route  # the one that weighs most; "none" = no estimate, thrust and std are NaN
    extrapolating: bool
    transient: bool
    fuel_flow_thrust_n: float  # each route alone, NaN when its input is missing
    n1_thrust_n: float


NO_ESTIMATE = DeckEstimate(nan, nan, "none", False, False, nan, nan)


class Deck:
    """A deck ready to fly: immutable after construction, plain float arithmetic, a few microseconds per call."""

    def __init__(self, data: DeckData) -> None:
        self.data = data
        self._curves = {curve.engine: curve for curve in data.n1}

    @classmethod
    def from_json(cls, text: str, where: str) -> "Deck":
        """Parse and check a deck; `where` names the file in the DeckError."""
        try:
            data = msgspec.json.decode(text, type=DeckData)
        except (msgspec.DecodeError, UnicodeEncodeError) as error:
            raise DeckError(f"{where}: not a brochure deck: {error}") from None
        check_deck(data, where)
        return cls(data)

    def estimate(self, inputs: DeckInputs, engine: int) -> DeckEstimate:
        """Thrust of `engine` with its spread; missing temperature is replaced by ISA, else NaN in means "none"."""
        mach, altitude_m = inputs.mach, inputs.pressure_altitude_m
        if not (isfinite(mach) and isfinite(altitude_m)):
            return NO_ESTIMATE
        mach = max(mach, 0.0)
        delta_t, theta_t = total_ratios(mach, altitude_m, inputs.sat_degc)
        curve = self._curves.get(engine)
        flow_n, flow_outside = self._by_fuel_flow(inputs.fuel_flow_kg_s, mach, delta_t, theta_t)
        n1_n, n1_outside = self._by_n1(inputs.n1_pct, mach, delta_t, theta_t, curve)
        weight_n1 = self._n1_weight(flow_n, n1_n, inputs.n1_rate_pct_s)
        if not isfinite(weight_n1):
            return NO_ESTIMATE
        thrust_n = _blend(flow_n, n1_n, weight_n1)
        by_n1 = weight_n1 > 0.5
        outside = n1_outside if by_n1 else flow_outside
        rate_n_s = self._thrust_rate(inputs, mach, delta_t, theta_t, curve)
        std_n = self._std(thrust_n, outside, weight_n1, curve, rate_n_s, not isfinite(inputs.sat_degc))
        transient = abs(inputs.n1_rate_pct_s) > self.data.spread.transient_n1_rate_pct_s
        return DeckEstimate(thrust_n, std_n, "n1" if by_n1 else "fuel_flow", outside, transient, flow_n, n1_n)

    def _by_fuel_flow(self, flow_kg_s: float, mach: float, delta_t: float, theta_t: float) -> tuple[float, bool]:
        if not (isfinite(flow_kg_s) and flow_kg_s > 0.0):
            return nan, False
        corrected = flow_kg_s / (delta_t * sqrt(theta_t))
        return delta_t * corrected_thrust(self.data.thrust, corrected, mach), self._outside(corrected, mach)

    def _by_n1(
        self, n1_pct: float, mach: float, delta_t: float, theta_t: float, curve: N1Curve | None
    ) -> tuple[float, bool]:
        if curve is None or not (isfinite(n1_pct) and n1_pct > 0.0):
            return nan, False
        corrected_pct = n1_pct / sqrt(theta_t)
        flow = exp(hermite(curve, corrected_pct) + curve.mach_slope * mach) * theta_t**curve.temperature_exponent
        low, high = curve.fitted_n1_pct
        outside = not low <= corrected_pct <= high or self._outside(flow, mach)
        return delta_t * corrected_thrust(self.data.thrust, flow, mach), outside

    def _outside(self, corrected_kg_s: float, mach: float) -> bool:
        low, high = self.data.thrust.fitted_fuel_flow_kg_s
        mach_low, mach_high = self.data.thrust.fitted_mach
        return not (low <= corrected_kg_s <= high and mach_low <= mach <= mach_high)

    def _n1_weight(self, flow_n: float, n1_n: float, rate_pct_s: float) -> float:
        # in transients N1 follows the thrust better than fuel flow; the blend keeps the hand-over smooth
        if not isfinite(n1_n):
            return 0.0 if isfinite(flow_n) else nan
        if not isfinite(flow_n):
            return 1.0
        if not isfinite(rate_pct_s):
            return 0.0
        ratio = (rate_pct_s / self.data.spread.transient_n1_rate_pct_s) ** 2
        return ratio / (1.0 + ratio)

    def _thrust_rate(
        self, inputs: DeckInputs, mach: float, delta_t: float, theta_t: float, curve: N1Curve | None
    ) -> float:
        """dF/dt = dF/dN1 dN1/dt in N/s, the part of the spread that moves with the throttle."""
        if curve is None or not (isfinite(inputs.n1_rate_pct_s) and inputs.n1_rate_pct_s and inputs.n1_pct > 0):
            return 0.0
        step_pct = 0.5
        low, _ = self._by_n1(inputs.n1_pct, mach, delta_t, theta_t, curve)
        high, _ = self._by_n1(inputs.n1_pct + step_pct, mach, delta_t, theta_t, curve)
        return (high - low) / step_pct * inputs.n1_rate_pct_s

    def _std(
        self,
        thrust_n: float,
        outside: bool,
        weight_n1: float,
        curve: N1Curve | None,
        rate_n_s: float,
        no_temperature: bool,
    ) -> float:
        spread = self.data.spread
        relative_sq = spread.relative**2 + (spread.extrapolating_relative**2 if outside else 0.0)
        relative_sq += (weight_n1 * curve.relative_std) ** 2 if curve else 0.0
        relative_sq += spread.missing_temperature_relative**2 if no_temperature else 0.0
        return sqrt(relative_sq * thrust_n**2 + spread.floor_n**2 + (spread.transient_lag_s * rate_n_s) ** 2)


def total_ratios(mach: float, pressure_altitude_m: float, sat_degc: float) -> tuple[float, float]:
    """(delta_t, theta_t) from Mach, pressure altitude [m] and static temperature [degC]; NaN temperature = ISA."""
    isa_k = max(SEA_LEVEL_TEMPERATURE_K - 0.0065 * pressure_altitude_m, 216.65)
    pressure_pa = SEA_LEVEL_PRESSURE_PA * (isa_k / SEA_LEVEL_TEMPERATURE_K) ** 5.25588
    if pressure_altitude_m > TROPOPAUSE_M:
        pressure_pa *= exp(-(pressure_altitude_m - TROPOPAUSE_M) / 6341.62)
    static_k = sat_degc + ZERO_CELSIUS_K if isfinite(sat_degc) else isa_k
    stagnation = 1.0 + 0.2 * mach * mach
    return (
        pressure_pa / SEA_LEVEL_PRESSURE_PA * stagnation**3.5,
        static_k * stagnation / SEA_LEVEL_TEMPERATURE_K,
    )


def _blend(flow_n: float, n1_n: float, weight_n1: float) -> float:
    if weight_n1 == 0.0:
        return flow_n
    if weight_n1 == 1.0:
        return n1_n
    return (1.0 - weight_n1) * flow_n + weight_n1 * n1_n
