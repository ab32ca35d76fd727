"""Free curves of every channel, of differences and products of two: what the rest follows, whatever law it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.candidates import combined
from thrustd.diagnose.search.joint import Joint, joint_fit
from thrustd.diagnose.search.library import GAIN, curve_term, heights_of, places_of
from thrustd.diagnose.search.screen import PROBE, plain_parts
from thrustd.diagnose.search.table import Table
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.record import Record
from thrustd.model.effect import Site
from thrustd.model.free_curve import CURVE_OF, column_of, free_curve

CURVES = 5  # that are estimated whole
COARSE = 6  # knots at a first look
NEAR = 0.03  # of the squared error: what is so close is told apart by how many numbers it takes
SAYS = 0.5  # of what the best law removes at first look: who removes less is not


@dataclass(frozen=True, slots=True)
class Followed:
    """A channel, or two of them combined, and what a free curve of it leaves."""

    channel: str
    parts: tuple[str, ...]  # channels that it is made of
    mse: float
    white: float  # the same made white; at a first look as read
    removed: float  # of the mean square, beside what was there
    gain: bool = False  # of the force; else a bias of the deformation, or a force
    whole: bool = False  # explains all that is to be explained
    moved: float = 0.0  # where it was estimated, see `Joint`
    walked: float = 0.0
    noise_variance: float = np.inf  # there
    averaged: float = 0.0  # beside it at a first look, see `Table`

    @property
    def name(self) -> str:
        """The curve as `extend` takes it."""
        return CURVE_OF + self.channel

    @property
    def leaves(self) -> float:
        """Mean square of single samples."""
        return self.mse + self.averaged


def followed(table: Table, sigma_mm: float) -> list[Followed]:
    """Free curves of every channel, of differences and products of two: a bias or a gain. Best first.

    The influence of a bias is taken as the local slope of the force: no run per curve.
    """
    plain, before = [core + beside for core, beside in plain_parts(table)], table.mse()
    slope = [_slope(table, record, out, sigma_mm) for record, out in zip(table.records, plain, strict=True)]
    known = [{name: column[record.known] for name, column in record.channels.items()} for record in table.records]
    found = []
    for name, parts in combined(table.records[0].channels).items():
        columns_of = [column_of(name, channels) for channels in known]
        at = places_of(columns_of, COARSE)
        if at is None:
            continue
        hats, none = [_hats(at, column) for column in columns_of], np.zeros(len(at), bool)
        bias, gain = (
            table.squares(table.beside(table.rows(h * w[:, None] for h, w in zip(hats, weight, strict=True))), none)
            for weight in (slope, [GAIN * out for out in plain])
        )
        mse = min(bias, gain)
        found.append(Followed(name, parts, mse, mse, before - mse, gain < bias, averaged=table.averaged))
    return sorted(found, key=lambda one: one.mse)


def estimated(
    base: Base,
    records: Sequence[Record],
    nothing: Joint,
    looked: Sequence[Followed],
    worth: float,
    whole: Callable[[Joint], bool],
) -> list[Followed]:
    """Free curves that at a first look remove nearly `worth`, estimated whole beside the core; best first.

    Behind one with which nothing is left (`whole`) only those are estimated that looked nearly as good.
    """
    leading = sorted([one for one in looked if one.removed > SAYS * worth][:CURVES], key=lambda one: len(one.parts))
    heights = heights_of(records, base)
    asked = [(one, site) for one in leading for site in heights if site != "gain" or one.gain]  # it mistakes a bias
    found: list[Followed] = []
    told: tuple[Followed, Site] | None = None  # the first with which nothing is left
    for one, site in asked:
        if told is not None and (site != told[1] or not nearly(told[0], one)):
            continue
        at = places_of([column_of(one.channel, record.channels) for record in records])
        if at is not None:
            fit = joint_fit(base, records, (curve_term(free_curve(one.channel, site), at, heights[site]),))
            now = replace(
                one, mse=fit.mse, white=fit.white, removed=nothing.mse - fit.mse, gain=site == "gain", averaged=0.0
            )
            noise = fit.solution.noise_variance
            now = replace(now, whole=whole(fit), moved=fit.moved, walked=fit.walked, noise_variance=noise)
            found.append(now)
            told = told or ((one, site) if now.whole else None)
    best = {one.channel: one for one in sorted(found, key=lambda one: -one.white)}
    return sorted(best.values(), key=lambda one: one.white)


def nearly(best: Followed | None, other: Followed) -> bool:
    """Whether a channel leaves hardly more than the best."""
    return best is not None and other.white <= (1 + NEAR) * best.white


def _slope(table: Table, record: Record, plain: Floats, sigma_mm: float) -> Floats:
    """Force per sigma of deformation (n,), at rest."""
    found = table.fit.solution
    by = PROBE * sigma_mm
    pushed = replace(record, d=record.d + by, before=record.before + by, kept=None)
    return (simulate(found.shape, found.point, pushed, record.known) - plain) / PROBE


def _hats(at: Floats, column: Floats) -> Floats:
    """Basis (n, k) of the broken line of a free curve with its heights at these places."""
    return np.column_stack([np.interp(column, at, one) for one in np.eye(len(at))])
