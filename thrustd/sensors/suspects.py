"""Since when each engine's fault has been the likeliest: it is named when its sensor's own watch has seen enough of it.

A fault is excluded at once; a noisy sensor, which also jumps, is known by its own watch after NAMED_AFTER_S.
"""

from thrustd.core.columns import Floats, Integers
from thrustd.fusion.mixture import P
from thrustd.sensors.onsets import WELL

NAMED_AFTER_S = 1.4


class Suspects:
    """Mutable, by engine."""

    def __init__(self, found: Integers) -> None:
        """`found`: the hypothesis that leads."""
        self._which: list[int] = found.tolist()  # the one that was found, else the likeliest
        self._since_ns = [0] * len(found)

    def look(self, t_ns: int, found: Integers, hypotheses: Floats) -> None:
        """`hypotheses` (n, N_HYPOTHESES, 3): what the bank says."""
        likeliest = hypotheses[:, :, P].argmax(axis=1).tolist()
        for engine, leads in enumerate(found.tolist()):
            which = likeliest[engine] if leads == WELL else leads
            if which != self._which[engine]:
                self._which[engine], self._since_ns[engine] = which, t_ns

    def nameable(self, t_ns: int, found: Integers) -> list[int]:
        """By engine, the hypothesis that was found and has been suspected for long enough; else WELL."""
        return [
            leads if t_ns - since_ns >= NAMED_AFTER_S * 1e9 else WELL
            for leads, since_ns in zip(found.tolist(), self._since_ns, strict=True)
        ]
