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

from math import isfinite, nan, sqrt
from typing import Literal, NamedTuple

import msgspec

from thrustd.brochure.deck_curves import ratios, routes
from thrustd.brochure.deck_data import DeckData, check_deck, curve_numbers, surface_numbers
from thrustd.errors import DeckError

Route = Literal["fuel_flow", "n1", "none"]


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
    n2_thrust_n: float


NO_CURVES = (*curve_numbers(None), *curve_numbers(None))
NO_ESTIMATE = DeckEstimate(nan, nan, "none", False, False, nan, nan, nan)


class Deck:
    """A deck ready to fly: immutable after construction, plain float arithmetic, some ten microseconds per call."""

    def __init__(self, data: DeckData) -> None:
        self.data = data
        self._n1 = {curve.engine: curve for curve in data.n1}
        n2 = {curve.engine: curve for curve in data.n2}
        self._surface = surface_numbers(data.thrust)
        self._curves = {
            engine: (*curve_numbers(self._n1.get(engine)), *curve_numbers(n2.get(engine)))
            for engine in {*self._n1, *n2}
        }

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
        """Thrust of `engine` with its spread; ISA stands in for a missing temperature, other NaN mean "none"."""
        if not (isfinite(inputs.mach) and isfinite(inputs.pressure_altitude_m)):
            return NO_ESTIMATE
        mach = max(inputs.mach, 0.0)
        curves = self._curves.get(engine, NO_CURVES)
        flow_n, n1_n, n2_n, flow, n1_flow, n1_outside = routes(
            *(*self._surface, *curves, inputs.fuel_flow_kg_s, inputs.n1_pct, inputs.n2_pct),
            *(mach, inputs.pressure_altitude_m, inputs.sat_degc),
        )
        weight_n1 = self._n1_weight(flow_n, n1_n, inputs.n1_rate_pct_s)
        if not isfinite(weight_n1):
            return NO_ESTIMATE._replace(n2_thrust_n=n2_n)
        by_n1 = weight_n1 > 0.5
        outside = self._outside(n1_flow if by_n1 else flow, mach) or (by_n1 and n1_outside)
        thrust_n = flow_n if weight_n1 == 0.0 else n1_n if weight_n1 == 1.0 else flow_n + weight_n1 * (n1_n - flow_n)
        std_n = self._std(inputs, engine, thrust_n, outside, weight_n1)
        transient = abs(inputs.n1_rate_pct_s) > self.data.spread.transient_n1_rate_pct_s
        route: Route = "n1" if by_n1 else "fuel_flow"
        return DeckEstimate(thrust_n, std_n, route, outside, transient, flow_n, n1_n, n2_n)

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

    def _std(self, inputs: DeckInputs, engine: int, thrust_n: float, outside: bool, weight_n1: float) -> float:
        spread = self.data.spread
        curve = self._n1.get(engine)
        relative_sq = spread.relative**2 + (spread.extrapolating_relative**2 if outside else 0.0)
        relative_sq += (weight_n1 * curve.relative_std) ** 2 if curve else 0.0
        relative_sq += 0.0 if isfinite(inputs.sat_degc) else spread.missing_temperature_relative**2
        rate_pct_s = inputs.n1_rate_pct_s if isfinite(inputs.n1_rate_pct_s) else 0.0
        lag_n = spread.transient_lag_s * spread.thrust_per_n1_n * rate_pct_s
        return sqrt(relative_sq * thrust_n**2 + spread.floor_n**2 + lag_n**2)


def total_ratios(mach: float, pressure_altitude_m: float, sat_degc: float) -> tuple[float, float]:
    """(delta_t, theta_t) from Mach, pressure altitude [m] and static temperature [degC]; NaN temperature = ISA."""
    delta_t, theta_t = ratios(mach, pressure_altitude_m, sat_degc)
    return delta_t, theta_t
