"""A curve between two linear blocks."""

import msgspec
import numpy as np
import pytest

from thrustd.identify.identify import identify
from thrustd.identify.regression.general import Asked
from thrustd.identify.report import errors_of
from thrustd.identify.segments import segments_of
from thrustd.identify.structures import structure_named, wiener_hammerstein
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import of_spec
from thrustd.identify.structures.wiener_hammerstein import _block, _poles, _turned, _zeros
from thrustd.model.artifact import (
    ComplexMode,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    Polynomial,
    RealMode,
    ValidRange,
    read_model,
    write_model,
)
from thrustd.model.compile import check_witness, compile_model
from thrustd.records.recording import make_recording
from thrustd.twin.bench import step_bench

LINE = PiecewiseLinear([-1.0, 1.0], [-1.0, 1.0])
CLIPPED = PiecewiseLinear([-2.0, 0.2, 0.4, 2.0], [-2.0, 0.2, 0.3, 0.7])
BETWEEN = ModelSpec(
    "thrustd-model/1", "between", "wiener-hammerstein", LINE, LinearBlock(0.0, [], [ComplexMode(8.0, 25.0, 1.0, 0.4)]),
    CLIPPED, ValidRange((-1.0, 1.0), (-2.0, 0.7)), LinearBlock(0.2, [RealMode(0.1, 0.5), RealMode(0.4, 0.3)]),
)  # fmt: skip


def record(seed, n=4000, rate_hz=50.0, noise=0.002):
    rng = np.random.default_rng(seed)
    u = rng.normal(size=n)
    force = compile_model(BETWEEN, rate_hz).simulate(u[:, None]) + noise * rng.normal(size=n)
    return make_recording(f"seed {seed}", {"time_s": np.arange(n) / rate_hz, "deformation_mm": u, "force_N": force})


def test_both_linear_blocks_are_found():
    found = identify([record(1)], [record(2)], ["oe-6-4", "wiener", "wiener-hammerstein"])
    fits = {score.structure: score.validation.fit_pct for score in found.scores}
    assert fits["wiener-hammerstein"] > 97.0 > fits["wiener"] > fits["oe-6-4"]
    assert found.spec.structure == "wiener-hammerstein"
    check_witness(read_model(write_model(found.spec), "model"), "model")


def test_poles_and_zeros_give_the_block_back():
    block = msgspec.structs.replace(BETWEEN.linear, real_modes=[RealMode(0.3, 0.2)], direct=-0.2)
    poles = _poles(block)
    again = _block(poles, _zeros(block, poles))
    np.testing.assert_allclose(again.direct, block.direct, rtol=1e-6)
    np.testing.assert_allclose(again.real_modes[0].gain, 0.2, rtol=1e-6)
    np.testing.assert_allclose(again.complex_modes[0].gain_im, 0.4, rtol=1e-6)


@pytest.mark.parametrize("curve", [Polynomial(0.0, 2.0, [0.1, 1.5, 0.2, 0.3]), CLIPPED])
def test_a_hammerstein_model_is_the_same_with_its_curve_between_two_blocks(curve):
    line = PiecewiseLinear([0.0, 1.0], [5.0, 25.0])
    whole = msgspec.structs.replace(BETWEEN, input_curve=curve, output_curve=line, output_linear=None)
    u = np.random.default_rng(5).uniform(-2.5, 2.5, size=(400, 1))
    np.testing.assert_allclose(
        compile_model(_turned(whole), 50.0).simulate(u), compile_model(whole, 50.0).simulate(u), atol=1e-9
    )


def test_an_artifact_without_a_second_block_is_written_as_before():
    assert "output_linear" not in write_model(msgspec.structs.replace(BETWEEN, output_linear=None))


def test_it_follows_no_worse_than_what_it_contains_where_few_samples_mislead(monkeypatch):
    """The first minutes of a bench show no creep."""
    for name, few in {"TRIED": 300, "FINAL": 600, "ORDERS": (2,), "FINALISTS": 1, "GROWTH": 0}.items():
        monkeypatch.setattr(wiener_hammerstein, name, few)
    data, fits = segments_of([step_bench(1.0, 1).resample(1.0)]), BlockFits()
    both = structure_named("wiener-hammerstein").fit(data, fits, None)
    hammerstein = of_spec(fits.of(data, Asked("curve", "line", segments=wiener_hammerstein.SEGMENTS), None).spec, 0)
    assert errors_of(both, data).rmse_n < 1.05 * errors_of(hammerstein, data).rmse_n


def test_a_curve_ends_where_the_data_end():
    """A knot that no sample lies beside stood at -1e18 N, and a record that moved a little further met it."""
    [segment] = segments_of([record(1)])
    knots, heights = [-90.0, -60.0, -30.0, *CLIPPED.x, 40.0, 90.0], [-1.9e18, -9e17, -30.0, *CLIPPED.y, 10.2, 7e16]
    wild = msgspec.structs.replace(BETWEEN, output_curve=PiecewiseLinear(knots, heights))
    found = wiener_hammerstein.reached(wild, [segment])
    assert found.output_curve == PiecewiseLinear(knots[2:-1], heights[2:-1])  # with one beyond them on either side
    further = np.linspace(0.0, 30.0, 500)[:, None]
    assert np.abs(compile_model(found, 50.0).simulate(further)).max() < 100.0
    same = [compile_model(each, 50.0).simulate(segment.inputs["deformation_mm"][:, None]) for each in (found, BETWEEN)]
    assert same[0] == pytest.approx(same[1], abs=1e-9)


def test_a_block_without_memory_has_no_zeros():
    """That of noise about one level: `identify` of such a record ended in a traceback."""
    alone = LinearBlock(0.3, [])
    assert not len(_zeros(alone, _poles(alone)))
