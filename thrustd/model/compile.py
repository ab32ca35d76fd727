"""ModelSpec -> CompiledModel at one sample rate; the only place where a model becomes fast.

    compiled = compile_model(spec, rate_hz=1000.0)
    state = compiled.start(row)                 # at rest with the first row of inputs
    compiled.run(state, channels, v)            # in flight: a few samples, deformations in, thrust shares out
    force_n = compiled.step(state, row[1:], row[0])   # one sample
    force_n = compiled.simulate(inputs)         # on the ground, a block (n, n_inputs) -> (n,)

A row of inputs begins with deformation_mm, then the channels of the effects in `compiled.channels` order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from thrustd.core.errors import ModelError
from thrustd.core.signals import CATALOGUE
from thrustd.model.artifact import (
    Curve,
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    Witness,
    read_model,
)
from thrustd.model.curves import polynomial, pwl
from thrustd.model.effect import SITES, Effect
from thrustd.model.effects import effect_named
from thrustd.model.effects.hysteresis import EFFECT as FRICTION
from thrustd.model.feedback import feedback
from thrustd.model.linear import sections
from thrustd.model.stage import DEFORMATION, Chain, Floats, Stage, compose, run_chain

WITNESS_TOLERANCE_N = 1e-6  # another processor or library may round differently; a wrong model differs by newtons
_BLOCK = 65536  # samples per block: keeps memory flat


def curve_stage(name: str, curve: Curve) -> Stage:
    if isinstance(curve, PiecewiseLinear):
        return pwl(name, np.array(curve.x), np.array(curve.y))
    return polynomial(name, curve.centre, curve.scale, np.array(curve.coefficients))


def linear_stage(linear: LinearBlock, dt_s: float, name: str = "linear") -> Stage:
    complex_modes = [
        (complex(-m.decay_1_s, m.frequency_rad_s), complex(m.gain_re, m.gain_im)) for m in linear.complex_modes
    ]
    real_modes = [(m.tau_s, m.gain) for m in linear.real_modes]
    if linear.feedback is not None:
        modes = [(complex(-1 / tau), complex(gain)) for tau, gain in real_modes] + complex_modes
        fed = linear.feedback
        reach = np.array(fed.centre), np.array(fed.scale), np.array(fed.within)
        return feedback(name, linear.direct, modes, fed.degree, reach, np.array(fed.into), dt_s)
    return sections(name, linear.direct, real_modes, complex_modes, dt_s, linear.hold)


def model_stages(spec: ModelSpec, dt_s: float) -> tuple[Stage, ...]:
    """All stages of a model in the order they act, at one sample period."""
    placed: dict[str, list[Stage]] = {site: [] for site in SITES}
    for chosen in spec.effects:
        effect = effect_named(chosen.name)
        parameters = _parameters(effect, chosen.parameters)
        if effect.lags is None or spec.linear.feedback is not None:
            placed[effect.site].append(effect.stage(parameters, dt_s))
    core = [
        replace(curve_stage("input_curve", spec.input_curve), enters=True),
        *placed["spring"],
        linear_stage(linear_of(spec), dt_s),
        *placed["linear"],
        curve_stage("output_curve", spec.output_curve),
        *([linear_stage(spec.output_linear, dt_s, "output_linear")] if spec.output_linear is not None else []),
    ]
    ends_mm = np.array([-1.0, 1.0])
    pressed = [pwl("pressed", ends_mm, ends_mm + spec.pressed_mm)] if spec.pressed_mm != 0.0 else []
    return (*pressed, *placed["deformation"], *core, *placed["gain"], *placed["force"])


def linear_of(spec: ModelSpec) -> LinearBlock:
    """The linear block with what effects add to its relaxation: w + sum g (w - lag w) beside its own.

    A block with feedback stays as it is: there such an effect acts behind it.
    """
    block = spec.linear
    if block.feedback is not None:
        return block
    for chosen in spec.effects:
        effect = effect_named(chosen.name)
        lags = effect.lags(_parameters(effect, chosen.parameters)) if effect.lags is not None else []
        modes = [RealMode(tau_s, -gain) for tau_s, gain in lags if gain != 0.0]
        direct = block.direct + sum(gain for _, gain in lags)
        block = msgspec.structs.replace(block, direct=direct, real_modes=[*block.real_modes, *modes])
    return block


def _parameters(effect: Effect, given: Mapping[str, float]) -> dict[str, float]:
    known = {p.name: p for p in effect.parameters}
    for name, value in given.items():
        if name not in known:
            raise ModelError(f"effect {effect.name}: unknown parameter '{name}', expected {', '.join(known)}")
        if not known[name].low <= value <= known[name].high:
            low, high = known[name].low, known[name].high
            raise ModelError(f"effect {effect.name}: {name} = {value}, expected {low} to {high}")
    return effect.neutral() | dict(given)


@dataclass(frozen=True, slots=True)
class CompiledModel:
    """A model ready to run at one rate. Immutable: the state is handed in and out."""

    spec: ModelSpec
    rate_hz: float
    stages: tuple[Stage, ...]
    channels: tuple[str, ...]  # of one row of inputs; deformation_mm first
    chain: Chain  # what `stage.run_chain` needs beside state and rows
    rub: frozenset[str]  # stages of friction that the weight has moved

    def start(self, row: Floats) -> Floats:
        """State (n_state,) of a mount at rest under the inputs row (n_inputs,).

        What the weight presses has brought its friction from no deformation to that of the reading 0, then to this one.
        """
        row = np.array(row, float)
        states, column, v = [], 1, float(row[0])
        for stage in self.stages:
            if stage.enters:
                row[1 + self.chain.own] = v
            u = row[column : column + len(stage.channels)]
            x = rubbed(stage, u, (0.0, self.spec.pressed_mm)) if stage.name in self.rub else stage.start(u, v)
            v = stage.once(x.copy(), u, v)
            states.append(x)
            column += len(stage.channels)
        return np.concatenate(states)

    def run(self, state: Floats, channels: Floats, v: Floats) -> None:
        """v (n,): deformation_mm becomes thrust share, N; rows of channels (n, n_inputs - 1) get the
        rubber's deformation where effects read it, state is advanced."""
        run_chain(self.chain, state, channels, v)

    def step(self, state: Floats, channels: Floats, deformation_mm: float) -> float:
        """Thrust share, N, of one sample; channels (n_inputs - 1,), `state` is advanced in place."""
        v = np.array([deformation_mm])
        self.run(state, channels.reshape(1, -1).copy(), v)  # the run writes the rubber's deformation into its rows
        return v.item()

    def simulate(self, inputs: Floats, state: Floats | None = None) -> Floats:
        """Free run over inputs (n, n_inputs) -> force_n (n,), from rest or from `state` (advanced in place)."""
        inputs = np.asarray(inputs, float)
        state = self.start(inputs[0]) if state is None else state
        force_n = np.empty(len(inputs))
        for begin in range(0, len(inputs), _BLOCK):
            rows = inputs[begin : begin + _BLOCK]
            force_n[begin : begin + _BLOCK] = self._block(state, rows)
        return force_n

    def _block(self, state: Floats, rows: Floats) -> Floats:
        v, column, begin = np.ascontiguousarray(rows[:, 0]), 1, 0
        rows = rows.copy() if self.chain.own.size else rows
        for stage in self.stages:
            if stage.enters and self.chain.own.size:
                rows[:, 1 + self.chain.own] = v[:, None]
            u = rows[:, column : column + len(stage.channels)]
            v = stage.run(state[begin : begin + stage.n_state], u, v)
            column, begin = column + len(stage.channels), begin + stage.n_state
        return v

    def inputs(self, channels: Mapping[str, Floats]) -> Floats:
        """Gather the columns this model reads from channels (n,) -> (n, n_inputs); ModelError if one is missing."""
        for name in self.channels:
            if name not in channels:
                raise ModelError(f"model '{self.spec.name}' needs channel '{name}', which is not in the data")
        return np.column_stack([np.asarray(channels[name], float) for name in self.channels])


def compile_model(spec: ModelSpec, rate_hz: float) -> CompiledModel:
    """Discretise for `rate_hz` (samples per second), flatten the curves, compile; does not check the witness."""
    stages = model_stages(spec, 1.0 / rate_hz)
    channels = ("deformation_mm", *(name for stage in stages for name in stage.channels))
    rub = frozenset(one.name for one in spec.effects if rubs(one)) if spec.pressed_mm != 0.0 else frozenset()
    return CompiledModel(spec, rate_hz, stages, channels, compose(stages), rub)


def rubs(present: EffectSpec) -> bool:
    """Whether it is friction."""
    return effect_named(present.name).word == FRICTION.word


def rubbed(stage: Stage, u: Floats, path_mm: Sequence[float]) -> Floats:
    """State of a stage of friction that began at the first of these deformations, went to the others, ends at u's."""
    rows = np.tile(u, (len(path_mm) + 1, 1))
    for j, name in enumerate(stage.channels):
        if name == DEFORMATION:
            rows[:-1, j] = path_mm
    x = stage.start(rows[0], 0.0)
    stage.run(x, rows, np.zeros(len(rows)))
    return x


def rate_difference_n(one: CompiledModel, other: CompiledModel) -> float:
    """Largest difference, N, of one model compiled at two rates, over a minute of throttle movement."""
    common_s = np.arange(0.0, 60.0, 1.0)
    forces = []
    for model in (one, other):
        time_s = np.arange(round(60.0 * model.rate_hz)) / model.rate_hz
        low, high = model.spec.valid.deformation_mm
        rest = [CATALOGUE[name].rest if name in CATALOGUE else 0.0 for name in model.channels]
        inputs = np.tile(np.nan_to_num(np.array(rest, float)), (time_s.size, 1))
        inputs[:, 0] = low + (high - low) * (0.5 - 0.5 * np.cos(2 * np.pi * time_s / 20.0))
        forces.append(np.interp(common_s, time_s, model.simulate(inputs)))
    return float(np.max(np.abs(forces[0] - forces[1])))


def witness_of(spec: ModelSpec, rate_hz: float, channels: Mapping[str, Floats]) -> Witness:
    """Run a model over a few rows and keep inputs and outputs as its witness."""
    model = compile_model(spec, rate_hz)
    force_n = model.simulate(model.inputs(channels))
    names = dict.fromkeys(model.channels)
    return Witness(rate_hz, {name: list(map(float, channels[name])) for name in names}, list(map(float, force_n)))


def read_proven_model(text: str | bytes, where: str) -> ModelSpec:
    """A model as every verb takes it: valid, and its witness rows come out again; else ModelError naming `where`."""
    spec = read_model(text, where)
    for i, effect in enumerate(spec.effects):
        try:
            effect_named(effect.name)
        except ModelError as problem:
            raise ModelError(f"{where}: effects[{i}].name: {problem}") from None
    check_witness(spec, where)
    return spec


@np.errstate(all="ignore")  # what overflows does not come out again
def check_witness(spec: ModelSpec, where: str) -> None:
    """Refuse (ModelError) a model that has no witness rows or does not reproduce them."""
    if spec.witness is None:
        raise ModelError(f"{where}: no witness rows; expected an artifact written by thrustd")
    model = compile_model(spec, spec.witness.rate_hz)
    given = {name: np.array(rows) for name, rows in spec.witness.inputs.items()}
    rows = model.inputs(given)
    state = model.start(rows[0])
    force_n = np.array([model.step(state, row[1:], row[0]) for row in rows])
    difference = np.abs(force_n - np.array(spec.witness.force_n))
    worst = int(np.argmax(difference))
    if not difference[worst] <= WITNESS_TOLERANCE_N:
        raise ModelError(
            f"{where}: witness row {worst} gives {difference[worst]:.3g} N other than stored, "
            f"expected at most {WITNESS_TOLERANCE_N:g} N: the artifact was changed or the code computes differently"
        )
