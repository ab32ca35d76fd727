"""What of an effect other laws and other starts dispute."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.scene import inertia, mount, record
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search import plain as plains
from thrustd.diagnose.search.better import likely
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.joint import joint_fit
from thrustd.diagnose.search.library import terms_of
from thrustd.diagnose.search.plain import elsewhere, plain
from thrustd.diagnose.search.question import NOTHING, asked
from thrustd.diagnose.search.told import disputed, estimates_of
from thrustd.model.artifact import EffectSpec
from thrustd.model.effects import effect_named

SETTLING = {"ageing_1_h": 0.2, "settling_h": 1.5, "reference_s": 0.0}


def test_how_fast_it_ages_at_first_is_as_unsure_as_how_soon_it_settles():
    """Ten minutes do not tell 1.5 h of settling from none; the rate at the start depends on it. Ten draws, for 95 %."""
    inside = []
    for seed in range(10):
        question = asked(mount(), [record([EffectSpec("ageing", SETTLING)], seed=seed)], NOTHING)
        straight = next(terms_of(effect_named("ageing"), question.rig))
        best = joint_fit(question.base, question.rows, (straight,))
        ends = elsewhere(question.base, question.rows, best, question.rig)
        others = [end for end in (ends[0], *ends[1]) if end is not best]
        assert [other.terms[0].fixed["settling_h"] for other in others] == [1.0]
        alone, wide = (estimates_of(question.base, best, same)[0] for same in ((), likely(best, others)))
        assert abs(alone.value - 0.2) > alone.half_width
        inside.append(abs(wide.value - 0.2) < wide.half_width)
    assert sum(inside) >= 9


def test_a_shape_that_its_start_did_not_let_go_is_estimated_where_it_is_likelier():
    """From a straight line how soon a rubber settles hardly shows: it stayed one, and left 12.6 N."""
    settles = {"ageing_1_h": 0.3, "settling_h": 0.1, "reference_s": 0.0}
    question = asked(mount(), [record([EffectSpec("ageing", settles)])], NOTHING)
    base, straight = question.base, next(terms_of(effect_named("ageing"), question.rig))
    stuck = joint_fit(base, question.rows, (straight,))
    best, others = elsewhere(base, question.rows, stuck, question.rig)
    values = best.terms[0].values(best.solution.point.terms[base.shape.sizes["terms"] :])
    assert values["settling_h"] == pytest.approx(0.1, rel=0.1) and values["ageing_1_h"] == pytest.approx(0.3, rel=0.1)
    assert best.mse < 0.95 * stuck.mse and any(other is stuck for other in others)


def test_a_law_gives_way_to_a_plainer_one_that_leaves_as_little_not_to_one_that_leaves_more_in_few_blocks(monkeypatch):
    """On an elastomer a plain ladder of relaxation left 1.4 times the squared error of a curved one."""
    question = asked(mount(), [record(n=3000)], NOTHING)
    curved = joint_fit(question.base, question.rows, (next(terms_of(effect_named("relaxation_power"), question.rig)),))

    def plainer(times: float):
        def fit(base, records, terms, *begun):
            times_each = np.r_[times, np.ones(len(curved.block_mse) - 1)]
            left = {name: getattr(curved, name) * times_each for name in ("block_mse", "block_white")}
            return replace(curved, terms=tuple(terms), **left)

        monkeypatch.setattr(plains, "joint_fit", fit)
        return plain(question.base, question.rows, curved, question.rig).terms[0].effect.name

    assert plainer(1.0) == "relaxation_maxwell"
    assert plainer(100.0) == "relaxation_power"


def test_an_effect_that_another_fit_does_without_is_disputed():
    question = asked(mount(), [record([EffectSpec("ageing", SETTLING)])], NOTHING)
    best = joint_fit(question.base, question.rows, (next(terms_of(effect_named("ageing"), question.rig)),))
    number = best.new.start - question.base.shape.parts()["terms"].start
    moved = best.solution.point.terms.copy()
    moved[number] = 0.0
    without = replace(best, solution=replace(best.solution, point=replace(best.solution.point, terms=moved)))
    assert disputed(best, [without]) == {"ageing"}
    assert disputed(best, [best]) == set()


def test_another_law_is_asked_for_the_size_of_what_it_does_not_for_a_number_of_the_same_name():
    """On a drive a skewed Bouc-Wen, whose friction_n is no half width, made 21 +- 2 N of friction 21 +- 21 N."""
    friction = EffectSpec("hysteresis", {"friction_n": 150.0, "yield_mm": 0.02, "deadband_mm": 0.0})
    question = asked(mount(), [record([friction], n=6000)], NOTHING)

    def fitted(law: str, **fixed: float):
        term = next(terms_of(effect_named(law), question.rig))
        return joint_fit(question.base, question.rows, (replace(term, fixed=term.fixed | fixed, shapes=False),))

    best = fitted("hysteresis", yield_mm=0.02)
    skewed = fitted("hysteresis_bouc_wen", gamma=-0.45, exponent=1.0, yield_mm=0.1)
    (own, *_), (wide, *_), (other, *_) = (
        estimates_of(question.base, *given) for given in ((best,), (best, [(skewed, 1.0)]), (skewed,))
    )
    assert own.std < wide.std < 0.5 * abs(other.value - own.value)


def test_what_is_named_has_the_same_intervals_where_it_is_added():
    """`diagnose` and `extend` compared it with whatever laws each of them had come by."""
    friction = EffectSpec("hysteresis", {"friction_n": 150.0, "yield_mm": 0.02, "deadband_mm": 0.0})
    records = [record([friction, inertia(60.0)], n=6000)]
    found = diagnose(mount(), records)
    assert set(found.verdict) == {"hysteresis", "axial_inertia"}
    told = {(p.effect, p.name): p.interval for one in found.candidates if one.in_verdict for p in one.parameters}
    added = extend(mount(), records, found.verdict)
    assert {(p.effect, p.name): p.interval for p in added.parameters} == told
