"""What a model already knows, as the prior of a joint regression: its core, its friction, the effects it carries.

An artifact of `identify` carries its posterior, or the bench's records are given; how far the reference walked there,
it may walk again. Any other model is asked: its own output over these records, with the error that it promises as
noise, is the record it was learnt from.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from thrustd.core.errors import ModelError
from thrustd.diagnose.search.evidence import simulate
from thrustd.identify.first_state import beginning_of
from thrustd.identify.regression.bounds import HOLDS
from thrustd.identify.regression.curve import travel
from thrustd.identify.regression.friction import effects_of, stretched
from thrustd.identify.regression.noise import Lasting
from thrustd.identify.regression.posterior import information_of, kept, lasting_of, point_of, shape_of, walk_n
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import KNOTS, in_its_noise, regress
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.table import FRICTION
from thrustd.identify.regression.terms import Term, at_start
from thrustd.identify.regression.walk import hours_of, is_walk, walks
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import EffectSpec, ModelSpec, Posterior
from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats, jit
from thrustd.records.roles import Roles

FOLLOWED = 0.3  # of the promised error: a mount without friction that yields follows a model's output so closely
FRICTIONLESS = 1e-3  # of the output's spread: friction that flies with no model
STATE_OF = "seconds since start "
NEVER_S = 1e15
STATE = 12.0**-0.5  # of its load, or of the spread: what a lag may be away from rest when a record begins
BEGUN_S, UNLOADED = 1.0, 0.02  # a record whose first second is below so much of that spread begins unloaded
OWN = Roles()
ZERO = 0.02  # of the output's spread: one sigma of the zero from one record to another
UNSURE = 0.02  # of the output's spread: error of a model that promises none
KNOWN = 0.1  # of its size: an effect that carries no sigma
SEARCHED = 24_000  # samples that count where a core is learnt from a model's output, and while sets are compared


@dataclass(frozen=True, slots=True)
class Base:
    """Shape and prior (mean point, information) of the core, and terms for the effects that the model has."""

    shape: Shape
    point: Point
    information: Floats  # (n, n)
    noise_variance: float  # in units of the shape's output scale
    promised: float | None  # rms of its residual at identification, the same units
    roles: Roles = OWN  # what the file calls and measures input and output in
    ours: bool = True  # a mount of PH-LAB's by its file, its load and its rig
    calibration: float = 0.0  # one sigma of the transducer's scale: no amplitude is known better
    as_is_mse: float = np.inf  # of the model itself on these records, its core as it is
    opposes: bool = False  # its force and that of these records pull opposite ways
    explained: float = 0.0  # mean square that the model's effects did when they were added
    own_mse: float = np.inf  # the same where no bench says how far its core may move
    own_plateau: float = np.inf  # and the fast end of what it leaves, see `plateau`
    least: float = 0.0  # what no function of the motion explains, once it was asked for (`unexplained`)
    lasting: Lasting | None = None  # of the noise, beside what is white
    tremble: float = 0.0  # mean square of the force of the reading's noise, without which a set was searched for

    @property
    def scale(self) -> float:
        return self.shape.output_scale

    @property
    def benched(self) -> bool:
        """Whether a bench says how core and reference were."""
        return bool(np.isinf(self.own_mse))


def plateau(residuals: Sequence[Floats], step_shares: Sequence[float]) -> float:
    """Rms of the noise of the instruments alone: by the steps of residuals, which show a share of it (`Grid`)."""
    squares = [np.diff(each) ** 2 / share for each, share in zip(residuals, step_shares, strict=True)]
    return float(np.sqrt(np.nanmean(np.concatenate(squares)) / 2.0))


def base_of(spec: ModelSpec, segments: Sequence[Segment], bench: Sequence[Segment] = ()) -> Base:
    """Prior of a joint regression on these segments; what lags remember where one begins under load is part of it."""
    if bench and learnt(spec) is not None:
        raise ModelError(f"{spec.name}: it carries what its own bench said; expected a model without, or no --bench")
    stored = _told_by(in_its_noise(regress(bench), bench)) if bench else learnt(spec)
    from_bench = stored is not None
    if stored is not None:
        scale = stored.output_scale
        bare = shape_of(stored), point_of(stored), information_of(stored)
        noise, promised = (stored.noise_n / scale) ** 2, stored.rmse_n / scale
        estimated = {FRICTION, *(effect.name for effect in stored.effects)}
        present = [effect for effect in spec.effects if effect.name not in estimated]
    else:
        core = msgspec.structs.replace(spec, effects=[], witness=None)
        every = -(-sum(map(len, segments)) // SEARCHED)
        told = [replace(s, force_n=thinned(simulate(core, s), every)) for s in segments]
        promised_n = _promised(spec, segments)
        found = regress(told, laws=(), settled=True)
        if np.sqrt(found.mean_square) * found.shape.output_scale > FOLLOWED * promised_n:  # its core rubs
            found = regress(told, loose=False, settled=True)
        stored, scale = kept(found), found.shape.output_scale
        promised = promised_n / scale
        noise = max(promised**2, every * found.noise_variance)
        doubt = _doubt(spec, segments, promised * scale, every) / scale**2
        known = found.noise_variance / max(doubt, found.noise_variance)
        bare = shape_of(stored), point_of(stored), information_of(stored) * known
        present = list(spec.effects)
    shape, point, information = _pruned(*bare)
    loaded = {k: _load(s, shape) for k, s in enumerate(segments) if not begins_unloaded(s, shape)}
    zero = ZERO if not loaded else walk_n(stored) / scale
    if from_bench and zero:
        shape, information = _zeroed(shape, information, zero)
    terms = [*map(_present, present), *walks(segments, walk_n(stored), sized=True), *_states(shape, point, loaded)]
    removed_n2 = sum(max(entry.rmse_before_n**2 - entry.rmse_after_n**2, 0.0) for entry in spec.ledger)
    lasting, explained = lasting_of(stored), removed_n2 / scale**2
    return _beside(Base(shape, point, information, noise, promised, explained=explained, lasting=lasting), terms)


def remembering(base: Base, segments: Sequence[Segment]) -> Base | None:
    """The same where a mount that begins unloaded may remember a load from before; None where nothing can remember.

    Its zero is the bench's then: beside what the slowest lags remember, it would be any.
    """
    unloaded = [k for k, segment in enumerate(segments) if begins_unloaded(segment, base.shape)]
    terms = _states(base.shape, base.point, dict.fromkeys(unloaded, 1.0))
    held, zero = base.information.copy(), base.shape.parts()["offset"]
    held[zero, zero] *= HOLDS
    return _beside(replace(base, information=held), terms) if terms else None


def _beside(base: Base, terms: Sequence[Term]) -> Base:
    """With more terms, of which nothing is known beyond their sigmas."""
    shape = base.shape
    full = replace(shape, terms=(*shape.terms, *terms))
    wide = np.zeros((full.n, full.n))
    wide[: shape.n, : shape.n] = base.information
    numbers = np.concatenate((base.point.terms, np.zeros(full.n - shape.n)))
    return replace(base, shape=full, point=replace(base.point, terms=numbers), information=wide)


def _told_by(found: Solution) -> Posterior:
    return kept(found, [effect.name for effect in effects_of(found)])


def learnt(spec: ModelSpec) -> Posterior | None:
    """What the bench said of rubber; a general system's own numbers hold no effects, it is asked as any other model."""
    return spec.posterior if spec.posterior is not None and spec.posterior.passive else None


def _promised(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    if spec.error is not None:
        return float(np.median(spec.error.std_n))
    return UNSURE * float(np.nanstd(np.concatenate([s.force_n for s in segments])))


def thinned(y: Floats, every: int) -> Floats:
    """Every so manieth pair of neighbours, not a number between them: all over a record."""
    return y if every == 1 else np.where(np.arange(len(y)) // 2 % every == 0, y, np.nan)


def _doubt(spec: ModelSpec, segments: Sequence[Segment], promised: float, every: int) -> float:
    """Variance of the promised error as if it were new every so many samples: what is no noise counts once."""
    steps = plateau([s.force_n - simulate(spec, s) for s in segments], [s.step_share for s in segments])
    noise = min(promised, steps) ** 2
    return noise / every + (promised**2 - noise) * max(1.0, sum(map(len, segments)) / every / KNOTS)


def _pruned(shape: Shape, point: Point, information: Floats) -> tuple[Shape, Point, Floats]:
    """Without lags and friction that the data did not need: what grew since is `relaxation`, `hysteresis`."""
    kept, where = point.gain != 0.0, shape.parts()
    mask = np.ones(shape.n, bool)
    mask[where["gain"]] = kept
    rubs = float(point.stops.sum()) > FRICTIONLESS
    mask[where["growth"]] = mask[where["stops"]] = rubs
    nothing = np.zeros(0)
    smaller = replace(
        shape, taus_s=np.exp(point.log_tau[kept]), radii=shape.radii if rubs else nothing, grows=shape.grows and rubs
    )
    stops = point.stops if rubs else nothing
    found = replace(point, gain=point.gain[kept], log_tau=point.log_tau[kept], stops=stops)
    return smaller, found, information[np.ix_(mask, mask)]


def _zeroed(shape: Shape, information: Floats, std: float) -> tuple[Shape, Floats]:
    """With its zero set anew: whoever mounts transducer and reference once more sets it by so much elsewhere.

    For records that show it: where one begins under load, a zero looks like what the slowest lags remember. There only
    a reference that walks has another, by as much as it walks in an hour.
    """
    told = information[:, shape.parts()["offset"]]
    less = told @ told.T * std**2 / (1.0 + std**2 * information[shape.parts()["offset"], shape.parts()["offset"]])
    return replace(shape, zero_std=std), information - less


def _present(spec: EffectSpec) -> Term:
    """An effect of the model as a term around its value; its sigma is the prior's."""
    effect = effect_named(spec.name)
    values = effect.neutral() | spec.parameters
    std = {
        p.name: max(spec.std.get(p.name, 0.0), 1e-6 * abs(p.starts[0])) or KNOWN * abs(values[p.name])
        for p in effect.parameters
        if p.amplitude
    }
    return Term(effect, values, std, centre={name: values[name] for name in std}, shapes=False)


def begins_unloaded(segment: Segment, shape: Shape) -> bool:
    """Whether it begins without load, as `plan-test` asks: then its lags remember nothing, unless data say so.

    Either reading says it: the other's zero may be elsewhere.
    """
    d = abs(float(segment.inputs[DEFORMATION][: _begun(segment)].mean()) - shape.zero)
    return bool(_load(segment, shape) < UNLOADED or d < UNLOADED * travel(shape.f_grid))


def _load(segment: Segment, shape: Shape) -> float:
    """Size of what it begins under, of the output's spread; that spread where nothing says it."""
    first = segment.force_n[: _begun(segment)]
    known = first[np.isfinite(first)]
    return abs(float(known.mean())) / shape.output_scale if len(known) else 1.0


def _begun(segment: Segment) -> int:
    return max(round(BEGUN_S / segment.dt_s), 1)


@jit
def _state_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """v plus what n lags still remember u[0] seconds after the start: c[:n] time constants, c[n:] sizes."""
    n = c.size // 2
    for i in range(n):
        if c[n + i] != 0.0:
            v += c[n + i] * np.exp(-u[0] / c[i])
    return v


def _states(shape: Shape, point: Point, loads: Mapping[int, float]) -> list[Term]:
    """What lags remember when records of these numbers begin under these loads, beside rest: by lag, its share.

    A record begins after the past that its model as it is follows best (`beginning_of`): a load that has been there for
    ever, for some time, or since this moment. It may have been another.
    """
    lags = zip(np.exp(point.log_tau), shape.output_scale * np.abs(point.gain), strict=True)
    memory = [(float(tau), STATE * float(size)) for tau, size in (*lags, *stretched(shape, point)) if size > 0.0]
    return [_state(n, [(tau, load * size) for tau, size in memory]) for n, load in loads.items() if memory]


def _state(number: int, memory: Sequence[tuple[float, float]]) -> Term:
    """The state of the relaxation when record `number` begins, beside rest: linear, one number per lag."""
    taus = np.array([tau for tau, _ in memory])
    names = [f"lag_{i}" for i in range(len(taus))]
    effect = Effect(
        name=f"{STATE_OF}{number}",
        title="state at the start",
        site="force",
        channels=(f"{STATE_OF}{number}",),
        parameters=tuple(Parameter(name, "N", 0.0, -1e12, 1e12, (1.0,), "") for name in names),
        step=_state_step,
        prepare=lambda p, dt_s: np.concatenate((taus, [p[name] for name in names])),
        n_state=0,
        equation="",
        source="",
        separating_test="",
    )
    sizes = {name: size for name, (_, size) in zip(names, memory, strict=True)}
    return replace(at_start(effect, sizes, {}), sized=True)


def is_nuisance(term: Term) -> bool:
    """Of a record's start or of its reference, no effect of the mount."""
    return is_walk(term) or term.effect.name.startswith(STATE_OF)


def records_of(base: Base, spec: ModelSpec, segments: Sequence[Segment]) -> list[Record]:
    """Segments as the regression reads them, each begun where its first stretch says."""

    def run(segment: Segment) -> Floats:
        return simulate(spec, segment)

    return [
        Record(
            s.inputs[DEFORMATION],
            s.force_n / base.scale,
            s.dt_s,
            float(s.inputs[DEFORMATION][0]),
            {name: np.ascontiguousarray(column) for name, column in s.inputs.items()}
            | {"time_s": s.time_s}
            | hours_of(segments, s)
            | {f"{STATE_OF}{k}": np.full(len(s), NEVER_S) for k in range(len(segments))}
            | {f"{STATE_OF}{i}": s.dt_s * np.arange(len(s))},
            lasting=base.lasting,
            step_share=s.step_share,
        ).after(beginning_of(run, s))
        for i, s in enumerate(segments)
    ]
