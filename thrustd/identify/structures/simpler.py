"""How much structure records bear: a structure, or a simpler one that it contains.

Every member of the block-oriented family is the next with a curve held smoother or straight, or with a shorter linear
block. A thousand samples follow six modes between two curves of ten segments closely and then predict others badly; and
where a simpler one follows the very data better, the search for the other ended in a worse minimum. So smooth curves
are fitted at every order, free knots at the best of these, and Schwarz' criterion chooses,

    n' ln(mse) + p ln n',   mse of the free run from the state that the first stretch of every segment shows,

where n' is the number of samples of a white residual that would tell as much as the residual of the best of them does:
what stays for minutes counts once. (Of twelve rules, held-back blocks among them, on 26 pairs of records this one came
nearest to the best that unseen records would have chosen; see the identification page.)
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.identify.hw_fit import HwSettings, Progress
from thrustd.identify.hw_problem import slow_variance
from thrustd.identify.hw_shapes import Shape
from thrustd.identify.segments import Segment, tail
from thrustd.identify.structures.block_fits import BlockFits, Judged
from thrustd.identify.structures.structure import error_from_past, missed_from_past, schwarz
from thrustd.model.artifact import ModelSpec

SHORT = 8_000  # samples: longer records bear what is asked for, and are compared with what was fitted to them already
ORDERS = (2, 3, 4)  # of the linear block, those below the wanted one
SHAPES: tuple[Shape, ...] = ("line", "cubic", "pwl")  # each contains those before it


def best_of(
    segments: Sequence[Segment], wanted: HwSettings, fits: BlockFits, progress: Progress | None = None
) -> HwSettings:
    """What is wanted, or what it contains, whichever these records speak for."""
    family, made = _within(wanted), fits.made(segments).fits
    if sum(map(len, segments)) > SHORT:
        return _best([wanted, *(settings for settings in family if settings in made)], segments, fits, progress)
    smooth = [s for s in family if "pwl" not in (s.input_shape, s.output_shape)]
    order = _best(smooth, segments, fits, progress).order
    free = [s for s in family if s not in smooth and s.order == order]
    return _best([*smooth, *free], segments, fits, progress)


def _best(
    family: Sequence[HwSettings], segments: Sequence[Segment], fits: BlockFits, progress: Progress | None
) -> HwSettings:
    known = fits.made(segments).judged
    for settings in family:
        if settings not in known:
            found = fits.of(segments, settings, progress)
            known[settings] = judged(found.spec, found.n_parameters, segments)
    return family[least([known[settings] for settings in family])]


def judged(spec: ModelSpec, n_parameters: int, segments: Sequence[Segment]) -> Judged:
    """How a model follows the records that it was fitted to."""
    missed = missed_from_past(spec, segments)
    with np.errstate(all="ignore"):
        mse, slow = float(np.mean(missed**2)), slow_variance(missed)
    return Judged(mse, slow, len(missed), n_parameters) if np.isfinite(mse) else Judged(np.inf, np.inf, 1, n_parameters)


def restarted(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    """Error of the free run when begun anew a quarter or half into every segment, as on another record; the worse."""
    return max(error_from_past(spec, [tail(s, len(s) // part) for s in segments]) for part in (4, 2))


def least(candidates: Sequence[Judged]) -> int:
    """Place of the one with the least of Schwarz' criterion."""
    closest = min(candidates, key=lambda candidate: candidate.mse)
    told = closest.samples * closest.mse / closest.slow if 0 < closest.mse < np.inf else closest.samples
    return int(np.argmin([schwarz(float(np.sqrt(c.mse)), told, c.n_parameters) for c in candidates]))


def _within(wanted: HwSettings) -> list[HwSettings]:
    """What the settings contain, the simplest first, themselves the last."""
    first, second = (SHAPES[: SHAPES.index(shape) + 1] for shape in (wanted.input_shape, wanted.output_shape))
    orders = [*(order for order in ORDERS if order < wanted.order), wanted.order]
    pairs = [(f, h) for f in first for h in second if {f, h} != {"cubic", "pwl"}]
    return [replace(wanted, order=n, input_shape=f, output_shape=h) for n in orders for f, h in pairs]


def words(settings: HwSettings) -> str:
    """`order 4, cubic - line`."""
    return f"order {settings.order}, {settings.input_shape} - {settings.output_shape}"
