"""What a brochure may be wrong by, in the same regression as the model: no load cell flies.

    reference = thrust share + s F + l dF/dt + c F (F / F_max - 1/2) + m F (Mach - mean) + d F (t - mean) / h + b

F: the model's own output as it stands, so that the reference's noise does not explain itself. Every number has a prior:
an engine is 3 % off its deck (with the share, 1 %), a deck's time lags half a second, its shape errs by 2 % over power
and over 0.2 Mach, an engine drifts by 0.4 % an hour, at idle net thrust is 25 N uncertain. They are nobody's effects:
reports and models leave them out.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from thrustd.diagnose.compare.reference import BROCHURE_MARK
from thrustd.identify.regression.terms import Term, at_start
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

REFERENCE_OF = "reference: "
MARK = BROCHURE_MARK
PRIORS = {"scale": 0.0316, "lead": 0.5, "power": 0.04, "mach": 0.1, "drift": 0.004, "idle": 25.0}
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
    largest = max(float(np.nanmax(np.abs(force))) for force in model_n)
    mach = [given.get("mach", np.zeros(len(force))) for given, force in zip(inputs, model_n, strict=True)]
    middle = float(np.mean(np.concatenate(mach)))
    found = []
    for force, speed, step_s in zip(model_n, mach, dt_s, strict=True):
        hours = np.arange(len(force)) * step_s / 3600
        columns = {
            "scale": force,
            "lead": np.gradient(_smooth(force, LAG_S / step_s), step_s),
            "power": force * (force / largest - 0.5),
            "mach": force * (speed - middle),
            "drift": force * (hours - hours[-1] / 2),
            "idle": np.ones(len(force)),
        }
        found.append({f"{REFERENCE_OF}{name}": np.ascontiguousarray(column) for name, column in columns.items()})
    return found


def _smooth(column: Floats, samples: float) -> Floats:
    """Means over an odd number of samples, the ends held."""
    half = max(round(samples / 2), 0)
    wide = np.concatenate((np.full(half, column[0]), column, np.full(half, column[-1])))
    return np.asarray(np.convolve(wide, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid"))
