"""What may be part of a model, as a shape of the regression: curves, holds, gains of either sign, and its records."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.even import BEYOND
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import KNOTS, prepared
from thrustd.identify.regression.shape import Hold, Point, Shape
from thrustd.identify.regression.walk import hours_of
from thrustd.identify.segments import DEFORMATION, Segment

GENERAL_LAGS = 12
SLOWEST = 0.2  # times the longest record, for relaxation of either sign: slower cannot be told from a slope
FASTEST = 0.25  # of a mean: the shortest time constant that means show
FAST = 1.0 / 6.0  # of the Nyquist frequency: input that moves faster tells holds apart
FAST_SHARE = 0.05  # of the input's power beyond
Kind = Literal["line", "cubic", "curve", "fine"]
COEFFICIENTS: dict[Kind, int] = {"line": 4, "cubic": 4, "curve": KNOTS, "fine": 2 * KNOTS}


@dataclass(frozen=True, slots=True)
class Asked:
    """What may be part of the model. hold, order, segments: wishes; None leaves them to the data."""

    f: Kind = "curve"
    h: Kind = "curve"
    friction: bool = False  # hysteresis, and rubber competes
    hold: Hold | None = None
    order: int | None = None
    segments: int | None = None
    fastest: float = 2.0  # samples: the shortest time constant


MOUNT = Asked(friction=True)


def fine(asked: Asked) -> Asked:
    """With curves that bend more often: means of millions of samples hold so little noise that they tell."""
    kinds: dict[Kind, Kind] = {"curve": "fine"}
    return replace(asked, f=kinds.get(asked.f, asked.f), h=kinds.get(asked.h, asked.h), fastest=FASTEST)


def general_shape(segments: Sequence[Segment], asked: Asked, hold: Hold) -> tuple[Shape, list[Record]]:
    """Gains of either sign, on as many real lags; hysteresis that follows late, if at all; curves as asked for."""
    rubber, _ = prepared(segments)
    y = np.concatenate([segment.force_n for segment in segments]) / rubber.output_scale
    low, high = float(np.nanmin(y)), float(np.nanmax(y))
    edge = BEYOND * (high - low)
    dt_s = min(segment.dt_s for segment in segments)
    longest_s = max(len(segment) * segment.dt_s for segment in segments)
    d = [segment.inputs[DEFORMATION] for segment in segments]
    reach = min(float(x.min()) for x in d), max(float(x.max()) for x in d)
    shape = replace(
        rubber,
        f_grid=Grid(*reach, COEFFICIENTS[asked.f]),
        zero=float(np.clip(0.0, *reach)),
        taus_s=np.geomspace(asked.fastest * dt_s, max(SLOWEST * longest_s, 8 * dt_s), GENERAL_LAGS),
        radii=-rubber.radii if asked.friction else np.zeros(0),
        grows=False,
        terms=(),
        h_grid=None if asked.h == "line" else Grid(low - edge, high + edge, COEFFICIENTS[asked.h]),
        hold=hold,
        passive=False,
        line=asked.f == "line",
        limits_s=(dt_s, longest_s),
        begun=len(segments),
    )
    return shape, records_of(shape, segments)


def anew(shape: Shape, point: Point, begun: int) -> tuple[Shape, Point]:
    """The first so many records begin anywhere, nearest to rest; the others at rest."""
    shape = replace(shape, begun=begun)
    return shape, replace(point, begin=np.zeros(shape.sizes["begin"]))


def records_of(shape: Shape, segments: Sequence[Segment]) -> list[Record]:
    """Records in the shape's units: unloaded before they begin (rubber), or settled at their first sample."""
    return [
        Record(
            s.inputs[DEFORMATION],
            s.force_n / shape.output_scale,
            s.dt_s,
            shape.zero if shape.passive else float(s.inputs[DEFORMATION][0]),
            dict(s.inputs) | hours_of(segments, s),
            place if shape.begun and not shape.passive else None,
        )
        for place, s in enumerate(segments)
    ]


def holds_of(segments: Sequence[Segment]) -> tuple[Hold, ...]:
    """Ramps between samples, and steps as well where the input's power reaches so far that it matters."""
    for segment in segments:
        power = np.abs(np.fft.rfft(segment.inputs[DEFORMATION] - segment.inputs[DEFORMATION].mean())) ** 2
        if float(power[int(FAST * len(power)) :].sum()) > FAST_SHARE * float(power.sum()):
            return "foh", "zoh"
    return ("foh",)
