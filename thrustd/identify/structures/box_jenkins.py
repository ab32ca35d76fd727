"""Box-Jenkins: y = B/F u + C/D e. Output error first, an autoregressive model of what it leaves (D, C = 1), then output
error again on data filtered with D, which whitens the residual (generalised least squares, Clarke 1967). Where D
leaves so little of slow modes that the filtered data no longer show them, the first B/F stays."""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.identify.sensitivity import residuals
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, error_over, of_spec
from thrustd.model.artifact import ModelSpec, PiecewiseLinear

NOISE_LAGS = 4
LOST = 1.5  # free-run error of the second model over that of the first, from which on slow modes are lost
LINEAR = Asked("line", "line", order=2)


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    first = fits.of(segments, LINEAR, progress)
    whitener = _whitener([residuals(first.spec, s) for s in segments])
    second = fits.of([_filtered(s, whitener) for s in segments], LINEAR, progress)
    spec = _with_level(second.spec, segments)
    if error_over(spec, segments) > LOST * error_over(first.spec, segments):
        spec = first.spec
    named = msgspec.structs.replace(spec, structure="box-jenkins")
    return of_spec(named, second.n_parameters + NOISE_LAGS)


def _whitener(parts: Sequence[Floats]) -> Floats:
    """D(q) = 1 - d_1 q^-1 - ... by least squares on the residual."""
    tables, targets = [], []
    for residual in parts:
        r = np.nan_to_num(residual)
        columns = [r[NOISE_LAGS - k : len(r) - k] for k in range(1, NOISE_LAGS + 1)]
        tables.append(np.column_stack(columns))
        targets.append(r[NOISE_LAGS:])
    d = np.linalg.lstsq(np.concatenate(tables), np.concatenate(targets), rcond=1e-10)[0]
    return np.concatenate(([1.0], -d))


def _filtered(segment: Segment, whitener: Floats) -> Segment:
    keep = len(whitener) - 1
    u = lfilter(whitener, [1.0], segment.inputs[DEFORMATION])[keep:]
    return replace(segment, inputs={DEFORMATION: u}, force_n=lfilter(whitener, [1.0], segment.force_n)[keep:])


def _with_level(spec: ModelSpec, segments: Sequence[Segment]) -> ModelSpec:
    """The straight output curve with the offset that suits the unfiltered data."""
    fitted = of_spec(spec, 0)
    level = float(np.nanmean(np.concatenate([s.force_n - fitted.simulate(s) for s in segments])))
    curve = spec.output_curve
    assert isinstance(curve, PiecewiseLinear)
    return msgspec.structs.replace(spec, output_curve=PiecewiseLinear(curve.x, [y + level for y in curve.y]))


STRUCTURES = (Structure("box-jenkins", "Box-Jenkins 2/2, AR 4", "linear", _fit),)
