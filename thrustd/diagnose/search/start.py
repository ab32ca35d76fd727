"""What an unknown state at the start of a recording may add to the force, and how to keep it out of the evidence.

A model starts settled on its first sample; the mount it models was at work before the record began. So each slow mode
i adds a_i exp(-t / tau_i) with an unknown a_i, which cannot be larger than the mode itself: a_i ~ N(0, (g_i F)^2), g_i
its gain and F the spread of the force. With the columns S = [g_i F exp(-t / tau_i)] / sigma = U diag(s) V' the
residual has covariance sigma^2 (I + S S'); multiplying everything by its inverse root

    W = I - U diag(1 - 1 / sqrt(1 + s^2)) U'

turns least squares on it into what the Gaussian model asks for (generalised least squares), and
U diag(s^2 / (1 + s^2)) U' r is the most likely contribution of the start. sigma is the model's error, counted once
per `INDEPENDENT_S`.
"""

from dataclasses import dataclass

import numpy as np

from thrustd.core.measures import rms
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.expected import own_error_n
from thrustd.model.artifact import ModelSpec
from thrustd.model.stage import Floats

LEAST_GAIN = 1e-3  # modes weaker than this share of the force start as they like
SEGMENTS = 4  # the longest ones; the start of a short stretch weighs little
INDEPENDENT_S = 60.0  # residuals of a mount are correlated over about a minute


@dataclass(frozen=True, slots=True)
class Start:
    """Orthonormal basis (n, k) of what the start may add, zero on rows without reference, and s (k,)."""

    basis: Floats
    strength: Floats

    @property
    def shrink(self) -> Floats:
        """1 - 1 / sqrt(1 + s^2) (k,)."""
        shrink: Floats = 1.0 - 1.0 / np.sqrt(1.0 + self.strength**2)
        return shrink

    def without(self, columns: Floats) -> Floats:
        """W columns, (n,) or (n, q), finite."""
        if not self.strength.size:
            return columns
        inside = (self.basis.T @ columns).T * self.shrink
        rest: Floats = columns - self.basis @ inside.T
        return rest

    def likely(self, residual: Floats) -> Floats:
        """Most likely contribution of the start to a residual (n,), NaN where there is no reference."""
        inside = self.basis.T @ np.nan_to_num(residual)
        found: Floats = self.basis @ (inside * self.strength**2 / (1.0 + self.strength**2))
        return found


def start_of(spec: ModelSpec, evidence: Evidence) -> Start:
    """What the slow modes of this model may do at the start of the longest segments."""
    good = np.isfinite(evidence.reference_n)
    columns = _columns(spec, evidence)
    if not columns:
        return Start(np.empty((len(good), 0)), np.empty(0))
    output_n = evidence.output(spec)
    own_n = own_error_n(spec, evidence, output_n) or rms(evidence.reference_n - output_n)
    sigma = max(own_n, 1e-9) * max(1.0, INDEPENDENT_S / evidence.row_s) ** 0.5
    scaled = np.column_stack(columns) * good[:, None] * float(np.nanstd(evidence.reference_n)) / sigma
    left, strength, _ = np.linalg.svd(scaled, full_matrices=False)
    keep = strength > 1e-3
    return Start(left[:, keep], strength[keep])


def _columns(spec: ModelSpec, evidence: Evidence) -> list[Floats]:
    """Decays (n,) of the slow modes, times their gain; those slower than the record act as one."""
    columns = []
    slow = [m for m in spec.linear.real_modes if abs(m.gain) > LEAST_GAIN and m.tau_s > 5 * evidence.row_s]
    for i in np.argsort([-len(segment) for segment in evidence.segments])[:SEGMENTS]:
        segment = evidence.segments[i]
        mine = evidence.segment == i
        since_s = np.where(mine, evidence.time_s - segment.start_s, 0.0)
        whole_s = len(segment) * segment.dt_s
        decays = [(m.tau_s, m.gain * mine * np.exp(-np.minimum(since_s / m.tau_s, 50.0))) for m in slow]
        columns += [decay for tau_s, decay in decays if tau_s < whole_s]
        slowest = [np.abs(decay) for tau_s, decay in decays if tau_s >= whole_s]
        columns += [np.sum(slowest, axis=0)] if slowest else []
    return columns
