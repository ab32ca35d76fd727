"""What the pictures of a comparison show, as numbers: the PNG files and the workbench draw the same."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import coherence, welch

from thrustd.core.columns import Floats
from thrustd.core.measures import FULL_N, order_of
from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.regions import force_rate
from thrustd.diagnose.search.candidates import moves
from thrustd.diagnose.search.dependence import Dependence, drawn

LONGEST = 1 << 14  # samples of one stretch of the spectrum
LONGEST_COHERENCE = 1 << 12
AVERAGED = 16  # stretches at least, overlapping by half, behind a coherence: that of one stretch is 1 whatever it holds
SLOWEST_N_S = 5.0  # first edge of the rates above zero, for a mount of PH-LAB's loads
LOOP_DOTS = 40_000


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Amplitude density of the residual (k,), and by channel its coherence with the residual (m,): first the channels
    that go with most of the residual's power, `explained` each, 0 to 1.
    """

    frequency_hz: Floats
    residual_n_rthz: Floats  # N / sqrt(Hz)
    coherence_hz: Floats
    coherence: dict[str, Floats]
    explained: dict[str, float]


@dataclass(frozen=True, slots=True)
class RateMap:
    """RMS error by model force (n + 1 edges) and its absolute rate (m + 1 edges); NaN in cells without data."""

    force_edges_n: Floats
    rate_edges_n_s: Floats
    rms_n: Floats  # (n, m)


@dataclass(frozen=True, slots=True)
class Loop:
    """Force over deformation with its error, evenly thinned (k,)."""

    deformation_mm: Floats
    reference_n: Floats
    model_n: Floats
    residual_n: Floats
    limit_n: float  # of the colours: 98 % of the errors are smaller


def channel_dependences(c: Comparison) -> list[Dependence]:
    """Residual against every moving channel, the model's force and time."""
    columns = {n: w for n, w in c.channels.items() if moves(w)} | {"model force_N": c.model_n, "time_s": c.time_s}
    return [drawn(name, column, c.residual_n, c.rmse_n, c.rmse_n) for name, column in columns.items()]


def spectrum_of(c: Comparison) -> Spectrum:
    """Welch's averages; a missing reference counts as no error."""
    residual = np.where(np.isfinite(c.residual_n), c.residual_n, 0.0)
    rate_hz = 1.0 / float(np.median(np.diff(c.time_s)))
    length, short = min(len(residual), LONGEST), max(min(2 * len(residual) // (AVERAGED + 1), LONGEST_COHERENCE), 2)
    frequency, power = welch(residual, rate_hz, nperseg=length)
    at, weight = welch(residual, rate_hz, nperseg=short)
    columns = {name: column for name, column in c.channels.items() if moves(column)}
    shares = {name: coherence(residual, column, rate_hz, nperseg=short)[1][1:] for name, column in columns.items()}
    explained = {name: float(np.sum(share * weight[1:]) / np.sum(weight[1:])) for name, share in shares.items()}
    explained = dict(sorted(explained.items(), key=lambda item: -item[1]))
    by_share = {name: shares[name] for name in explained}
    return Spectrum(frequency[1:], np.sqrt(power[1:]), at[1:], by_share, explained)


def rate_map_of(c: Comparison) -> RateMap:
    rate = np.abs(force_rate(c.model_n, float(np.median(np.diff(c.time_s)))))
    good = np.isfinite(c.residual_n)
    force_edges = np.unique(np.quantile(c.model_n, np.linspace(0, 1, 13)))
    slowest = SLOWEST_N_S * order_of(float(np.quantile(np.abs(c.model_n), 0.999)), FULL_N)
    rate_edges = np.concatenate(([0.0], np.geomspace(slowest, max(2 * slowest, float(rate.max()) * 1.01), 9)))
    inside = (c.model_n[good], rate[good])
    total, _, _ = np.histogram2d(*inside, bins=(force_edges, rate_edges), weights=c.residual_n[good] ** 2)
    count, _, _ = np.histogram2d(*inside, bins=(force_edges, rate_edges))
    rms = np.sqrt(np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0))
    return RateMap(force_edges, rate_edges, rms)


def loop_of(c: Comparison, dots: int = LOOP_DOTS) -> Loop:
    step = max(1, len(c.time_s) // dots)
    limit = float(np.nanquantile(np.abs(c.residual_n), 0.98)) or 1.0
    return Loop(
        c.channels["deformation_mm"][::step], c.reference_n[::step], c.model_n[::step], c.residual_n[::step], limit
    )
