"""Which of several fits is the verdict, from what they leave block by block."""

from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.diagnose.search import better, ranking
from thrustd.diagnose.search.base import base_of
from thrustd.diagnose.search.better import (
    ahead,
    borrowed,
    fewest,
    gained,
    inexact,
    likely,
    look_alikes,
    margin,
    rivals,
    untold,
    ways,
)
from thrustd.diagnose.search.ranking import pruned, settled
from thrustd.diagnose.search.records import stretches
from thrustd.model.artifact import LedgerEntry

RNG = np.random.default_rng(3)
COMMON = RNG.normal(size=48)


def known(**more: float) -> SimpleNamespace:
    """What is known beforehand of a mount with a bench, whose model removed nothing yet."""
    nothing = {"own_mse": np.inf, "as_is_mse": np.inf, "explained": 0.0, "own_plateau": np.inf}
    return SimpleNamespace(**nothing | {"least": 0.0, "tremble": 0.0, "lasting": None} | more)


def _fit(words: str, level: float, scatter: float) -> SimpleNamespace:
    """Leaves `level` on average, block by block differently by `scatter`."""
    block_mse = level + scatter * (COMMON - COMMON.mean())
    mse = float(block_mse.mean())
    left = {"block_mse": block_mse, "block_white": block_mse, "block_size": np.ones(48), "mse": mse, "white": mse}
    return SimpleNamespace(terms=tuple(words), shown=True, strain=0.0, moved=0.0, walked=0.0, **left)


def test_a_member_that_alone_is_not_told_from_nothing_is_no_verdict():
    """Told from nothing together, not told from the pair alone, nor from nothing: the pair stays."""
    nothing, alone, pair = _fit("", 1.0, 0.0), _fit("m", 0.9, 0.3), _fit("mr", 0.8, 0.3)
    pair.block_mse[:] = np.linspace(0.7, 0.9, 48)[RNG.permutation(48)]
    assert gained(nothing, pair)
    assert not gained(nothing, alone)
    assert not gained(alone, pair)
    assert fewest([nothing, alone, pair], pair) is pair


def test_of_two_sets_the_one_that_leaves_less_white_is_better_whichever_leaves_more_as_read():
    """A cell that wanders by chance as a law does makes no law."""
    nothing, law, chance = _fit("", 1.0, 0.0), _fit("m", 0.85, 0.01), _fit("r", 0.8, 0.01)
    law.white, chance.white = 0.7, 0.75
    law.block_white, chance.block_white = law.block_mse - 0.15, chance.block_mse - 0.05
    assert gained(chance, law) and not gained(law, chance) and ahead(law, chance)
    assert untold(law, [law, chance]) == [law]
    assert fewest([nothing, law, chance], law) is law


def test_the_smaller_set_that_is_told_from_nothing_is_named():
    nothing, alone, pair = _fit("", 1.0, 0.0), _fit("m", 0.805, 0.03), _fit("mr", 0.8, 0.03)
    assert gained(nothing, alone)
    assert fewest([nothing, alone, pair], pair) is alone


def test_an_effect_that_spares_core_or_cell_most_of_their_way_is_worth_as_much_as_one_that_leaves_less():
    nothing, drift = _fit("", 1.0, 0.0), _fit("m", 1.01, 0.0)
    nothing.moved, nothing.walked, nothing.strain = 36.0, 24.0, 60.0  # squared sigmas
    drift.moved, drift.walked, drift.strain = 33.0, 6.0, 41.0
    assert gained(nothing, drift)
    drift.moved, drift.walked, drift.strain = 20.0, 22.0, 42.0  # neither spared most: the bench knew less than it says
    assert not gained(nothing, drift)
    drift.moved, drift.walked, drift.strain = 33.0, 6.0, 55.0  # what the effect itself costs counts
    assert not gained(nothing, drift)


def test_a_curve_that_explains_more_than_the_core_moves_beside_it_is_not_borrowed_from_the_core():
    laws = _fit("m", 3.0, 0.0)
    laws.solution = SimpleNamespace(noise_variance=1.0)
    laws.moved = 2.0
    curve = SimpleNamespace(white=1.0, moved=26.0, walked=0.0, noise_variance=10.0)  # explains 96
    assert not borrowed(curve, laws)
    laws.solution.noise_variance = 10.0
    assert borrowed(curve, laws)
    curve.noise_variance = 1.0  # the laws' residual has in it what they do not explain
    assert not borrowed(curve, laws)
    curve.noise_variance = 10.0
    curve.moved = 10.0  # not surely further than beside the laws
    assert not borrowed(curve, laws)


def test_rivals_are_other_laws_of_the_same_effects_that_leave_as_little():
    def by(law: str, level: float, scatter: float = 0.0, start: float = 1.0) -> SimpleNamespace:
        fit = _fit("m", level, scatter)
        fit.terms = (SimpleNamespace(effect=SimpleNamespace(name=law), fixed={"settling_h": start}),)
        fit.words = (law.partition("_")[0],)
        return fit

    best, alike, worse, unsure = by("m", 1.0), by("m_spring", 1.01, 0.1), by("m_late", 1.2), by("m_lag", 1.2, 1.0)
    assert rivals(best, [by("m_told", 1.01)]) == []  # by little, but in every block
    found = rivals(best, [best, alike, worse, unsure, by("m", 1.005), by("r", 1.0)])
    assert [one is alike for one in found] == [True]
    elsewhere = by("m", 1.01, 0.1, start=1000.0)
    assert rivals(best, [best, elsewhere]) == [elsewhere]
    assert likely(best, [best, worse, unsure, by("m_told", 1.01), by("r", 1.0)]) == []
    shares = [likely(best, [by("m_late", level, 0.1)])[0][1] for level in (1.0, 1.0299, 1.0301)]
    assert shares[0] > 0.99 and 0.05 < shares[2] < shares[1] < shares[2] + 0.01  # nothing is lost by a hair


def test_a_cycle_that_is_repeated_is_one_trial_and_a_motion_of_many_speeds_many():
    t = np.arange(4800) / 100.0

    def leaves(residual: np.ndarray) -> SimpleNamespace:
        found = SimpleNamespace(normal=SimpleNamespace(residuals=[residual]))
        return SimpleNamespace(solution=found, mse=float(np.nanmean(residual**2)))

    best, gap = leaves(np.where(t < 1.0, np.nan, 0.1)), np.where(t < 1.0, np.nan, 1.0)
    one, many = (
        leaves(0.1 + gap * motion) for motion in (np.sin(4 * np.pi * t), np.random.default_rng(0).normal(size=4800))
    )
    assert ways(one, best) == pytest.approx(1.0, abs=0.2) and ways(many, best) > 1000
    fresh = known(as_is_mse=one.mse)
    assert margin(fresh, one, best) == pytest.approx(0.0384 * 0.5, rel=0.2)  # 0.2 of a force of 0.7
    assert margin(fresh, many, best) < 1e-4


def test_what_the_laws_miss_by_is_the_same_in_one_round_and_in_two():
    """11 of 12 N in a first `extend`, or in this search: what is found next has to be more than a tenth of it."""
    nothing, first, best = (SimpleNamespace(mse=force_n**2) for force_n in (12.0, 5.0, 3.0))
    at_once = known(as_is_mse=nothing.mse)
    model = mount()
    said = [LedgerEntry("hysteresis", 12.0, 5.0), LedgerEntry("creep", 4.0, 5.0)]  # the second one gained nothing
    grown = msgspec.structs.replace(model, ledger=said)
    scene = stretches(model, [record(n=6000)])
    told, plain = base_of(grown, scene), base_of(model, scene)
    assert plain.explained == 0.0
    assert told.explained * told.scale**2 == pytest.approx(nothing.mse - first.mse)
    later = known(as_is_mse=first.mse, explained=nothing.mse - first.mse)
    assert inexact(later, first, best) == pytest.approx(inexact(at_once, nothing, best))


def test_look_alikes_are_the_smallest_sets_within_the_margin():
    def of(words: str, level: float) -> SimpleNamespace:
        fit = _fit(words, level, 0.0)
        fit.words = tuple(words)
        return fit

    best = of("hmv", 1.0)
    fits = [best, of("hmr", 1.2), of("hm", 1.3), of("mv", 1.9), of("hmvr", 1.0), of("d", 1.25)]
    assert look_alikes(best, fits) == ()
    assert look_alikes(best, fits, 0.35) == ("d", "h+m")


def test_a_member_that_pruning_leaves_alone_is_one_of_the_sets_that_were_estimated(monkeypatch):
    """Estimated beside others only, it was found nowhere by the look for its best law: a traceback."""
    both = tuple(SimpleNamespace(effect=SimpleNamespace(name=name, word=name)) for name in ("m", "r"))
    leaves = {(): 1.0, ("m",): 0.8, ("r",): 0.9, ("m", "r"): 0.8}

    def estimate(base, records, terms, *_):
        fit = _fit("", leaves[tuple(term.effect.name for term in terms)], 0.0)
        fit.terms, fit.words = tuple(terms), tuple(term.effect.name for term in terms)
        return fit

    monkeypatch.setattr(ranking, "joint_fit", estimate)
    monkeypatch.setattr(better, "numbers_of", lambda fit: 1)
    monkeypatch.setattr(better, "unlikely", lambda fit, noise: fit.mse)
    nothing, pair = estimate(None, (), ()), estimate(None, (), both)
    pair.solution = nothing.solution = SimpleNamespace(noise_variance=1.0)
    fits = [nothing, pair]
    alone = pruned(None, (), nothing, pair, fits)
    alone.solution = pair.solution
    assert alone.words == ("m",)
    assert settled(None, (), SimpleNamespace(looked=[], nothing=nothing), fits, alone) is alone
