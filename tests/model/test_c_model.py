"""A model in C: the doubles of the step that flies, to the last bit."""

import re
import shutil
import subprocess
from pathlib import Path

import msgspec
import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.core.calibration import Calibration, Drag, MountCalibration, Zero, write_calibration
from thrustd.core.errors import ModelError
from thrustd.core.signals import CATALOGUE
from thrustd.installation.installation import read_installation
from thrustd.model.artifact import EffectSpec, LinearBlock, ModelSpec, PiecewiseLinear, RealMode, ValidRange, read_model
from thrustd.model.c_function import Library
from thrustd.model.c_model import c_source
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named, shelf
from thrustd.model.stage import Floats, jit

from .test_feedback import hardening
from .test_feedback import spec as feedback_spec

CC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_c = pytest.mark.skipif(CC is None, reason="no C compiler here")
FLAGS = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "-ffp-contract=off"]
ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "models").glob("*.json"))
MAIN = """
#include <stdio.h>
{includes}
int main(void)
{{
    static char inputs[1 << 16];
    (void)inputs;
{bodies}
    return 0;
}}
"""
BODY = """    {{
        {p}_state s; {p}_inputs in; double v; long k;
        for (k = 0; k < {n}; k++) {{
            if (fread(&in, sizeof in, 1, stdin) != 1) return 1;
            if (k == 0) {p}_init(&s, &in);
            v = {p}_step(&s, &in);
            fwrite(&v, sizeof v, 1, stdout);
        }}
    }}"""


def inputs_of(model, n, seed=0):
    """Rows (n, unique channels) of a mount in flight: steps, ramps, holds, noise, and steps of zero."""
    rng = np.random.default_rng(seed)
    columns = {}
    for name in dict.fromkeys(model.channels):
        signal = CATALOGUE.get(name)
        rest, spread = (signal.rest, signal.spread or 1.0) if signal else (0.0, 1.0)
        columns[name] = rest + spread * np.repeat(rng.normal(size=n // 50 + 1), 50)[:n]
    columns["deformation_mm"] = 0.5 + 0.4 * np.sin(np.arange(n) * 0.003) + np.cumsum(rng.normal(0, 1e-3, n))
    columns["deformation_mm"][n // 2 : n // 2 + n // 20] = columns["deformation_mm"][n // 2]
    if "time_s" in columns:
        columns["time_s"] = np.arange(n) / model.rate_hz - 20.0
    return columns


def in_c(models, columns, folder):
    """What C makes of columns, one model after another."""
    includes, bodies = [], []
    for i, (model, given) in enumerate(zip(models, columns, strict=True)):
        (folder / f"m{i}.c").write_text(c_source(model, f"m{i}"))
        includes.append(f'#include "m{i}.c"')
        bodies.append(BODY.format(p=f"m{i}", n=len(given["deformation_mm"])))
    (folder / "main.c").write_text(MAIN.format(includes="\n".join(includes), bodies="\n".join(bodies)))
    subprocess.run([CC, *FLAGS, "main.c", "-o", "main", "-lm"], cwd=folder, check=True)
    rows = b"".join(np.column_stack(list(each.values())).tobytes() for each in columns)
    out = np.frombuffer(subprocess.run([folder / "main"], input=rows, capture_output=True, check=True).stdout)
    return np.split(out, np.cumsum([len(each["deformation_mm"]) for each in columns])[:-1])


def assert_same(models, n, folder):
    # a row of inputs in C has each channel once, deformation first, in the order of the model's own row
    columns = [inputs_of(model, n, seed) for seed, model in enumerate(models)]
    for model, given, force_n in zip(models, columns, in_c(models, columns, folder), strict=True):
        expected = model.simulate(model.inputs(given))
        assert np.isfinite(expected).all(), model.spec.effects
        np.testing.assert_array_equal(force_n.view(np.int64), expected.view(np.int64), model.spec.name)


@needs_c
def test_every_shipped_model_gives_the_same_million_doubles(tmp_path):
    assert len(SHIPPED) == 4
    models = [compile_model(read_model(path.read_text(), path.name), 1000.0) for path in SHIPPED]
    assert_same(models, 1_000_000, tmp_path)


@needs_c
def test_twenty_lags_with_all_that_commission_adds_give_the_same_million_doubles(tmp_path):
    spec = read_model(SHIPPED[1].read_text(), SHIPPED[1].name)
    lags = [RealMode(tau_s, -0.01) for tau_s in np.geomspace(0.02, 6e4, 20).tolist()]
    added = ("hysteresis_berg", "engine_weight_shift", "lever_arm")
    effects = [EffectSpec(name, parameters_of(effect_named(name), 0)) for name in added]
    longer = msgspec.structs.replace(
        spec, linear=msgspec.structs.replace(spec.linear, real_modes=lags), effects=[*spec.effects, *effects]
    )
    assert_same([compile_model(longer, 1000.0)], 1_000_000, tmp_path)


def with_effect(name, parameters):
    line = PiecewiseLinear([-1.0, 0.2, 0.9, 2.0], [-0.9, 0.2, 1.0, 2.2])
    linear = LinearBlock(0.8, [RealMode(0.05, 0.1), RealMode(2.0, 0.05), RealMode(200.0, 0.05)])
    force = PiecewiseLinear([-1.0, 1.0], [-5500.0, 5500.0])
    effects = [EffectSpec(name, parameters)]
    return ModelSpec("thrustd-model/1", name, "x", line, linear, force, ValidRange((0, 1), (0, 6000)), effects=effects)


def parameters_of(effect, start):
    """All switched on: the value from which an estimation begins, the `start`th where there are several."""
    return {p.name: p.starts[min(start, len(p.starts) - 1)] for p in effect.parameters}


@needs_c
def test_every_effect_of_the_shelf_gives_the_same_doubles(tmp_path):
    formula = "k * exp(-abs(accel_x_g) ** p) + k * sign(accel_x_g) * sin(time_s) / (2 + cos(time_s))"
    curves = ["curve of accel_x_g", "gain curve of accel_z_g - accel_x_g", "bias curve of accel_x_g * accel_z_g"]
    effects = [*shelf().values(), *map(effect_named, ["expression: " + formula, *curves])]
    specs = [with_effect(effect.name, parameters_of(effect, start)) for effect in effects for start in (0, 1)]
    assert_same([compile_model(spec, 100.0) for spec in specs], 20_000, tmp_path)


@needs_c
def test_a_fed_back_block_gives_the_same_doubles_and_starts_at_rest(tmp_path):
    spec = msgspec.structs.replace(feedback_spec(hardening(0.8)), name="*/ evil \\")
    assert_same([compile_model(spec, 200.0)], 20_000, tmp_path)


def test_what_has_no_translation_is_refused_and_named():
    @jit
    def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
        return v + [1.0, 2.0][0]

    with pytest.raises(ModelError, match=r"test_c_model.*\[1.0, 2.0\].*no translation to C"):
        Library("mount").add(step)


@needs_c
def test_the_ten_lines_of_the_documentation_print_what_it_says(tmp_path):
    root = Path(__file__).parents[2]
    page = (root / "docs" / "c.md").read_text()
    (tmp_path / "fly.c").write_text(re.search(r"```c\n(.*?)```", page, re.DOTALL)[1])
    assert (
        main(["compile", str(root / "models/left-upper.json"), "--rate", "1000", "--c", str(tmp_path / "mount.c")]) == 0
    )
    subprocess.run([CC, *FLAGS, "fly.c", "-o", "fly", "-lm"], cwd=tmp_path, check=True)
    last = subprocess.run([tmp_path / "fly"], capture_output=True, check=True, text=True).stdout.splitlines()[-1]
    assert f"tail -1\n    {last}\n" in page


def test_a_bad_name_for_the_c_file_is_one_line(tmp_path, capsys):
    model = str(SHIPPED[0])
    out = tmp_path / "mount.c"
    assert main(["compile", model, "--rate", "1000", "--c", str(out), "--prefix", "1-2"]) == 2
    assert main(["compile", model, "--rate", "1000", "--c", str(out.with_suffix(".h"))]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    assert not list(tmp_path.iterdir())


@needs_c
def test_a_calibrated_mount_gives_in_c_what_flies_in_its_aircraft(tmp_path):
    """Gain, friction, curve, growth and lean of the calibration, and its part of the drag: 85 N at 5 kN by the gain."""
    measured = MountCalibration(
        zeros=(Zero("2026-01-01", 0.012, 0.002),), read_mm=(0.0, 0.8, 1.6), true_mm=(0.0, 0.806, 1.6), gain=1.017,
        friction=1.06, expansion_mm_k=5e-4, expansion_std_mm_k=1e-4, reference_degc=30.0,
        lean_deg=1.0, lean_std_deg=0.2,
    )  # fmt: skip
    calibration = Calibration(on="2026-01-01", mount={"left_upper": measured}, drag=Drag("2026-01-01", 0.02, 0.01))
    (tmp_path / "calibration.toml").write_text(write_calibration(calibration))
    config = tmp_path / "hil.toml"
    for name in ("hil.toml", "citation-ii.toml", "canaerospace.dbc"):
        (tmp_path / name).write_text((ROOT / "deploy" / name).read_text().replace('"../', f'"{ROOT}/'))
    config.write_text('calibration = "calibration.toml"\n' + config.read_text())
    shown = ["--mount", "left_upper", "--config", str(config), "--c", str(tmp_path / "m0.c"), "--prefix", "m0"]
    assert main(["compile", str(ROOT / "models" / "left-upper.json"), "--rate", "100", *shown]) == 0
    installation = read_installation(config)
    flies = compile_model(installation.model(installation.config.mount[0]), 100.0)
    assert (tmp_path / "m0.c").read_text() == c_source(flies, "m0")
    assert_same([flies], 20_000, tmp_path)
