"""A small aircraft for tests: two engines, four simple mounts, the shipped deck and DBC."""

import gc
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the verbs have it: threads of two test processes spin

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from thrustd.installation.installation import Installation, installation_from_files
from thrustd.model.artifact import (
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
    write_model,
)
from thrustd.model.compile import witness_of

ROOT = Path(__file__).parents[1]
gc.set_threshold(700, 10, 100)  # a full collection walks all that the tests have imported: a tenth as often
sys.path.insert(0, str(ROOT))  # so that tests may use `benchmarks`
# the same examples on every machine, wherever the checkout is; "long" with another seed looks further
settings.register_profile("same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile(
    "long", max_examples=1000, database=None, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("same")
PH_LAB = ROOT.parent / "shared" / "data" / "ph_lab"
SCALE_MM = 5 / 2**24

CONFIG = """
deck = "deck.json"
[aircraft]
name = "test"
engines = ["left", "right"]
[adc]
port = "loop://"
sample_hz = {sample_hz}
channels = 4
[can]
interface = "virtual"
channel = "test"
dbc = "can.dbc"
{mounts}
[steps]
estimate_hz = {estimate_hz}
"""
MOUNT = """
[[mount]]
name = "{name}"
engine = "{engine}"
adc_channel = {channel}
model = "{name}.json"
scale_mm = 2.9802322387695312e-07
"""
NAMES = ("left_upper", "left_lower", "right_upper", "right_lower")


def simple_model(name: str = "mount", stiffness_n_mm: float = 5079.0, **changes: object) -> ModelSpec:
    """Linear spring of unit DC gain with two relaxation modes, and both load-factor corrections."""
    knots = np.linspace(0.0, 1.4, 11)
    spec = ModelSpec(
        schema="thrustd-model/1",
        name=name,
        structure="hw-pwl",
        input_curve=PiecewiseLinear(knots.tolist(), knots.tolist()),
        linear=LinearBlock(1.1, [RealMode(0.5, -0.05), RealMode(30.0, -0.05)]),
        output_curve=PiecewiseLinear(knots.tolist(), (stiffness_n_mm * knots).tolist()),
        valid=ValidRange((-0.05, 1.4), (-100.0, 7000.0)),
        effects=[
            EffectSpec("axial_inertia", {"mass_kg": 186.5}),
            EffectSpec("engine_weight", {"stiffening_1_n": 1e-5}),
        ],
    )
    spec = msgspec.structs.replace(spec, **changes)
    rows = {
        "deformation_mm": np.linspace(0, 1, 8),
        "accel_x_g": np.linspace(-0.1, 0.2, 8),
        "accel_z_g": np.linspace(0.5, 1.5, 8),
    }
    return msgspec.structs.replace(spec, witness=witness_of(spec, 100.0, rows))


def small_aircraft(sample_hz: float = 100.0, estimate_hz: float = 50.0, extra: str = "") -> Installation:
    mounts = "".join(MOUNT.format(name=name, engine=name.split("_")[0], channel=i) for i, name in enumerate(NAMES))
    files = {f"{name}.json": write_model(simple_model(name)).encode() for name in NAMES}
    files["deck.json"] = (ROOT / "models" / "brochure" / "jt15d-4.json").read_bytes()
    files["can.dbc"] = (ROOT / "deploy" / "canaerospace.dbc").read_bytes()
    text = CONFIG.format(sample_hz=sample_hz, estimate_hz=estimate_hz, mounts=mounts) + extra
    return installation_from_files({"config.toml": text.encode(), **files}, "test")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--need-browser", action="store_true", help="tests in a browser fail where there is none")


def pytest_collection_modifyitems(items):
    """Long ones first: begun last, one process would wait for another's."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(scope="session")
def aircraft() -> Installation:
    return small_aircraft()
