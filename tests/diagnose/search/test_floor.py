"""What nothing could go below: noise, or what the bench left."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.search.test_ranking import known
from thrustd.core.measures import rms
from thrustd.diagnose.search.base import plateau
from thrustd.diagnose.search.better import clearest
from thrustd.diagnose.search.curves import Followed
from thrustd.diagnose.search.floor import (
    at_floor,
    explains_all,
    far_above,
    floor_of,
    hardly_anything,
    left,
    mostly,
    noise_of,
    shows,
    usual,
    white_floor,
)
from thrustd.diagnose.search.sets import advanced
from thrustd.diagnose.search.unexplained import unexplained
from thrustd.diagnose.search.verdict import Verdict, grade_of
from thrustd.identify.regression.noise import Lasting
from thrustd.identify.segments import segments_of
from thrustd.records.recording import make_recording

UNEXPLAINED = 0.01


@pytest.mark.parametrize("trembles_s", [0.0, 0.004, 0.012])
def test_noise_is_noise_where_stamps_tremble(trembles_s):
    """What is read between two rows is like its neighbour: its steps say less of it than those of the rows do."""
    rng, n = np.random.default_rng(5), 40_000
    t = np.cumsum(0.05 + np.clip(rng.normal(0.0, trembles_s, n), -0.03, 0.03))
    data = {"time_s": t, "deformation_mm": np.sin(t), "force_N": rng.normal(0.0, 10.0, n)}
    segments = segments_of([make_recording("bench", data)])
    noise = [segment.force_n for segment in segments]
    shares = [segment.step_share for segment in segments]
    assert plateau(noise, shares) == pytest.approx(np.nanstd(np.concatenate(noise)), rel=0.02)
    assert shares == [1.0] if not trembles_s else shares < [0.9]


def test_the_floor_is_the_noise_or_what_the_bench_left_whichever_is_less():
    fit = SimpleNamespace(plateau=0.001, mse=(1.02 * UNEXPLAINED) ** 2, white=(1.02 * UNEXPLAINED) ** 2, terms=("law",))
    cell = SimpleNamespace(promised=0.004, own_plateau=np.inf, least=0.0, tremble=0.0, lasting=None)
    assert floor_of(fit, cell) == 0.001 and not at_floor(fit, cell)
    assert floor_of(fit, SimpleNamespace(promised=0.0005, own_plateau=np.inf, least=0.0)) == 0.0005
    assert (
        floor_of(fit, SimpleNamespace(promised=0.004, own_plateau=0.0007, least=0.0)) == 0.0007
    )  # a mount's core leaves more
    assert at_floor(SimpleNamespace(plateau=0.001, mse=0.00104**2, white=0.00104**2, terms=("law",)), cell)


def test_what_no_function_of_the_motion_explains_is_the_floor_as_far_as_nothing_less_was_promised():
    rough = known(promised=50.0, least=8.0)
    assert floor_of(fit(9.0), rough) == 8.0 and noise_of(fit(9.0), rough) == 1.0
    assert grade_of(rough, Verdict(("none",), fit(8.1, ()), ())) == "weak"  # nothing to be found, and no noise either
    assert floor_of(fit(9.0), SimpleNamespace(promised=2.0, own_plateau=np.inf, least=8.0)) == 2.0


@pytest.mark.parametrize(("missing", "floor"), [(0.0, 5.0), (60.0, 5.0)])
def test_a_free_function_of_the_motion_leaves_noise_and_what_is_not_of_the_motion(missing, floor):
    """White noise would be half the floor by its steps: the rest of it lasts, and no law of the motion explains it."""
    rng, n = np.random.default_rng(2), 12_000
    d = np.sin(0.02 * np.arange(n)) * np.repeat([0.5, 1.0], n // 2)
    lasting = lfilter([1.0], [1.0, -0.9], rng.normal(0.0, floor * np.sqrt(1.0 - 0.81), n))
    residual = missing * np.sign(np.gradient(d)) * np.abs(d) + lasting
    whole = SimpleNamespace(
        solution=SimpleNamespace(normal=SimpleNamespace(residuals=[residual])), records=[SimpleNamespace(d=d)]
    )
    assert 0.97 * floor < unexplained(whole) < min(1.25 * floor, 1.01 * rms(residual))


@pytest.mark.parametrize(("was", "leaves", "real"), [(1.18, 1.12, False), (1.25, 1.15, True), (1.18, 1.03, True)])
def test_what_lasts_on_a_bench_may_be_half_as_large_again_on_another_record(was, leaves, real):
    """Noise 1 and a bench that left 1.1: 1.21 is usual, but for what explains it to the noise."""
    inexact = known(promised=1.1)
    assert usual(fit(1.0), inexact) == pytest.approx(1.0 + 1.5**2 * (1.1**2 - 1.0))
    assert mostly(fit(was, ()), fit(leaves), inexact) == real


def test_a_bench_that_left_its_noise_leaves_no_more_elsewhere():
    assert usual(fit(1.0), CELL) == pytest.approx(1.0)
    assert usual(fit(1.0), SimpleNamespace(promised=None, own_plateau=np.inf, least=0.0)) == 0.0


def test_a_bench_that_missed_something_itself_says_nothing_of_other_records():
    assert usual(fit(1.0), SimpleNamespace(promised=1.3, own_plateau=np.inf, least=0.0)) == 0.0


@pytest.mark.parametrize(("left", "said"), [(1.2, True), (21.0, True), (24.0, False), (90.0, False)])
def test_a_curve_that_leaves_noise_or_a_twentieth_of_the_rest_says_it_all(left, said):
    assert hardly_anything(left**2, fit(100.0), CELL) == said
    assert not hardly_anything(1.3**2, fit(2.0), CELL)  # a twentieth of what is above the noise, not of all


def fit(rms, words=("law",)):
    """A fit whose blocks all leave the same."""
    nothing = SimpleNamespace(vector=lambda shape: np.zeros(0))
    blocks = np.full(48, rms**2)
    left = {
        "mse": rms**2,
        "white": rms**2,
        "block_mse": blocks,
        "block_white": blocks,
        "block_size": np.ones(48),
        "plateau": 1.0,
        "std": np.zeros(0),
        "strain": 0.0,
        "moved": 0.0,
        "walked": 0.0,
    }
    return SimpleNamespace(
        terms=words and (SimpleNamespace(free=(), effect=SimpleNamespace(name="law")),) * len(words),
        words=words,
        new=slice(0, 0),
        shown=True,
        solution=SimpleNamespace(shape=None, point=nothing, noise_variance=1.0),
        **left,
    )


CELL = known(promised=1.0)


@pytest.mark.parametrize(("raw", "white", "there"), [(1.2, 1.0, True), (1.2, 1.1, False), (1.3, 1.0, False)])
def test_beside_an_effect_white_errors_say_whether_anything_is_left_and_those_read_that_it_is_no_more_than_noise(
    raw, white, there
):
    """A cell that wanders leaves newtons that no law explains; an effect as slow leaves more of them than it may."""
    law, none = fit(raw), fit(raw, ())
    law.white = none.white = white**2
    assert at_floor(law, CELL) == there and not at_floor(none, CELL)
    assert explains_all(none, CELL) == there


def test_the_floor_of_white_errors_is_what_does_not_last_of_the_bench():
    """Of noise that lasts a few samples only, steps show most as well, and all of it would be taken for white."""
    hums = known(promised=1.0, lasting=Lasting(0.5625, 0.05))
    assert white_floor(fit(1.0), hums) == pytest.approx(0.8**2)
    left = fit(1.0)
    left.white = 0.9**2
    assert at_floor(left, CELL) and not at_floor(left, hums)


@pytest.mark.parametrize(("left", "believed"), [(1.02, True), (1.3, False), (9.0, False)])
def test_beside_a_large_effect_a_small_one_is_believed_when_it_explains_the_rest(left, believed):
    large = fit(10.0)
    found, _ = advanced(CELL, fit(1000.0, ()), large, [fit(left, ("law", "other"))])
    assert (found is not large) == believed


def test_a_law_leaves_a_hundredth_of_what_the_model_left_not_of_a_core_in_its_stead():
    cubic = known(promised=1.0, own_mse=23.0**2)
    large, more = fit(3.0), fit(1.5, ("law", "other"))
    assert advanced(CELL, fit(100.0, ()), large, [more])[0] is large
    assert advanced(cubic, fit(100.0, ()), large, [more])[0] is more
    moved = known(promised=1.0, as_is_mse=100.0**2)
    assert advanced(moved, fit(23.0, ()), large, [more])[0] is large  # a bench's core that moved had hidden most of it


def test_what_takes_a_little_of_what_a_core_never_had_right_is_not_its_cause():
    """11.5 N on a new record, 10 on the bench, 8.8 of noise, as friction that the bench did not show (LuGre) leaves."""
    noise = 8.8
    bench = known(promised=10.0)

    def leaves(rms, words=("law",)):
        one = fit(rms, words)
        one.plateau = noise
        return one

    nothing = leaves(11.5, ())
    assert not mostly(nothing, leaves(10.8), bench)
    assert mostly(nothing, leaves(10.2), bench)  # nearly as exact as on the bench
    assert not mostly(leaves(9.9, ()), leaves(9.6), bench)  # more exact than there already
    assert not mostly(leaves(10.1, ()), leaves(9.9), bench)  # or hardly less
    assert mostly(leaves(9.9, ()), leaves(9.0), bench)


def test_more_than_noise_is_said_before_it_is_much():
    assert [(shows(fit(x), CELL), far_above(fit(x), CELL)) for x in (1.2, 1.3, 2.1)] == [
        (False, False), (True, False), (True, True),
    ]  # fmt: skip


@pytest.mark.parametrize(("left", "grade"), [(1.02, "strong"), (1.2, "weak")])
def test_nothing_is_missing_for_sure_only_at_the_floor(left, grade):
    assert grade_of(CELL, Verdict(("none",), fit(left, ()), ())) == grade


def curve(channel, removed):
    return Followed(channel, tuple(channel.split(" * ")), 100.0 - removed, 100.0 - removed, removed)


def test_one_channel_goes_before_a_product_with_it_that_says_hardly_more():
    product, alone, other = curve("bleed * oil", 90.2), curve("bleed", 90.0), curve("coil", 60.0)
    assert clearest([product, alone, other]) == (alone, product, other)
    assert grade_of(CELL, Verdict(("unknown",), fit(9.0, ()), clearest([product, alone, other]))) == "strong"


def test_what_two_channels_say_as_well_cannot_be_told():
    """A load cell that walks away follows whatever else walks."""
    both = clearest([curve("temperature_degC", 90.0), curve("vibration_mm_s", 89.8)])
    assert grade_of(CELL, Verdict(("unknown",), fit(9.0, ()), both)) == "cannot be told"


def test_what_hides_in_the_tremble_of_a_reading_is_not_missed():
    """A cell that drifts by 2 N beside 1 N of noise: alone it shows, beside 5 N of a reading's noise it does not."""
    drifts = fit(2.0, ())
    drifts.plateau = 1.0
    still = known(promised=1.0)
    assert shows(drifts, still)
    assert not shows(drifts, SimpleNamespace(**{**vars(still), "tremble": 25.0}))


def test_without_effects_no_more_is_left_than_the_model_leaves_as_it_is():
    """A core that moves on some blocks may do worse on the others: 67 N -> 83 N was printed beside `unknown`."""
    base = SimpleNamespace(own_mse=np.inf, as_is_mse=67.0**2)
    assert left(fit(83.0, ()), base) == 67.0**2
    assert left(fit(83.0), base) == 83.0**2
