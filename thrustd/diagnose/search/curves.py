"""Free curves of every channel, of differences and products of two: what the rest follows, whatever law it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.joint import Joint, joint_fit
from thrustd.diagnose.search.library import column_of, combined, free_curve
from thrustd.diagnose.search.screen import PROBE, Table, means, plain_parts
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.sweep import simulate
from thrustd.identify.regression.terms import Term
from thrustd.model.effect import Site

GAIN = 0.1  # sigma of a free curve that multiplies the force
HEIGHT = 0.02  # of the travel, or of the force between its ends: sigma of a free curve's heights
CURVES = 5  # that are estimated whole
FINE = 16  # knots of these: a bump of a tenth of a channel's way shows
SAYS = 0.5  # of what the best law removes at first look: who removes less is not


@dataclass(frozen=True, slots=True)
class Followed:
    """A channel, or two of them combined, and what a free curve of it leaves."""

    channel: str
    parts: tuple[str, ...]  # channels that it is made of
    mse: float
    removed: float  # of the mean square, beside what was there
    gain: bool = False  # of the force; else a bias of the deformation, or a force
    whole: bool = False  # explains all that is to be explained
    moved: float = 0.0  # where it was estimated, see `Joint`
    walked: float = 0.0
    noise_variance: float = np.inf  # there


def followed(table: Table, sigma_mm: float) -> list[Followed]:
    """Free curves of every channel, of differences and products of two: a bias or a gain. Best first.

    The influence of a bias is taken as the local slope of the force: no run per curve.
    """
    plain, before = [core + beside for core, beside in plain_parts(table)], table.mse()
    slope = [_slope(table, record, out, sigma_mm) for record, out in zip(table.records, plain, strict=True)]
    known = [{name: column[record.known] for name, column in record.channels.items()} for record in table.records]
    found = []
    for name, parts in combined(table.records[0].channels).items():
        columns_of = [column_of(name, parts, channels) for channels in known]
        term = free_curve(name, np.concatenate(columns_of), sigma_mm)
        if term is None:
            continue
        hats = [_hats(term, column) for column in columns_of]
        none = np.zeros(len(term.free), bool)
        bias, gain = (
            table.squares(
                np.concatenate([means(h * w[:, None], table.width) for h, w in zip(hats, weight, strict=True)]), none
            )
            for weight in (slope, [GAIN * out for out in plain])
        )
        mse = min(bias, gain)
        found.append(Followed(name, parts, mse, before - mse, gain < bias))
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

    Those behind one with which nothing is left (`whole`) are not estimated.
    """
    leading = sorted([one for one in looked if one.removed > SAYS * worth][:CURVES], key=lambda one: len(one.parts))
    force_n = HEIGHT * base.scale * float(np.ptp(np.concatenate([record.y[record.known] for record in records])))
    sizes: dict[Site, float] = {"force": force_n, "deformation": curve_sigma(records), "gain": GAIN}
    asked = [(one, site) for one in leading for site in sizes if site != "gain" or one.gain]  # the look mistakes a bias

    def fitted(one: Followed, site: Site) -> Joint | None:
        columns_of = [column_of(one.channel, one.parts, record.channels) for record in records]
        term = free_curve(one.channel, np.concatenate(columns_of), sizes[site], site=site, knots=FINE)
        seen = [
            replace(record, channels={**record.channels, one.channel: np.ascontiguousarray(column)})
            for record, column in zip(records, columns_of, strict=True)
        ]
        return None if term is None else joint_fit(base, seen, (term,))

    found: list[Followed] = []
    for one, site in asked:
        if any(other.whole for other in found):
            break
        fit = fitted(one, site)
        if fit is not None:
            now = replace(one, mse=fit.mse, removed=nothing.mse - fit.mse, gain=site == "gain", whole=whole(fit))
            noise = fit.solution.noise_variance
            found.append(replace(now, moved=fit.moved, walked=fit.walked, noise_variance=noise))
    best = {one.channel: one for one in sorted(found, key=lambda one: -one.mse)}
    return sorted(best.values(), key=lambda one: one.mse)


def curve_sigma(records: Sequence[Record]) -> float:
    """One sigma of a free curve's heights: a share of the travel."""
    return HEIGHT * float(np.ptp(np.concatenate([record.d for record in records])))


def _slope(table: Table, record: Record, plain: Floats, sigma_mm: float) -> Floats:
    """Force per sigma of deformation (n,), at rest."""
    found = table.fit.solution
    by = PROBE * sigma_mm
    pushed = replace(record, d=record.d + by, before=record.before + by, kept=None)
    return (simulate(found.shape, found.point, pushed, record.known) - plain) / PROBE


def _hats(term: Term, column: Floats) -> Floats:
    """Basis (n, k) of the broken line of a free curve."""
    count = len(term.free)
    knots = term.effect.constants(term.effect.neutral(), 1.0)[:count]
    return np.column_stack([np.interp(column, knots, np.eye(count)[i]) for i in range(count)])
