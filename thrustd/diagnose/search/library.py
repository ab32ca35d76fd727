"""Every absent effect as terms of a joint regression, with priors; and free curves of channels, which know no physics.

Priors are what is known of a rig before it is measured (`rig`). Shapes begin at each of their starts;
deformations go with the travel of the record where that is of another order of magnitude.
"""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from thrustd.core.errors import ModelError
from thrustd.core.measures import order_of
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.candidates import combined, moves
from thrustd.diagnose.search.formulas import formula_terms
from thrustd.diagnose.search.rig import RigPriors
from thrustd.identify.regression.friction import FLOW, play_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import lags_of
from thrustd.identify.regression.stops import at_rest, run_stops
from thrustd.identify.regression.table import growth_of, travel_of
from thrustd.identify.regression.terms import Term, at_start
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Effect, Parameter, Site
from thrustd.model.effects import effect_named
from thrustd.model.effects.hysteresis_stops import EFFECT as STOPS
from thrustd.model.elsewhere import AT, KIND, TEMPERATURE, thermal
from thrustd.model.expression import PREFIX, is_expression
from thrustd.model.free_curve import (
    CURVE_OF,
    KNOTS,
    at_places,
    column_of,
    is_curve,
    places,
)
from thrustd.model.modulated import BY, ENDS, LATE, LEVEL, REST, late_decay, modulated
from thrustd.model.stage import DEFORMATION, Floats

RATE_MM_S = 0.015  # of such a mount while it moves
TRAVEL_MM = 1.2  # of a PH-LAB mount between idle and full thrust, for which the starts of the effects are made
WIDE = 1e4  # the same of what the shelf has not as it stands, such as a law by another thermometer
HEIGHT = 0.02  # of the travel, or of the force between its ends: sigma of a free curve's heights
GAIN = 0.1  # of one that multiplies the force
RUBBER = "rubber"
REFERENCE = "reference_degc"
LATE_SAMPLES = 0, 3, 10, 30, 100  # where the lateness of a channel begins
WITHOUT = 0.1  # of a law that follows a channel: where the share begins that is there without it
BOTH = 0.5  # where it begins between a law that grows as a whole and one whose level grows
CONTAINED = (
    "hysteresis_prandtl_ishlinskii",  # by `hysteresis_stops`
    "thermal_expansion_body",  # nearly, by two nodes of heat: `plain` chooses between them
    "thermal_stiffness_body",
    "thermal_stiffness_body_spring",
    "viscous_damping_power",  # by `viscous_damping_carreau`
    "viscous_damping_saturating",  # nearly, by the same
    "mullins_softening_ratio",  # by `mullins_softening_relative`
)


@dataclass(frozen=True, slots=True)
class Rig:
    """What is known of the rig, and what its records show."""

    priors: RigPriors
    travel: float
    spread_n: float
    reference_degc: float | None
    reference_std: float | None  # where the bench's own temperature was recorded
    begins_s: float
    begins_degc: Mapping[str, float]  # by temperature
    force_factor: float  # force spread over PH-LAB's
    hysteresis_travel: float
    growth: float | None  # of the core's own friction, which more of it shares
    rate: float  # mean, while it moves
    play: float  # around the deformation, which keeps its noise out
    ends: Mapping[str, tuple[float, float]]  # of every channel that a law can be in proportion to
    places: Callable[[str], Floats | None]  # of the heights of a free curve of a channel
    heights: Mapping[Site, float]  # one sigma of these
    late_s: tuple[float, ...]  # by which it may act late
    formula: Callable[[Effect], Sequence[Term]]  # of a user, from its starts
    lags_s: tuple[float, float]  # fastest and slowest that a record can show


def rig_of(records: Sequence[Record], base: Base, spec: ModelSpec, priors: RigPriors) -> Rig:
    """From the records, what the model's identification tells, and the rig's file."""
    d = np.concatenate([record.d for record in records])
    y = np.concatenate([record.y for record in records]) * base.scale
    told, apart = (spec.provenance.get(f"{what}_temperature_degC") for what in ("mean", "std"))
    minute = slice(max(1, round(60.0 / records[0].dt_s)))
    first = {name: float(np.mean(c[minute])) for name, c in records[0].channels.items() if name.endswith(KIND)}
    return Rig(
        priors,
        float(np.ptp(d)),
        float(np.nanstd(y)),
        float(told) if isinstance(told, int | float) else first.get(TEMPERATURE),
        float(np.hypot(apart, priors.thermometer_k)) if isinstance(apart, int | float) else None,
        float(records[0].channels["time_s"][0]),
        first,
        order_of(float(np.nanmax(y) - np.nanmin(y)), 6000.0),
        travel_of(base.shape),
        growth_of(base.point) if len(base.shape.radii) else None,
        max(_rate(record, play_of(record.d)) for record in records),
        max(play_of(record.d) for record in records),
        {parts[0]: _ends(parts[0], records) for parts in combined(records[0].channels).values() if len(parts) == 1},
        lambda channel: places_of([column_of(channel, record.channels) for record in records]),
        heights_of(records, base),
        tuple(samples * records[0].dt_s for samples in LATE_SAMPLES),
        lambda effect: formula_terms(effect, records, float(np.nanstd(y))),
        lags_of([(len(record) - record.stood) * record.dt_s for record in records], records[0].dt_s),
    )


def _rate(record: Record, play: float) -> float:
    """Mean rate (mm/s) while it moves by more than its noise."""
    radius = np.array([max(play, 1e-6 * float(np.ptp(record.d)), 1e-12)])
    stop = np.empty((len(record.d), 1))
    run_stops(radius, at_rest(radius, float(record.d[0])), record.d, stop)
    moved = np.abs(np.diff(record.d - radius[0] * stop[:, 0]))
    moves = moved > 1e-6 * radius[0]
    return float(moved[moves].mean() / record.dt_s) if moves.any() else 0.0


def _ends(name: str, records: Sequence[Record]) -> tuple[float, float]:
    low, high = np.quantile(np.concatenate([record.channels[name] for record in records]), [0.005, 0.995])
    return float(low), float(high)


def laws(effects: Iterable[Effect]) -> list[Effect]:
    """Without those that another contains."""
    return [effect for effect in effects if effect.name.partition(AT)[0] not in CONTAINED]


def terms_of(effect: Effect, rig: Rig) -> Iterator[Term]:
    """One per combination of starts of the shape parameters; in proportion to a channel: growing and fading with it."""
    if effect.name.startswith(PREFIX):
        yield from rig.formula(effect)
        return
    if is_curve(effect.name):
        at = rig.places(effect.name.partition(CURVE_OF)[2])
        if at is None:
            raise ModelError(
                f"{effect.name}: fewer than three values are met often; expected a column that moves, or a formula"
            )
        yield curve_term(effect, at, rig.heights[effect.site])
        return
    law, by, channel = effect.name.partition(BY)
    if by:
        ends = rig.ends.get(channel)
        if ends is None:
            raise ModelError(
                f"{effect.name}: expected a column that moves, one of {', '.join(rig.ends) or 'none here'}"
            )
        for term, values, late_s in itertools.product(terms_of(effect_named(law), rig), (ends, ends[::-1]), rig.late_s):
            yield _by(term, effect, values, late_s)
        return
    std = {p.name: _sigma(effect, p, rig) for p in effect.parameters if p.amplitude}
    if rig.reference_std is not None and thermal(effect) and any(p.name == REFERENCE for p in effect.parameters):
        std[REFERENCE] = rig.reference_std
    shape = [p for p in effect.parameters if not p.amplitude]
    for values in itertools.product(*(_starts(effect, p, rig) for p in shape)):
        term = at_start(effect, std, dict(zip([p.name for p in shape], values, strict=True)))
        yield replace(term, shapes=effect is not STOPS or rig.growth is None)


def terms_in_flight(spec: ModelSpec, effects: Sequence[Effect], rig: Rig) -> list[Term]:
    """Effects as terms; of a law that the model has, another size, where it is not the rubber that has it."""
    present = {effect.name: effect for effect in spec.effects}
    places = {(law.word, acts_on(law)) for law in map(effect_named, present)}
    found = []
    for effect in laws(effects):
        known = acts_on(effect) == RUBBER and (effect.word, RUBBER) in places
        if known or of_the_rubber(effect):
            continue
        if effect.name in present:
            values = effect.neutral() | present[effect.name].parameters
            first = next(terms_of(effect, rig))
            centre = {name: values[name] for name in first.std}
            found.append(replace(first, fixed=values, centre=centre, shapes=False))
        elif (effect.word, acts_on(effect)) not in places:  # elsewhere it is another effect of one cause
            found += terms_of(effect, rig)
    return found


def acts_on(effect: Effect) -> str:
    """Where it acts: on what the rubber holds, or on what its installation does to it."""
    return RUBBER if effect.site in ("gain", "spring", "linear") else effect.site


def of_the_rubber(effect: Effect) -> bool:
    """Whether it remembers, and nothing but the deformation: the bench has told it, with a load cell.

    No deck is as sure, and what the rubber remembers when a log begins in flight nobody knows.
    """
    return set(effect.channels) <= {DEFORMATION} and (effect.n_state > 0 or effect.lags is not None)


def _sigma(effect: Effect, p: Parameter, rig: Rig) -> float:
    told = rig.priors.sigma.get(effect.word, {}).get(p.name)
    if told is not None:
        return told
    if effect is STOPS:
        return rig.priors.friction_share * rig.spread_n
    size = (WIDE if is_expression(effect.name) else rig.priors.over_typical) * abs(p.starts[0])
    if p.unit == "mm" or p.unit.startswith("mm/"):
        size *= order_of(rig.travel, TRAVEL_MM)
    if p.unit == "N/mm":
        size *= rig.force_factor / order_of(rig.travel, TRAVEL_MM)
    if p.unit == "N" or p.unit.startswith("N "):
        size *= rig.force_factor
    if p.level:  # as large a prior where a record shakes little
        most = max(map(abs, rig.ends.get(effect.channels[0], (0.0,))))
        size *= (p.level / most) ** 2 if most else 1.0  # a few readings that are not nothing are no level
    return size


def _starts(effect: Effect, p: Parameter, rig: Rig) -> tuple[float, ...]:
    begins = [rig.begins_degc[name] for name in effect.channels if name in rig.begins_degc]
    anchors = {"reference_s": rig.begins_s, "travel_mm": rig.hysteresis_travel if effect is STOPS else None}
    anchors |= dict(zip(("fastest_s", "slowest_s"), rig.lags_s, strict=True))
    anchors |= {
        "flow_mm": FLOW * rig.travel,
        "range_mm": rig.travel,
        "growth": rig.growth,
        REFERENCE: rig.reference_degc if thermal(effect) else next(iter(begins), None),
        "deadband_mm": rig.play,
        "usual_mm_s": rig.rate or None,
    }
    if (told := anchors.get(p.name)) is not None:
        return (float(np.clip(told, p.low, p.high)),)
    starts = p.starts if p.estimate else p.starts[:1]
    factor = order_of(rig.travel, TRAVEL_MM) if p.unit == "mm" else 1.0
    if p.unit == "mm/s" and effect.channels == (DEFORMATION,):
        factor = order_of(rig.rate, RATE_MM_S)
    return tuple(float(np.clip(factor * s, p.low, p.high)) for s in starts)


def curve_term(effect: Effect, at: Floats, sigma: float) -> Term:
    """A free curve with its heights at these places."""
    return at_start(effect, {p.name: sigma for p in effect.parameters if p.amplitude}, at_places(at))


def places_of(columns: Sequence[Floats], knots: int = KNOTS) -> Floats | None:
    """Where in these records the heights of a free curve stand; None where the channel has too few values."""
    column = np.concatenate(columns)
    return places(column, knots) if moves(column) else None


def heights_of(records: Sequence[Record], base: Base) -> dict[Site, float]:
    """One sigma of the heights of free curves: mm, N, and a share."""
    force = HEIGHT * base.scale * float(np.ptp(np.concatenate([record.y[record.known] for record in records])))
    return {"force": force, "deformation": curve_sigma(records), "gain": GAIN}


def curve_sigma(records: Sequence[Record]) -> float:
    """One sigma of a free curve's heights: a share of the travel."""
    return HEIGHT * float(np.ptp(np.concatenate([record.d for record in records])))


def modulations(law: Term, rig: Rig, records: Sequence[Record]) -> Iterator[tuple[Term, list[Floats]]]:
    """A law in proportion to every channel, growing and fading with it, and the proportion (n,) on every record."""
    for (name, ends), late_s in itertools.product(rig.ends.items(), rig.late_s):
        columns = [_late(record.channels[name], late_s, record.dt_s) for record in records]
        for absent, full in (ends, ends[::-1]) if ends[1] > ends[0] else ():
            there = [np.maximum((column - absent) / (full - absent), 0.0) for column in columns]
            share = [WITHOUT + (1.0 - WITHOUT) * each for each in there]
            yield _by(law, modulated(law.effect, name), (absent, full), late_s), share


def _by(law: Term, effect: Effect, ends: tuple[float, ...], late_s: float) -> Term:
    own = dict(zip((*ENDS, LATE, REST), (*ends, late_s, WITHOUT), strict=True))
    own |= {p.name: BOTH for p in effect.parameters if p.name == LEVEL}
    return replace(law, effect=effect, fixed={**effect.neutral(), **law.fixed, **own})


def _late(column: Floats, late_s: float, dt_s: float) -> Floats:
    """As it acts: at rest before the record begins."""
    decay = late_decay(late_s, dt_s)
    found: Floats = lfilter([1.0 - decay], [1.0, -decay], column, zi=[decay * column[0]])[0]
    return found
