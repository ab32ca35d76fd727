"""Parameter covariance with coloured residuals.

Residuals of a mount model are correlated over minutes, so the textbook sigma^2 (J'J)^-1 is far too small. Klein &
Morelli (Aircraft System Identification, AIAA 2006, section 5.3.3; Morelli & Klein, J. Aircraft 34(3), 1997):

    cov = M^-1 [ sum_i sum_j s_i R(i - j) s_j' ] M^-1,   M = sum s_i s_i',   R = autocorrelation of the residual

The double sum is taken on means over `n` consecutive samples (few thousand rows, products by FFT); what varies inside
a mean is treated as white. R is tapered to zero (Bartlett) over a tenth of the record, which keeps the sum positive.
"""

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import ModelError

ROWS = 20_000  # means kept at most
TAPER = 0.1  # of the record


def coloured(residual: Floats, columns: Floats) -> Floats:
    """Covariance (p, p) of parameters with this residual (n,), NaN without weight, and sensitivities columns (n, p),
    which are zero afterwards where it is NaN: a copy of so much costs as much again.
    """
    there = np.isfinite(residual)
    kept = np.where(there, residual, 0.0)
    columns[~there] = 0.0
    width = max(1, -(-len(kept) // ROWS))
    white = 0.0 if width == 1 else float(kept @ kept) / max(1, int(there.sum())) / width
    m = len(kept) // width * width
    means, missed = (v[:m].reshape(-1, width, *v.shape[1:]).mean(axis=1) for v in (columns, kept))
    return covariance(columns.T @ columns, width**2 * _middle(means, missed), white)


def _middle(sensitivity: Floats, residual: Floats) -> Floats:
    """sum_i sum_j s_i R(i - j) s_j' (p, p) of sensitivities (n, p)."""
    n = len(residual)
    size = 1 << (2 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(residual, size)) ** 2
    correlation = np.fft.irfft(power, size)[:n] / n
    span = max(2, int(TAPER * n))
    kernel = np.zeros(size)
    kernel[:span] = correlation[:span] * (1 - np.arange(span) / span)
    kernel[-span + 1 :] = kernel[1:span][::-1]
    spectrum = np.maximum(np.fft.rfft(kernel).real, 0.0)
    smooth = np.empty_like(sensitivity)
    for i in range(sensitivity.shape[1]):
        smooth[:, i] = np.fft.irfft(np.fft.rfft(sensitivity[:, i], size) * spectrum, size)[:n]
    product = sensitivity.T @ smooth
    return np.asarray((product + product.T) / 2, float)


def covariance(information: Floats, middle: Floats, white_variance: float) -> Floats:
    """M^-1 (B + white M) M^-1; directions that the data do not determine are left out (pseudo-inverse).

    ModelError when the sensitivities are no numbers: a formula that overflows, say.
    """
    if not (np.isfinite(information).all() and np.isfinite(middle).all()):
        raise ModelError(
            "the model's sensitivity to its parameters is not finite: expected a formula that stays in range"
        )
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scale = np.outer(size, size)  # to unit diagonal first: parameters differ by many orders of magnitude
    unit = information / scale
    inverse = np.linalg.pinv(unit, rcond=1e-10, hermitian=True)
    with np.errstate(over="ignore"):  # infinite: the data say nothing about it
        return np.asarray(inverse @ (middle / scale + white_variance * unit) @ inverse / scale, float)
