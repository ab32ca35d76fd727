"""Whether the aircraft flies a test point now, by the rule of `core.steady`: since when, and how long still."""

from math import nan

from thrustd.core.steady import SteadyLimits, SteadyWatch, quantities
from thrustd.core.types import Output, Reading

SECOND_NS = 1_000_000_000


def said(steady_s: float, due_s: float) -> str:
    """For a line that begins with "steady for"."""
    return f"{steady_s:.0f} s" + (f", a point in {due_s:.0f} s" if due_s > 0.0 else ": a test point")


class LivePoint:
    """A sink: hears readings, takes their means once a second of their own time."""

    def __init__(self, engines: int, limits: SteadyLimits | None = None) -> None:
        self.limits = limits or SteadyLimits()
        watched = quantities(self.limits, engines)
        self._places = {(one.channel, one.engine): place for place, one in enumerate(watched)}
        self._spools = [place for place, one in enumerate(watched) if one.channel == "n1_pct"]
        self._watch = SteadyWatch([one.limit for one in watched])
        self._sums = [0.0] * len(watched)
        self._counts = [0] * len(watched)
        self._due_ns = -1
        self.steady_s = 0  # whole seconds

    def write_output(self, output: Output) -> None:
        if output.t_ns >= self._due_ns:  # whatever it is: a bus that falls silent ends the point
            self._close(output.t_ns)
        if not isinstance(output, Reading):
            return
        place = self._places.get((output.signal, output.index))
        if place is not None and output.value == output.value:
            self._sums[place] += output.value
            self._counts[place] += 1

    def words(self) -> str:
        """For a status line; empty while nothing is steady."""
        return f"steady for {said(self.steady_s, self.due_s)}" if self.steady_s >= 5 else ""

    @property
    def due_s(self) -> float:
        """How long still until it is a test point."""
        return max(self.limits.least_s - self.steady_s, 0.0)

    def _close(self, t_ns: int) -> None:
        """The second that is over; one in which nothing was heard breaks the point."""
        if self._due_ns >= 0:
            means = [total / n if n else nan for total, n in zip(self._sums, self._counts, strict=True)]
            if any(not means[place] >= self.limits.least_n1_pct for place in self._spools):
                means = [nan] * len(means)
            self.steady_s = self._watch.take(means)
            if t_ns >= self._due_ns + SECOND_NS:
                self.steady_s = self._watch.take([nan] * len(means))
        self._sums = [0.0] * len(self._sums)
        self._counts = [0] * len(self._counts)
        self._due_ns = t_ns + SECOND_NS
