"""The model artifact: JSON text <-> ModelSpec. Data only, schema-versioned, validated, with units in every key.

The linear block is stored in continuous time (time constants and gains), so that one artifact serves every sample
rate; `thrustd.model.compile` discretises it.
"""

from itertools import pairwise
from math import comb
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from thrustd.core.errors import ModelError

SCHEMA = "thrustd-model/1"
FORCE_RATE_TAU_S = 1.0  # of the force rate that chooses the region of an ErrorMap
MAX_BYTES = 4_000_000  # an artifact is a few kB; refuse what is clearly something else

Positive = Annotated[float, Meta(gt=0)]


class Struct(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Base of everything in an artifact: immutable, unknown keys are errors."""


class PiecewiseLinear(Struct, frozen=True, tag="piecewise_linear", tag_field="kind"):
    """Knots, x not decreasing; a repeated x is a jump. Beyond the ends the last segments continue."""

    x: Annotated[list[float], Meta(min_length=2, max_length=1000)]
    y: list[float]


class Polynomial(Struct, frozen=True, tag="polynomial", tag_field="kind"):
    """sum coefficients[i] z**i with z = (v - centre) / scale."""

    centre: float
    scale: Positive
    coefficients: Annotated[list[float], Meta(min_length=1, max_length=30)]


Curve = PiecewiseLinear | Polynomial


class RealMode(Struct, frozen=True):
    """gain / (tau_s s + 1)."""

    tau_s: Positive
    gain: float


class ComplexMode(Struct, frozen=True):
    """Real part of 2 * half-gain / (1 - s / p), p = -decay_1_s + j frequency_rad_s; unit DC gain before `gain`."""

    decay_1_s: Positive
    frequency_rad_s: Positive
    gain_re: float
    gain_im: float


class Feedback(Struct, frozen=True):
    """What drives the modes beside the input: `thrustd.model.feedback`.

    States in the order of the modes, real and imaginary part of a complex one, the input last; centre and scale of
    each. within: rows of a lower triangle W; nothing grows beyond |W z| = 1. into: per state, what each product of 2
    up to `degree` of them adds to its mode's input.
    """

    degree: Annotated[int, Meta(ge=2, le=5)]
    centre: Annotated[list[float], Meta(min_length=2, max_length=13)]
    scale: list[Positive]
    within: list[list[float]]
    into: list[list[float]]


class LinearBlock(Struct, frozen=True):
    """Output-error transfer function: direct + sum of modes. DC gain = direct + sum gain + sum gain_re."""

    direct: float
    real_modes: Annotated[list[RealMode], Meta(max_length=40)] = []
    complex_modes: Annotated[list[ComplexMode], Meta(max_length=20)] = []
    hold: Literal["foh", "zoh"] = "foh"
    feedback: Feedback | None = None


class EffectSpec(Struct, frozen=True):
    """A physical effect by name with its parameters (units in the keys) and their one-sigma uncertainty."""

    name: str
    parameters: dict[str, float]
    std: dict[str, float] = {}


class ValidRange(Struct, frozen=True):
    """Region of the identification data, [low, high] each."""

    deformation_mm: tuple[float, float]
    force_n: tuple[float, float]
    rate_mm_s: tuple[float, float] | None = None


class ErrorMap(Struct, frozen=True):
    """One sigma of the model on held-out data by region.

    force_edges_n (n+1,) and rate_edges_n_s (m+1,) bound the cells of std_n (n rows of m); outer cells extend outwards.
    The rate is the absolute value of the model's force rate, behind a first-order lag of `FORCE_RATE_TAU_S`: over less
    than that it is noise.
    """

    force_edges_n: Annotated[list[float], Meta(min_length=2)]
    rate_edges_n_s: Annotated[list[float], Meta(min_length=2)]
    std_n: list[list[float]]


class Witness(Struct, frozen=True):
    """A few rows of input and the output they must give, started at rest: proves a compiled model."""

    rate_hz: Positive
    inputs: dict[str, list[float]]  # by channel, `deformation_mm` first
    force_n: list[float]


class LedgerEntry(Struct, frozen=True):
    """One step of a model's history: what was added and what it did to the error on data not used for the fit."""

    added: str
    rmse_before_n: float
    rmse_after_n: float
    data: str = ""
    parent_sha256: str = ""


class Estimated(Struct, frozen=True):
    """An effect among the numbers of a posterior: what these are counted from and in (see the regression's terms)."""

    name: str
    fixed: dict[str, float]
    std: dict[str, float]
    centre: dict[str, float] = {}
    shapes: bool = True


class Posterior(Struct, frozen=True):
    """What the records said about the model: mean and information (inverse covariance) of every number.

    The numbers are those of the regression (`thrustd.identify.regression`), in units of output_scale: coefficients of
    the input spline, gains of the lags, of pole pairs, coefficients of the output spline, offset, weights of the stops,
    then those of the effects, without dimension. information: lower triangle, row by row.
    """

    input_grid: tuple[float, float, int]  # low, high (mm), coefficients
    zero_mm: float  # where the input curve is zero
    tau_s: list[float]
    output_scale: float  # N
    mean: list[float]
    information: list[float]
    noise_n: float  # level of the slow errors, made white, one sigma per independent sample
    rmse_n: float  # of the residual
    strengths: dict[str, float]  # precisions of the priors
    log_pole: list[tuple[float, float]] = []
    output_grid: tuple[float, float, int] | None = None
    hold: Literal["foh", "zoh"] = "foh"
    passive: bool = True
    finer_stops: int = 0  # than the usual ones
    effects: list[Estimated] = []
    lasting: tuple[float, float] | None = None  # of the noise: variance over that of the white part, time constant, s


class ModelSpec(Struct, frozen=True):
    """A mount model as data."""

    schema: Literal["thrustd-model/1"]
    name: Annotated[str, Meta(min_length=1, max_length=200)]
    structure: str  # e.g. "hw-pwl"
    input_curve: Curve
    linear: LinearBlock
    output_curve: Curve
    valid: ValidRange
    output_linear: LinearBlock | None = None  # behind the output curve: Wiener-Hammerstein
    effects: list[EffectSpec] = []
    error: ErrorMap | None = None
    provenance: dict[str, str | float | list[str]] = {}
    ledger: list[LedgerEntry] = []
    witness: Witness | None = None
    posterior: Posterior | None = None
    pressed_mm: float = 0.0  # deformation where its reading is 0: by the weight, of a mount as it flies


def read_model(text: str | bytes, where: str) -> ModelSpec:
    """Parse and validate an artifact; `where` names it in errors (ModelError)."""
    if len(text) > MAX_BYTES:
        raise ModelError(f"{where}: {len(text)} bytes, expected a model artifact of at most {MAX_BYTES}")
    try:
        spec = msgspec.json.decode(text, type=ModelSpec)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        cut = "Input data was truncated" in str(problem)
        said = "the file is truncated, it ends in the middle; expected a whole JSON object" if cut else problem
        raise ModelError(f"{where}: not a {SCHEMA} artifact: {said}") from None
    _check(spec, where)
    return spec


def write_model(spec: ModelSpec) -> str:
    """Artifact text, indented, keys in schema order."""
    return msgspec.json.format(msgspec.json.encode(spec), indent=1).decode() + "\n"


def _check(spec: ModelSpec, where: str) -> None:
    for field, curve in (("input_curve", spec.input_curve), ("output_curve", spec.output_curve)):
        if isinstance(curve, PiecewiseLinear):
            _check_knots(curve, f"{where}: {field}")
    for field, block in (("linear", spec.linear), ("output_linear", spec.output_linear)):
        if block is not None and block.feedback is not None:
            _check_feedback(block, block.feedback, f"{where}: {field}.feedback")
    for field, (low, high) in (
        ("deformation_mm", spec.valid.deformation_mm),
        ("force_n", spec.valid.force_n),
    ):
        if not low < high:
            raise ModelError(f"{where}: valid.{field}: [{low}, {high}], expected low < high")
    if spec.error is not None:
        _check_error_map(spec.error, f"{where}: error")
    if spec.witness is not None:
        _check_witness(spec.witness, f"{where}: witness")
    if spec.posterior is not None:
        _check_posterior(spec.posterior, f"{where}: posterior")


def _check_posterior(posterior: Posterior, where: str) -> None:
    n = len(posterior.mean)
    known = posterior.input_grid[2] + len(posterior.tau_s) + 2 * len(posterior.log_pole) + 1
    known += posterior.output_grid[2] if posterior.output_grid else 0
    if n < known:
        raise ModelError(f"{where}.mean: {n} numbers, expected at least {known}")
    if len(posterior.information) != n * (n + 1) // 2:
        raise ModelError(f"{where}.information: {len(posterior.information)} numbers, expected {n * (n + 1) // 2}")
    if posterior.lasting is not None and not (posterior.lasting[0] >= 0.0 and posterior.lasting[1] > 0.0):
        raise ModelError(f"{where}.lasting: {posterior.lasting}, expected a ratio of at least 0 and a time above 0 s")


def _check_knots(curve: PiecewiseLinear, where: str) -> None:
    if len(curve.x) != len(curve.y):
        raise ModelError(f"{where}: {len(curve.x)} x and {len(curve.y)} y, expected as many")
    if any(later < earlier for earlier, later in pairwise(curve.x)) or curve.x[0] == curve.x[-1]:
        raise ModelError(f"{where}.x: knots {curve.x}, expected increasing values (a repeated one is a jump)")


def _check_feedback(block: LinearBlock, feedback: Feedback, where: str) -> None:
    n = len(block.real_modes) + 2 * len(block.complex_modes)
    if not len(feedback.centre) == len(feedback.scale) == n + 1:
        raise ModelError(f"{where}: expected {n + 1} values of centre and of scale, one per state and the input's")
    if [len(row) for row in feedback.within] != [n + 1] * (n + 1):
        raise ModelError(f"{where}.within: expected {n + 1} rows of {n + 1} values")
    m = comb(n + 1 + feedback.degree, feedback.degree) - n - 2
    if len(feedback.into) != n or any(len(row) != m for row in feedback.into):
        raise ModelError(f"{where}.into: expected {n} rows (states) of {m} values (products)")


def _check_error_map(error: ErrorMap, where: str) -> None:
    n, m = len(error.force_edges_n) - 1, len(error.rate_edges_n_s) - 1
    if len(error.std_n) != n or any(len(row) != m for row in error.std_n):
        raise ModelError(f"{where}.std_n: expected {n} rows (force) of {m} values (rate)")
    if any(value <= 0 for row in error.std_n for value in row):
        raise ModelError(f"{where}.std_n: every one-sigma must be positive")
    for field, edges in (("force_edges_n", error.force_edges_n), ("rate_edges_n_s", error.rate_edges_n_s)):
        if any(later <= earlier for earlier, later in pairwise(edges)):
            raise ModelError(f"{where}.{field}: {edges}, expected increasing values")


def _check_witness(witness: Witness, where: str) -> None:
    lengths = {len(rows) for rows in witness.inputs.values()} | {len(witness.force_n)}
    if lengths != {len(witness.force_n)} or not witness.force_n or "deformation_mm" not in witness.inputs:
        raise ModelError(f"{where}: expected deformation_mm and force_n, all channels of one length")
