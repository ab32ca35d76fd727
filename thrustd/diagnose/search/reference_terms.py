"""What a brochure may be wrong by, in the same regression as the model: no load cell flies.

    reference = thrust share + s F + l dF/dt + d F (t - mean) + b + delta_t G sum c_ij x^i v^j     i + j <= 3, not x
    x = F / (delta_t G),   v = u / 0.5,   u = M / sqrt(1 + 0.2 M^2)

F: the model's own output as it stands, so that the reference's noise does not explain itself; G the largest corrected
thrust. The sum is the deck's own form (docs/fusion.md), for a surface errs as a surface. Every number has a prior: an
engine is 3 % off its deck (with the share, 1 %), each coefficient of its surface by SHAPE of G, which is the spread of
48 engine-flights, a deck's time lags half a second, an engine drifts by 0.4 % an hour, at idle net thrust is 25 N
uncertain. They are nobody's effects: reports and models leave them out.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from thrustd.core.atmosphere import total_pressure_ratio
from thrustd.diagnose.compare.reference import BROCHURE_MARK
from thrustd.identify.regression.terms import Term, at_start
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

REFERENCE_OF = "reference: "
MARK = BROCHURE_MARK
SHAPE = 0.026  # of the largest corrected thrust
POWERS = [(i, j) for i in range(4) for j in range(4 - i) if (i, j) != (1, 0)]  # of x and v; x alone is the scale
PRIORS = {"scale": 0.0316, "lead": 0.5, "drift": 0.004, "idle": 25.0} | {f"x{i} v{j}": SHAPE for i, j in POWERS}
FAST = 0.5  # of u
LAG_S = 1.0  # of the rate of force


@jit
def _step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    for i in range(c.size):
        v += c[i] * u[i]
    return v


def reference_term() -> Term:
    """One linear term; its columns are those of `reference_columns`."""
    effect = Effect(
        name=MARK,
        title="what the brochure is wrong by",
        site="force",
        channels=tuple(f"{REFERENCE_OF}{name}" for name in PRIORS),
        parameters=tuple(Parameter(name, "", 0.0, -1e12, 1e12, (1.0,), "") for name in PRIORS),
        step=_step,
        prepare=lambda p, dt_s: np.array([p[name] for name in PRIORS]),
        n_state=0,
        equation="",
        source="",
        separating_test="",
    )
    return at_start(effect, PRIORS, {})


def reference_columns(
    model_n: Sequence[Floats], inputs: Sequence[Mapping[str, Floats]], dt_s: Sequence[float]
) -> list[dict[str, Floats]]:
    """Columns of the term by segment, from the model's output over all of them."""
    airs = [_air(given, len(force)) for given, force in zip(inputs, model_n, strict=True)]
    largest = max(float(np.nanmax(np.abs(force / delta))) for force, (delta, _) in zip(model_n, airs, strict=True))
    found = []
    for force, (delta, v), step_s in zip(model_n, airs, dt_s, strict=True):
        hours = np.arange(len(force)) * step_s / 3600
        x = force / (delta * largest)
        columns = {
            "scale": force,
            "lead": np.gradient(_smooth(force, LAG_S / step_s), step_s),
            "drift": force * (hours - hours[-1] / 2),
            "idle": np.ones(len(force)),
        } | {f"x{i} v{j}": delta * largest * x**i * v**j for i, j in POWERS}
        found.append({f"{REFERENCE_OF}{name}": np.ascontiguousarray(column) for name, column in columns.items()})
    return found


def _air(given: Mapping[str, Floats], n: int) -> tuple[Floats, Floats]:
    """delta_t and v (n,); without air data as on the ground."""
    mach, altitude_m = (given.get(name, np.zeros(n)) for name in ("mach", "pressure_altitude_m"))
    delta = np.asarray(total_pressure_ratio(mach, altitude_m))
    return delta, np.asarray(mach / np.sqrt(1.0 + 0.2 * mach**2) / FAST)


def _smooth(column: Floats, samples: float) -> Floats:
    """Means over an odd number of samples, the ends held."""
    half = max(round(samples / 2), 0)
    wide = np.concatenate((np.full(half, column[0]), column, np.full(half, column[-1])))
    return np.asarray(np.convolve(wide, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid"))
