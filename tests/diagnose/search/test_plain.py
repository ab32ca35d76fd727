"""What of an effect other laws and other starts dispute."""

from dataclasses import replace

from tests.diagnose.scene import mount, record
from thrustd.diagnose.search.better import rivals
from thrustd.diagnose.search.joint import joint_fit
from thrustd.diagnose.search.library import terms_of
from thrustd.diagnose.search.plain import elsewhere
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
        others = elsewhere(question.base, question.rows, best, question.rig)
        assert [other.terms[0].fixed["settling_h"] for other in others] == [1.0]
        alone, wide = (estimates_of(question.base, best, same)[0] for same in ((), rivals(best, others)))
        assert abs(alone.value - 0.2) > alone.half_width
        inside.append(abs(wide.value - 0.2) < wide.half_width)
    assert sum(inside) >= 9


def test_an_effect_that_another_fit_does_without_is_disputed():
    question = asked(mount(), [record([EffectSpec("ageing", SETTLING)])], NOTHING)
    best = joint_fit(question.base, question.rows, (next(terms_of(effect_named("ageing"), question.rig)),))
    number = best.new.start - question.base.shape.parts()["terms"].start
    moved = best.solution.point.terms.copy()
    moved[number] = 0.0
    without = replace(best, solution=replace(best.solution, point=replace(best.solution.point, terms=moved)))
    assert disputed(best, [without]) == {"ageing"}
    assert disputed(best, [best]) == set()
