"""The brochure deck: net thrust of one engine from fuel flow or N1, Mach, pressure altitude and temperature.

With the total-pressure and total-temperature ratios  delta_t = p_t / 101325 Pa,  theta_t = T_t / 288.15 K

    w  = fuel flow / (delta_t sqrt(theta_t))            corrected fuel flow [kg/s]
    n  = N1 / sqrt(theta_t)                             corrected fan speed [%]
    F  = delta_t * G(w, M)                              net thrust [N],   G(w, M) in thrustd.brochure.deck_data
    w  = exp(H_engine(n) + k M) theta_t^e               the N1 source: the fuel flow which the fan speed stands for

G is fitted to the brochure program's own pairs and to static reference points, H to flights (see
`thrustd.brochure.fit.deck_fit`). Outside the fitted region `extrapolating` is set and the band widens.
Similarity of the corrected quantities: Walsh & Fletcher, Gas Turbine Performance, ch. 4; atmosphere: ISO 2533.
"""

from math import hypot, isfinite, log, nan, sqrt
from typing import Literal, NamedTuple

import msgspec
import numpy as np

from thrustd.brochure.deck_curves import DeckInputs, DeckNumbers, along, estimate, ratios, spool_flow
from thrustd.brochure.deck_data import DeckData, check_deck, curve_numbers, spread_numbers, surface_numbers
from thrustd.core.columns import Floats
from thrustd.core.errors import DeckError

Source = Literal["fuel_flow", "n1", "none"]


class DeckEstimate(NamedTuple):
    """Thrust of one engine by the brochure method; `std_n` is one sigma, the engine's own bias included."""

    thrust_n: float
    std_n: float
    source: Source  # the one that weighs most; "none" = no estimate, thrust and std are NaN
    extrapolating: bool
    transient: bool
    fuel_flow_thrust_n: float  # each source alone, NaN when its input is missing
    n1_thrust_n: float
    n2_thrust_n: float
    per_fuel_n: float  # dF / d ln(fuel flow)


class DeckRows(NamedTuple):
    """What a deck says of many instants, each (n,); NaN = it does not."""

    thrust_n: Floats
    std_n: Floats
    fuel_flow_n: Floats  # by each source alone
    n1_n: Floats
    n2_n: Floats
    per_fuel_n: Floats  # dF / d ln(fuel flow)
    middle_per_fuel_n: Floats  # the same where the median of fuel flow, N1 and N2 puts the fuel flow
    middle_log_flow: Floats  # ln of that corrected fuel flow, kg/s


class Deck:
    """A deck ready to fly: one compiled call per estimate."""

    def __init__(self, data: DeckData) -> None:
        self.data = data
        self._numbers = {curve.engine: _numbers(data, curve.engine) for curve in (*data.n1, *data.n2)}
        self._without_curves = _numbers(data, None)

    @classmethod
    def from_json(cls, text: str, where: str) -> "Deck":
        """Parse and check a deck; `where` names the file in the DeckError."""
        try:
            data = msgspec.json.decode(text, type=DeckData)
        except (msgspec.DecodeError, UnicodeEncodeError) as error:
            raise DeckError(f"{where}: not a brochure deck: {error}") from None
        check_deck(data, where)
        return cls(data)

    def burning(self, fuel_std: float) -> "Deck":
        """The same with a fuel whose heat per kg/s that is said is not known better than this, relative."""
        if not fuel_std:
            return self
        spread = self.data.spread
        wider = msgspec.structs.replace(spread, fuel_flow_relative=hypot(spread.fuel_flow_relative, fuel_std))
        return Deck(msgspec.structs.replace(self.data, spread=wider))

    def estimate(self, inputs: DeckInputs, engine: int) -> DeckEstimate:
        """Thrust of `engine` with its spread; ISA stands in for a missing temperature, other NaN mean "none"."""
        thrust_n, std_n, weight_n1, outside, transient, *deck_n = estimate(self.numbers(engine), inputs)[:9]
        source: Source = "none" if not isfinite(weight_n1) else "n1" if weight_n1 > 0.5 else "fuel_flow"
        return DeckEstimate(thrust_n, std_n, source, outside, transient, *deck_n)

    def along(self, rows: Floats, engine: int) -> DeckRows:
        """Of many instants, inputs (n, 7) in the order of `DeckInputs`."""
        out = np.empty((len(rows), len(DeckRows._fields)))
        along(self.numbers(engine), rows, out)
        return DeckRows(*out.T)

    def log_flows(self, inputs: DeckInputs, engine: int) -> tuple[float, float, float]:
        """ln of the corrected fuel flow: as measured, as N1 and as N2 stand for it; NaN where nothing says so."""
        deck, mach = self.numbers(engine), max(inputs.mach, 0.0)
        delta_t, theta_t = ratios(mach, inputs.pressure_altitude_m, inputs.sat_degc)
        by_n1, _ = spool_flow(deck.curve_1, deck.line_1, inputs.n1_pct, mach, theta_t)
        by_n2, _ = spool_flow(deck.curve_2, deck.line_2, inputs.n2_pct, mach, theta_t)
        burnt = inputs.fuel_flow_kg_s / (delta_t * sqrt(theta_t))
        said = [log(w) if w > 0.0 else nan for w in (burnt, by_n1, by_n2)]
        return said[0], said[1], said[2]

    def numbers(self, engine: int) -> DeckNumbers:
        """What `deck_curves.estimate` reads of the deck for one engine."""
        return self._numbers.get(engine, self._without_curves)


def _numbers(data: DeckData, engine: int | None) -> DeckNumbers:
    n1, n2 = [next((curve for curve in spool if curve.engine == engine), None) for spool in (data.n1, data.n2)]
    return DeckNumbers(*surface_numbers(data.thrust), spread_numbers(data), *curve_numbers(n1), *curve_numbers(n2))


def total_ratios(mach: float, pressure_altitude_m: float, sat_degc: float) -> tuple[float, float]:
    """(delta_t, theta_t) from Mach, pressure altitude [m] and static temperature [degC]; NaN temperature = ISA."""
    delta_t, theta_t = ratios(mach, pressure_altitude_m, sat_degc)
    return delta_t, theta_t
