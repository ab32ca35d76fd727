"""A compiled model as one file of C99: no dependencies but libm, no allocation, the doubles of the Python step.

    mount_init(&state, &inputs);             at rest under the first inputs
    force_n = mount_step(&state, &inputs);   one sample

Tables hold a model's coefficients at one sample rate; functions are translated from the very steps that fly
(`c_function`), so there is no second description of the physics that could drift. Compile without contraction of
products and sums (-ffp-contract=off): a fused one rounds once where Python rounds twice.
"""

import re
from hashlib import sha256

from thrustd.core.errors import ModelError
from thrustd.core.signals import CATALOGUE
from thrustd.model.artifact import write_model
from thrustd.model.c_function import Library, c_number
from thrustd.model.compile import CompiledModel
from thrustd.model.stage import DEFORMATION, Stage


def c_source(model: CompiledModel, prefix: str = "mount") -> str:
    """The text of the file; `prefix` begins every name in it. ModelError if an effect has no translation."""
    if model.rub:
        raise ModelError(f"{model.spec.name}: as it flies, under its engine's weight; expected a model of the bench")
    library = Library(prefix)
    steps = [library.add(stage.step) for stage in model.stages]
    starts = [library.add(stage.initial) if stage.initial is not None else "" for stage in model.stages]
    tables = [_table(prefix, i, stage) for i, stage in enumerate(model.stages)]
    parts = [
        _head(model, prefix),
        _types(model, prefix),
        library.text(),
        "\n".join(tables),
        _init(model, prefix, steps, starts),
        _step(model, prefix, steps),
    ]
    return "\n".join(parts)


def _head(model: CompiledModel, prefix: str) -> str:
    digest = sha256(write_model(model.spec).encode()).hexdigest()[:16]
    spec = model.spec
    low, high = spec.valid.deformation_mm
    return f"""\
/* {_said(spec.name)} ({_said(spec.structure)}) at {model.rate_hz:g} Hz: force on one engine mount from its deformation.
   Written by `thrustd compile --c` from the model artifact {digest}...; do not edit.

   {prefix}_init(&state, &inputs)   at rest under the first inputs
   {prefix}_step(&state, &inputs)   one sample every {1 / model.rate_hz:g} s: the mount's share of thrust, N, forward +

   Identified from {low:.4g} to {high:.4g} mm. C99, libm, no allocation. The doubles are those of thrustd's own step
   when nothing is contracted: cc -std=c99 -O2 -ffp-contract=off file.c -lm */

#include <math.h>
#include <string.h>
"""


def _said(text: str) -> str:
    """Nothing in a model's name ends a comment."""
    return re.sub(r"[^\w .,+-]", "_", text)


def _fields(model: CompiledModel) -> dict[str, str]:
    """Channel -> field of the inputs."""
    fields: dict[str, str] = {}
    for channel in model.channels:
        if channel not in fields:
            name = re.sub(r"\W", "_", channel, flags=re.ASCII)
            name = name if name[:1].isalpha() else f"c_{name}"
            while name in fields.values():
                name += "_"
            fields[channel] = name
    return fields


def _types(model: CompiledModel, prefix: str) -> str:
    lines = []
    for channel, field in _fields(model).items():
        signal = CATALOGUE.get(channel)
        unit = f" /* {signal.unit} */" if signal is not None and signal.unit else ""
        lines.append(f"    double {field};{unit}")
    n = sum(stage.n_state for stage in model.stages)
    return (
        f"typedef struct {{\n    double x[{max(n, 1)}];\n}} {prefix}_state;\n\n"
        "typedef struct {\n" + "\n".join(lines) + f"\n}} {prefix}_inputs;\n"
    )


def _table(prefix: str, i: int, stage: Stage) -> str:
    numbers = [c_number(value) for value in stage.c] or ["0.0"]
    rows = [", ".join(numbers[k : k + 5]) for k in range(0, len(numbers), 5)]
    body = ",\n    ".join(rows)
    return f"/* {_said(stage.name)} */\nstatic const double {prefix}_c{i}[{len(numbers)}] = {{\n    {body}}};\n"


def _channels(model: CompiledModel, i: int) -> tuple[str, str]:
    """Lines that gather the channels of stage i, and how they are handed over."""
    stage, corrected = model.stages[i], model.chain.own.size > 0
    text = "    const double rubber_mm = v;\n" if corrected and i == model.chain.entry else ""
    if not stage.channels:
        return text, "0, 0"
    fields = {name: f"in->{field}" for name, field in _fields(model).items()}
    if corrected and i > model.chain.entry:
        fields[DEFORMATION] = "rubber_mm"
    values = ", ".join(fields[name] for name in stage.channels)
    return f"{text}    const double u{i}[{len(stage.channels)}] = {{{values}}};\n", f"u{i}, {len(stage.channels)}"


def _step(model: CompiledModel, prefix: str, steps: list[str]) -> str:
    text, at = "    double v = in->deformation_mm;\n", 0
    for i, stage in enumerate(model.stages):
        gathered, channels = _channels(model, i)
        row = f"s->x + {at}, {stage.n_state}"
        text += f"{gathered}    v = {steps[i]}({row}, {prefix}_c{i}, {stage.c.size}, {channels}, v);\n"
        at += stage.n_state
    return f"double {prefix}_step({prefix}_state *s, const {prefix}_inputs *in)\n{{\n{text}    return v;\n}}\n"


def _init(model: CompiledModel, prefix: str, steps: list[str], starts: list[str]) -> str:
    """Every stage at rest under what the stages before it make of the first inputs, each on a copy of its state."""
    size, at = max(1, *(stage.n_state for stage in model.stages)), 0
    text = f"    double once[{size}];\n    double v = in->deformation_mm;\n"
    text += "    memset(s, 0, sizeof *s);\n"
    for i, stage in enumerate(model.stages):
        gathered, channels = _channels(model, i)
        rest = f"{prefix}_c{i}, {stage.c.size}, {channels}, v);\n"
        text += gathered
        if starts[i]:
            text += f"    {starts[i]}(s->x + {at}, {stage.n_state}, {rest}"
        if stage.n_state:
            text += f"    memcpy(once, s->x + {at}, {stage.n_state} * sizeof(double));\n"
        text += f"    v = {steps[i]}(once, {stage.n_state}, {rest}"
        at += stage.n_state
    return f"void {prefix}_init({prefix}_state *s, const {prefix}_inputs *in)\n{{\n{text}    (void)v;\n}}\n"
