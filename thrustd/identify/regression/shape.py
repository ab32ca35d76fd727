"""What is estimated, and how it lies in one vector: the fixed side of a regression (`Shape`), its numbers (`Point`)."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.curve import Grid, roughness
from thrustd.identify.regression.kernel import Core, Lags
from thrustd.identify.regression.terms import Term, branches, positives
from thrustd.model.linear import discretise_mode

Hold = Literal["foh", "zoh"]
SPECTRUM = 6  # amplitudes of one effect from which on they are a spectrum
TURN = 1e-5  # of the logarithm of a pole: step of the differences that give its derivative


@dataclass(frozen=True, slots=True)
class Shape:
    """Grids, time constants and constraints. Output in units of `output_scale`, so that priors have no dimension."""

    f_grid: Grid
    zero: float  # input at which f is zero
    taus_s: Floats  # (m,) where the real lags begin
    radii: Floats  # (n_stops,)
    output_scale: float
    h_grid: Grid | None = None
    poles: Floats = field(default_factory=lambda: np.zeros((0, 2)))  # (p, 2) logarithms of decay and frequency, 1/s
    hold: Hold = "foh"
    passive: bool = True  # gains of relaxation cannot be negative: rubber gives back less than it was given
    move: bool = False  # poles may leave their places
    line: bool = False  # f is a straight line
    terms: tuple[Term, ...] = ()  # physical effects beside the core
    h_straight_from: float = -np.inf  # above this x h has no straight part of its own: that is the scale of f
    limits_s: tuple[float, float] = (0.0, np.inf)  # of time constants that move: faster or slower is not in the data
    grows: bool = False  # friction with the deformation
    begun: int = 0  # records, those with a place, whose lags and pairs do not begin settled, but anywhere
    stood: tuple[int, ...] = ()  # samples for which the first load of each record has been there before it, after none
    zero_std: float = np.inf  # one sigma of the offset where it is known from other records
    sizes: dict[str, int] = field(init=False, repr=False, compare=False)  # numbers per group, in the vector's order
    _parts: dict[str, slice] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        sizes = self._sizes()
        ends = np.cumsum([0, *sizes.values()]).tolist()
        object.__setattr__(self, "sizes", sizes)
        object.__setattr__(self, "_parts", {name: slice(*ends[i : i + 2]) for i, name in enumerate(sizes)})

    def _sizes(self) -> dict[str, int]:
        m, p = len(self.taus_s), len(self.poles)
        return {
            "f": self.f_grid.n,
            "gain": m,
            "log_tau": m if self.move else 0,
            "pair_gain": 2 * p,
            "log_pole": 2 * p if self.move else 0,
            "h": self.h_grid.n if self.h_grid else 0,
            "offset": 1,
            "growth": int(self.grows),
            "stops": len(self.radii),
            "terms": sum(len(term.free) for term in self.terms),
            "begin": self.begun * (m + 2 * p),
        }

    def parts(self) -> dict[str, slice]:
        """Where each group lies in the vector."""
        return self._parts

    def spectra(self) -> dict[str, slice]:
        """Terms of many amplitudes, whose common size the data tell."""
        begin, found = self.parts()["terms"].start, {}
        for term in self.terms:
            if sum(p.amplitude for p in term.free) >= SPECTRUM and not (term.known or term.sized):
                found[term.effect.name] = slice(begin, begin + len(term.free))
            begin += len(term.free)
        return found

    @property
    def n(self) -> int:
        return sum(self.sizes.values())

    @property
    def n_core(self) -> int:
        """Columns of the core."""
        return self.parts()["offset"].start

    def own_columns(self, n_lags: int) -> NDArray[np.bool_]:
        """Which of the kernel's columns are the core's, when it runs with n_lags real lags."""
        n, m, each = self.f_grid.n, len(self.taus_s), 2 if self.move else 1
        mask = np.ones(self.n_core + each * (n_lags - m), bool)
        for k in range(each):
            mask[n + k * n_lags + m : n + (k + 1) * n_lags] = False
        return mask

    def positive(self) -> NDArray[np.bool_]:
        """Which numbers cannot be negative (n,)."""
        mask = np.zeros(self.n, bool)
        mask[self.parts()["growth"]] = mask[self.parts()["stops"]] = True
        if self.passive:
            mask[self.parts()["gain"]] = True
        mask[self.parts()["terms"]] = positives(self.terms)
        return mask

    def reach(self, vector: Floats) -> tuple[Floats, Floats]:
        """Where each number (n,) may move to in one step: a shape by one sigma of its prior, there slopes change.

        A zero as well, or it takes at once what an effect explains that has hardly begun. Nothing goes through a wall.
        """
        reach, where = np.full(self.n, np.inf), self.parts()
        reach[where["offset"]] = self.zero_std
        reach[where["terms"]] = [np.inf if p.amplitude else 1.0 for term in self.terms for p in term.free]
        low, high = vector - reach, vector + reach
        walls = np.concatenate([np.empty((0, 2)), *(term.walls() for term in self.terms)])
        low[where["terms"]] = np.maximum(low[where["terms"]], walls[:, 0])
        high[where["terms"]] = np.minimum(high[where["terms"]], walls[:, 1])
        return low, high

    def prior_matrix(self, name: str) -> Floats:
        """Of one group, for precision 1."""
        size = self.sizes[name]
        if name in ("f", "h"):
            return roughness(size)
        if name == "gain" and self.passive:
            return _smooth(size)
        return np.eye(size)


def _smooth(size: int) -> Floats:
    """Of a spectrum of relaxation: it walks from one time constant to the next, so what the data leave open goes on as
    what they tell. The fastest stands for all that is faster.

    Its whole level is known as little as `size` steps make it.
    """
    steps = np.diff(np.eye(size)[1:], axis=0)
    found: Floats = steps.T @ steps + np.eye(size) / size**2
    return found


@dataclass(frozen=True, slots=True)
class Point:
    """Numbers of one model, in units of the shape's output scale."""

    f: Floats
    gain: Floats
    log_tau: Floats  # (m,) always all of them
    pair_gain: Floats  # (p, 2)
    log_pole: Floats  # (p, 2)
    h: Floats
    offset: float
    stops: Floats
    terms: Floats  # numbers without dimension, see `terms`
    growth: Floats = field(default_factory=lambda: np.zeros(0))  # (1,) of friction, per largest radius
    begin: Floats = field(default_factory=lambda: np.zeros(0))  # (begun * (m + 2 p),) memory at first, less settled

    def vector(self, shape: Shape) -> Floats:
        moved = (self.log_tau, self.log_pole.ravel()) if shape.move else ((), ())
        parts = (self.f, self.gain, moved[0], self.pair_gain.ravel(), moved[1], self.h, [self.offset])
        rest = (self.growth if shape.grows else (), self.stops, self.terms, self.begin)
        return np.concatenate([np.asarray(part, float) for part in (*parts, *rest)])

    def at(self, shape: Shape, vector: Floats) -> "Point":
        part = {name: vector[where] for name, where in shape.parts().items()}
        moved: dict[str, Any] = {}
        if shape.move:
            with np.errstate(divide="ignore"):
                within = np.clip(part["log_tau"], *np.log(shape.limits_s))
            moved = {"log_tau": within, "log_pole": part["log_pole"].reshape(-1, 2)}
        return replace(
            self,
            f=part["f"],
            gain=part["gain"],
            pair_gain=part["pair_gain"].reshape(-1, 2),
            h=part["h"],
            offset=float(part["offset"][0]),
            growth=part["growth"],
            stops=part["stops"],
            terms=part["terms"],
            begin=part["begin"],
            **moved,
        )


def core_of(shape: Shape, point: Point, dt_s: float) -> Core:
    """The kernel's numbers at one sample period; branches of effects lie behind the lags of the core."""
    grid, h_grid = shape.f_grid, shape.h_grid
    added = branches(shape.terms, point.terms)
    logs = np.concatenate((point.log_tau, [np.log(tau_s) for tau_s, _ in added]))
    lag = np.array([discretise_mode(complex(-np.exp(-log)), dt_s, shape.hold) for log in logs])
    up, down = (
        np.array([discretise_mode(complex(-np.exp(-log - turn)), dt_s, shape.hold) for log in logs])
        for turn in (TURN, -TURN)
    )
    pair, turned = _pairs(point.log_pole, dt_s, shape.hold)
    return Core(
        point.f,
        grid.values(np.array([shape.zero]))[0],
        np.array([grid.low, grid.step]),
        Lags(
            np.concatenate((point.gain, [gain for _, gain in added])),
            np.ascontiguousarray(lag.real).reshape(-1, 3),
            np.ascontiguousarray((up - down).real / (2 * TURN)).reshape(-1, 1, 3),
        ),
        Lags(point.pair_gain.reshape(-1, 2) @ (1.0, 1.0j), pair, turned),
        point.h,
        np.array([h_grid.low, h_grid.step] if h_grid else [0.0, 1.0]),
        shape.move,
    )


def _pairs(log_pole: Floats, dt_s: float, hold: str) -> tuple[Any, Any]:
    def discrete(logs: Floats) -> Any:
        return np.array(discretise_mode(complex(-np.exp(logs[0]), np.exp(logs[1])), dt_s, hold), complex)

    pair = np.array([discrete(logs) for logs in log_pole]).reshape(-1, 3).astype(complex)
    turned = [
        [(discrete(logs + TURN * side) - discrete(logs - TURN * side)) / (2 * TURN) for side in np.eye(2)]
        for logs in log_pole
    ]
    return pair, np.array(turned).reshape(-1, 2, 3).astype(complex)
