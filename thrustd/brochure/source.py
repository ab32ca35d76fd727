"""One engine's brochure thrust in flight: how fast its spools turn up, the deck, the hand-over between its sources.

`look` at the readings as they came, for the monitor; `tell` the filter what the trusted ones say.
"""

from collections.abc import Callable
from math import isfinite, nan
from typing import Any, NamedTuple

import numba
import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.brochure.deck_curves import NUMBERS, DeckInputs, DeckNumbers, estimate
from thrustd.brochure.hand_over import HandOver, hand_over
from thrustd.brochure.rate import smooth_rate
from thrustd.brochure.windmilling import FLIES_N, assumed, windmill
from thrustd.core.aircraft import Windmilling
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled, entry, named
from thrustd.fusion.fusion_inputs import INPUTS

N1_PER_N2 = 1.5  # per cent of fan speed per per cent of core speed, idle to take-off
ENGINE = np.dtype(
    [
        # where its readings are
        *((name, np.int64) for name in ("fuel_flow", "n1", "n2", "mach", "altitude", "temperature")),
        *((name, np.float64) for name in ("n1_lagged_pct", "n2_lagged_pct", "n1_rate_pct_s", "std_n")),
        *((name, np.float64) for name in ("fuel_flow_n", "n1_n", "n2_n")),  # thrust by each
        *((name, np.float64) for name in ("per_fuel_n", "log_flow")),
        *((name, np.float64) for name in ("off_m2", "off_std", "off_n")),  # of one that burns nothing: relative, N
        ("unlit", np.bool_),
        ("burns", np.bool_),
        ("outside", np.bool_),
        ("transient", np.bool_),
    ]
)


class _Work(NamedTuple):
    engine: Any  # (1,) ENGINE
    deck: DeckNumbers
    hand_over: Floats  # its row


class BrochureSource:
    """Mutable; only what the hand-over has learnt outlives a restart."""

    def __init__(
        self, deck: Deck, engine: int, place: Callable[[str, int], int], windmilling: Windmilling | None = None
    ) -> None:
        """`place` of a signal's reading among those that `look` is given."""
        self.hand_over = HandOver()
        self._engine = np.zeros(1, ENGINE)
        self._engine[["n1_lagged_pct", "n2_lagged_pct"]] = nan
        for name, signal in (("fuel_flow", "fuel_flow_kg_s"), ("n1", "n1_pct"), ("n2", "n2_pct")):
            self._engine[name] = place(signal, engine)
        for name, signal in (("mach", "mach"), ("altitude", "pressure_altitude_m"), ("temperature", "sat_degC")):
            self._engine[name] = place(signal, 0)
        off = windmilling or assumed(deck.data.thrust)
        self._engine[["off_m2", "off_std"]] = off.area_m2, off.std
        self._work = _Work(self._engine, deck.numbers(engine), self.hand_over.row)

    def look(self, dt_s: float, readings: Floats, n1_trusted: bool, deck_n: Floats) -> None:
        """Readings dt_s after the last ones; NaN = missing or stale. No rate is taken of an untrusted N1.

        -> `deck_n` (6,): thrust by fuel flow, N1 and N2, sigma of the deck; dF/d ln w and ln w of
        the corrected fuel flow w by the median of the three.
        """
        _look(self._work, dt_s, readings, n1_trusted, deck_n)

    def tell(self, dt_s: float, readings: Floats, ages_s: Floats, fewer: bool, told: Any) -> None:
        """Brochure and N1 into `told`, a row of fusion's INPUTS; `fewer`: readings are left out that were looked at."""
        _tell(self._work, dt_s, readings, ages_s, fewer, told)


@compiled
def _ask(e: Any, deck: DeckNumbers, readings: Floats) -> None:
    """The deck."""
    given = DeckInputs(
        readings[e.fuel_flow], readings[e.n1], readings[e.n2], readings[e.mach], readings[e.altitude],
        readings[e.temperature], e.n1_rate_pct_s,
    )  # fmt: skip
    said = estimate(deck, given)
    _, e.std_n, _, e.outside, e.transient, e.fuel_flow_n, e.n1_n, e.n2_n, _, e.per_fuel_n, e.log_flow = said


def _look_at(work: _Work, dt_s: float, readings: Floats, n1_trusted: bool, deck_n: Floats) -> None:
    e = work.engine[0]
    e.n1_rate_pct_s, e.n1_lagged_pct = smooth_rate(e.n1_lagged_pct, readings[e.n1], dt_s)
    if not n1_trusted:
        e.n1_rate_pct_s = nan
    _ask(e, work.deck, readings)
    deck_n[0], deck_n[1], deck_n[2], deck_n[3] = e.fuel_flow_n, e.n1_n, e.n2_n, e.std_n
    deck_n[4], deck_n[5] = e.per_fuel_n, e.log_flow


def _tell_filter(work: _Work, dt_s: float, readings: Floats, ages_s: Floats, fewer: bool, told: Any) -> None:
    e, t = work.engine[0], told[0]
    windmill(e, readings)
    if fewer:
        _ask(e, work.deck, readings)
    n2_rate_pct_s, e.n2_lagged_pct = smooth_rate(e.n2_lagged_pct, readings[e.n2], dt_s)
    t.n1_pct, t.n1_rate_pct_s = readings[e.n1], e.n1_rate_pct_s
    if not (isfinite(t.n1_pct) and isfinite(e.n1_rate_pct_s)):  # while N1 is excluded or missing: N2
        t.n1_rate_pct_s = N1_PER_N2 * n2_rate_pct_s
    t.brochure_n, t.brochure_std_n, t.brochure_lag_n = hand_over(
        work.hand_over, dt_s, e.std_n, e.fuel_flow_n, e.n1_n, t.n1_pct, t.n1_rate_pct_s
    )
    t.brochure_age_s = max(ages_s[e.n1], ages_s[e.fuel_flow])
    t.brochure_extrapolating, t.transient = e.outside, e.transient
    t.unlit, t.burns, t.off_n, t.off_std_n = e.unlit, e.burns, e.off_n, e.off_std * abs(e.off_n)
    if e.unlit and e.off_n < FLIES_N:
        t.brochure_n, t.brochure_std_n, t.brochure_lag_n = t.off_n, t.off_std_n, 0.0


_F, _ROW = numba.float64, numba.float64[::1]
_WORK, _TOLD = named(_Work, numba.from_dtype(ENGINE)[::1], NUMBERS, _ROW), numba.from_dtype(INPUTS)[::1]
_look: Any = entry(compiled(_look_at, numba.void(_WORK, _F, _ROW, numba.boolean, _ROW), "numpy"))
_tell: Any = entry(compiled(_tell_filter, numba.void(_WORK, _F, _ROW, _ROW, numba.boolean, _TOLD), "numpy"))
