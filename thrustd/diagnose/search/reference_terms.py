"""What a brochure may be wrong by, in the same regression as the model: no load cell flies.

    reference = thrust share + s F + l dF/dt + d F (t - mean) + b + H sum c_ij x^i v^j     i + j <= 2
    H = delta_t G h,   h = x + r v sqrt(h),   x = F / (delta_t G),   v = u / 0.5,   u = M / sqrt(1 + 0.2 M^2)

F: the model's own output as it stands, so that the reference's noise does not explain itself; G the largest
corrected thrust; H the gross thrust: the net one and the ram drag of its air, r v sqrt(h), as air flow goes with the
root of gross thrust. A cycle is wrong by a part of its gross thrust. So a deck is much better known at idle than at
cruise, while a nacelle drags alike: fast flight at idle tells them apart. Every number has a prior: an engine is
3 % off its deck (with the share, 1 %), each coefficient of its surface by SHAPE, which makes 3 % of the net thrust in
cruise, a deck's time lags half a second, an engine drifts by 0.4 % an hour, at idle net thrust is 25 N uncertain. They
are nobody's effects: reports and models leave them out.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from thrustd.core.atmosphere import stagnation, total_pressure_ratio
from thrustd.diagnose.compare.reference import BROCHURE_MARK
from thrustd.identify.regression.terms import Term, at_start
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

REFERENCE_OF = "reference: "
MARK = BROCHURE_MARK
SHAPE = 0.01  # of gross thrust
POWERS = [(i, j) for i in range(3) for j in range(3 - i)]  # of x and v
PRIORS = {"scale": 0.0316, "lead": 0.5, "drift": 0.004, "idle": 25.0} | {f"x{i} v{j}": SHAPE for i, j in POWERS}
FAST = 0.5  # of u
RAM = FAST * 340.3 / 316.0  # r: speed of sound over static thrust per air flow, m/s (JT15D-4: 11.12 kN of 35.2 kg/s)
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
        ram = 0.5 * RAM * v
        gross = delta * largest * (ram + np.sqrt(ram**2 + np.maximum(x, 0.0))) ** 2
        columns = {
            "scale": force,
            "lead": np.gradient(_smooth(force, LAG_S / step_s), step_s),
            "drift": force * (hours - hours[-1] / 2),
            "idle": np.ones(len(force)),
        } | {f"x{i} v{j}": gross * x**i * v**j for i, j in POWERS}
        found.append({f"{REFERENCE_OF}{name}": np.ascontiguousarray(column) for name, column in columns.items()})
    return found


def _air(given: Mapping[str, Floats], n: int) -> tuple[Floats, Floats]:
    """delta_t and v (n,); without air data as on the ground."""
    mach, altitude_m = (given.get(name, np.zeros(n)) for name in ("mach", "pressure_altitude_m"))
    delta = np.asarray(total_pressure_ratio(mach, altitude_m))
    return delta, np.asarray(mach / np.sqrt(stagnation(mach)) / FAST)


def _smooth(column: Floats, samples: float) -> Floats:
    """Means over an odd number of samples, the ends held."""
    half = max(round(samples / 2), 0)
    wide = np.concatenate((np.full(half, column[0]), column, np.full(half, column[-1])))
    return np.asarray(np.convolve(wide, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid"))
