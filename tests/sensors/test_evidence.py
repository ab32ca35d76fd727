"""The bank's evidence on rows whose fault is known: each is found, an old one stays found, a healthy engine is left."""

import numpy as np
import pytest

from thrustd.core.aircraft import Installed
from thrustd.fusion.mixture import Weighed, mix
from thrustd.sensors import evidence, onsets
from thrustd.sensors.bank import BY_MOUNTS
from thrustd.sensors.lead import lead_of
from thrustd.sensors.past import (
    COUNTS,
    DECK_N,
    LOG_FLOW,
    MACH,
    MOUNT_RATE_N_S,
    N_SOURCES,
    OWN_N,
    PER_FUEL_N,
    PRESSURE_PA,
    RATE_N_S,
    SAID,
    T_S,
    WIDTH,
    no_past,
    remember,
)

SHARE = 0.46
INSTALLED = Installed(200.0, 0.03, 0.03, 30.0, 0.0, 0.0, 0.006, 0.0)


def said_of(thrust_n, fault, rng):
    """By source, N: a healthy engine's own deviations, and the fault (5,)."""
    healthy = np.array([SHARE * thrust_n, (1 - SHARE) * thrust_n, 1.02 * thrust_n, 1.05 * thrust_n, 0.97 * thrust_n])
    return healthy + fault + rng.normal(0, 5.0, N_SOURCES)


def flown(fault_of, seconds=600.0, thrust_of=lambda t_s: 3000.0, silent=(), pause_s=(np.inf, np.inf),
          pressure_pa=lambda t_s: 0.0):  # fmt: skip
    """What is remembered, every 0.4 s; `fault_of` the time -> (5,). Nobody looks during a pause."""
    rng, past = np.random.default_rng(0), no_past(1)
    for k in range(round(seconds / 0.4)):
        t_s, row = 0.4 * k, np.zeros(WIDTH)
        if pause_s[0] <= t_s < pause_s[1]:
            continue
        row[T_S], row[MACH], row[DECK_N] = t_s, 0.3, 60.0 + 0.034 * thrust_of(t_s)
        row[PER_FUEL_N], row[LOG_FLOW] = 1.5 * thrust_of(t_s), np.log(thrust_of(t_s) / 30_000.0)  # near enough
        row[SAID : SAID + N_SOURCES] = said_of(thrust_of(t_s), np.array(fault_of(t_s)), rng)
        row[MOUNT_RATE_N_S] = thrust_of(t_s) - thrust_of(t_s - 0.4)
        row[COUNTS : COUNTS + N_SOURCES] = [i not in silent for i in range(N_SOURCES)]
        row[OWN_N : OWN_N + 2], row[PRESSURE_PA] = 30.0, pressure_pa(t_s)
        assert remember(past, 0, row, SHARE)
        yield past["rows"][0], int(past["n"][0])


def weighed(*args, **more):
    """(n, N_HYPOTHESES, 3): probability, thrust and variance by hypothesis, every second; see `flown`."""
    out, found, lead, heard = np.zeros((onsets.N_HYPOTHESES, 3)), [], onsets.WELL, np.zeros(1, onsets.HEARD)
    for k, (rows, n) in enumerate(flown(*args, **more)):
        if n > 2 and k % 5 == 0:
            evidence.weigh(rows, n, SHARE, lead, INSTALLED, heard[0], out)
            lead = int(out[:, 0].argmax()) if out[:, 0].max() > 0.95 else lead
            found.append(out.copy())
    return np.array(found)


def test_a_healthy_engine_is_left_alone():
    rows = weighed(lambda t_s: [0.0] * 5, thrust_of=lambda t_s: 3000.0 + 2000.0 * (t_s > 300))
    assert rows[:, onsets.WELL, 0].min() > 0.7
    assert np.allclose(rows[:, :, 0].sum(axis=1), 1.0)
    assert np.sqrt(rows[-1, onsets.WELL, 2]) < 60.0


@pytest.mark.parametrize(("fault", "which"), [
    ((400, 0, 0, 0, 0), onsets.UPPER_OFF), ((0, -400, 0, 0, 0), onsets.LOWER_OFF),
    ((460, 540, 0, 0, 0), onsets.MOUNTS_OFF), ((0, 0, 1200, 0, 0), onsets.FUEL_OFF),
    ((0, 0, 0, -1200, 0), onsets.N1_OFF), ((0, 0, 0, 0, 1500), onsets.N2_OFF),
])  # fmt: skip
def test_a_fault_is_found_and_the_thrust_is_that_of_before(fault, which):
    rows = weighed(lambda t_s: fault if t_s > 300 else [0.0] * 5, 360.0)
    assert rows[-1, :, 0].argmax() == which
    assert rows[-1, which, 0] > 0.9
    thrust_n, std_n = rows[-1, which, 1], np.sqrt(rows[-1, which, 2])
    assert abs(thrust_n - 3000.0) < 3.0 * std_n


def test_agreement_that_says_nothing_ends_no_fault():
    """Found at idle, still there ten minutes later at an eightfold thrust."""
    rows = weighed(lambda t_s: (500, 0, 0, 0, 0) if t_s > 60 else [0.0] * 5, 700.0,
                   lambda t_s: 1000.0 if t_s < 120 else 8000.0)  # fmt: skip
    assert (rows[-100:, onsets.UPPER_OFF, 0] > 0.9).all()


def test_both_mounts_that_drift_are_in_the_band_from_three_sigma_of_the_deck_on_and_found_at_six():
    rows = weighed(lambda t_s: np.array((0.46, 0.54, 0, 0, 0)) * 200.0 * max(t_s - 300.0, 0.0) / 60.0, 600.0)
    drift_n, off = 200.0 * (2.0 * np.arange(len(rows)) - 300.0) / 60.0, rows[:, onsets.MOUNTS_OFF, 0]
    assert (off[drift_n > 3.0 * 162.0] > 0.025).all()  # so the band holds it
    assert (off[drift_n > 6.0 * 162.0] > 0.9).all()


def test_a_source_that_is_silent_says_nothing():
    rows = weighed(lambda t_s: (0, 0, 9e3, 0, 0) if t_s > 100 else [0.0] * 5, 200.0, silent=(2,))
    assert rows[-1, onsets.WELL, 0] > 0.7


def test_a_fuel_flow_that_leads_a_throttle_moved_in_a_pause_is_left_alone():
    def thrust_n(t_s):
        return 700.0 + 1400.0 * min(max(t_s - 300.0, 0.0), 7.0)

    def lead(t_s):
        return [0.0, 0.0, 0.25 * thrust_n(t_s) if t_s > 300.0 else 0.0, 0.0, 0.0]

    rows = weighed(lead, 310.0, thrust_n, pause_s=(300.0, 306.0))
    assert rows[-4:, onsets.FUEL_OFF, 0].max() < 0.5


def test_air_that_is_bled_is_no_fault_of_the_fuel_flow():
    """Anti-ice on at 3000 N, then off: 6 % more fuel, which the deck takes for 8 % more thrust."""
    rows = weighed(lambda t_s: (0, 0, 240.0 if 300 < t_s < 450 else 0, 0, 0), 600.0)
    assert rows[:, onsets.FUEL_OFF, 0].max() < 0.3
    assert rows[:, [onsets.WELL, onsets.BLED], 0].sum(axis=1).min() > 0.6
    assert np.abs(rows[:, onsets.WELL, 1] - 3000.0).max() < 60.0


def test_a_fuel_flow_that_is_off_by_far_more_is_not_taken_for_bled_air():
    rows = weighed(lambda t_s: (0, 0, 900.0 if t_s > 300 else 0, 0, 0), 360.0)
    assert rows[-1, onsets.FUEL_OFF, 0] > 0.95


def test_an_installation_that_errs_as_the_file_says_is_nobody_s_fault():
    """A nacelle's drag of one sigma at a steady thrust, then at idle and fast: healthy mounts are not found."""

    def drag_n(t_s):
        return -0.03 * 20_000.0 * min(t_s / 300.0, 1.0)

    share = np.array((SHARE, 1.0 - SHARE, 0.0, 0.0, 0.0))
    rows = weighed(lambda t_s: drag_n(t_s) * share, 600.0, lambda t_s: 3000.0 if t_s < 300.0 else 900.0,
                   pressure_pa=lambda t_s: 20_000.0 * min(t_s / 300.0, 1.0))  # fmt: skip
    nobodys = rows[:, list(onsets.NOBODYS), 0].sum(axis=1)
    assert rows[-1, :, 0].argmax() == onsets.INSTALLED_OFF and nobodys.min() > 0.9
    assert lead_of(onsets.WELL, rows[-1]) == onsets.WELL  # the filter goes on, and the mixture holds it
    assert abs(rows[-1, onsets.INSTALLED_OFF, 1] - 900.0) < abs(rows[-1, onsets.WELL, 1] - 900.0)


@pytest.mark.parametrize("who", [(0, 0, 0, -1, -1), (SHARE, 1.0 - SHARE, 1, 0, 0)])
def test_both_spools_or_all_else_drift_alike_and_the_band_holds_either(who):
    rows = weighed(lambda t_s: np.array(who) * 4.0 * max(t_s - 300.0, 0.0), 700.0)
    last = rows[-1]
    assert last[[onsets.SPOOLS_OFF, onsets.BUT_SPOOLS_OFF], 0].sum() > 0.9 and last[:, 0].max() < 0.98
    lead = onsets.WELL
    said = np.stack([last[:, 0], last[:, 1] - last[lead, 1], np.sqrt(last[:, 2])], axis=1)
    thrust_n, std_n = mix(last[lead, 1], float(said[lead, 2]), Weighed(said, lead, 0.0, BY_MOUNTS))
    assert abs(thrust_n - 3000.0) < 1.96 * std_n


def test_no_engine_moves_with_a_source_that_jumps_alone():
    past = no_past(1)
    for k in range(200):
        row, fault = np.zeros(WIDTH), np.array([0, 0, -600.0 * (k >= 190), 0, 0])
        row[T_S], row[MACH], row[DECK_N], row[PER_FUEL_N] = 0.4 * k, 0.3, 160.0, 4500.0
        row[SAID : SAID + N_SOURCES] = said_of(3000.0, fault, np.random.default_rng(k))
        row[COUNTS : COUNTS + N_SOURCES] = 1.0
        assert remember(past, 0, row, SHARE)
    assert past["rows"][0, 0, RATE_N_S] < 10.0


def test_mounts_and_brochure_that_agree_prove_no_more_than_the_better_of_both():
    """Crosstalk: both mounts 10 % high beside a brochure that is 8 % high."""
    out, heard, thrust_n = np.zeros((onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD), 9000.0
    high = np.array((0.10 * SHARE, 0.10 * (1 - SHARE), 0.06, 0.03, 0.11)) * thrust_n  # beside what is healthy
    *_, (rows, n) = flown(lambda t_s: high, 60.0, lambda t_s: thrust_n)
    evidence.weigh(rows, n, SHARE, onsets.WELL, INSTALLED, heard[0], out)
    said = out[onsets.WELL, 1:]
    more_n2 = evidence.uncorrected_n2(rows, n, SHARE, np.zeros(N_SOURCES), INSTALLED, said)
    assert 800.0 < said[0] - thrust_n < 3.0 * np.sqrt(said[1] + more_n2) < 1200.0


def sigma_n(apart_n, installed):
    """Of the estimate, and how far it is from 3 kN, where both mounts show so much more than that and all others."""
    out, heard = np.zeros((onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD)
    high = apart_n * np.array((SHARE, 1 - SHARE, 0.0, 0.0, 0.0))
    *_, (rows, n) = flown(lambda t_s: high, 300.0)
    evidence.weigh(rows, n, SHARE, onsets.WELL, installed, heard[0], out)
    thrust_n, variance_n2 = said = out[onsets.WELL, 1:]
    more_n2 = evidence.uncorrected_n2(rows, n, SHARE, np.zeros(N_SOURCES), installed, said)
    return np.sqrt(variance_n2 + more_n2), abs(thrust_n - 3000.0)


def test_where_mounts_and_brochure_differ_by_more_than_they_should_no_mean_of_both_has_a_smaller_sigma():
    """An installation that a tethered run has measured: 48 N whatever they differed by, 600 N were 12 sigmas."""
    measured = Installed(20.0, 0.003, 0.01, 10.0, 0.0, 0.0, 0.006, 0.0)
    agree_n, _ = sigma_n(0.0, measured)
    assert sigma_n(100.0, measured)[0] == pytest.approx(agree_n, rel=0.1)  # as much as they should
    for apart_n in (-900.0, -600.0, 600.0, 900.0):
        std_n, far_n = sigma_n(apart_n, measured)
        assert std_n > 2.5 * agree_n and far_n < 4.0 * std_n


@pytest.mark.parametrize("apart_n", [-900.0, -600.0, -350.0, 350.0, 600.0, 900.0])
def test_a_fault_of_both_mounts_behind_a_tethered_run_is_in_three_sigmas_where_the_brochure_is_right(apart_n):
    """A stranger's flights: rubber 12 % stiffer, a gain lost in the roll; 590 N at a sigma of 166, untold for 59 s."""
    measured = Installed(20.0, 0.003, 0.01, 10.0, 0.0, 0.0, 0.006, 0.0)
    std_n, far_n = sigma_n(apart_n, measured)
    assert far_n < 3.0 * std_n


def test_without_a_brochure_no_fault_of_both_mounts_is_bounded():
    measured = Installed(20.0, 0.003, 0.01, 10.0, 0.0, 0.0, 0.006, 0.0)
    out, heard, off = np.zeros((onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD), np.zeros(N_SOURCES)
    off[2:] = 1.0
    *_, (rows, n) = flown(lambda t_s: [0.0] * 5, 60.0)
    evidence.weigh(rows, n, SHARE, onsets.WELL, measured, heard[0], out)
    said = evidence._said(rows, n, (SHARE, 1.0 - SHARE, 1.0, 1.0, 1.0), off, measured)
    assert np.sqrt(said[1] + evidence.uncorrected_n2(rows, n, SHARE, off, measured, np.array(said))) < 150.0


@pytest.mark.parametrize("apart_n", [-300.0, -200.0, 200.0, 300.0])
def test_mounts_that_changed_since_they_were_measured_are_in_three_sigmas_as_far_as_the_brochure_cannot_tell(apart_n):
    """Softer rubber, or a gap that has grown: by ten of its sigmas, and within two of the brochure's."""
    measured = Installed(20.0, 0.0, 0.01, 10.0, 0.0, 0.0, 0.006, 0.0, 0.003, zero_before_n=200.0, scale_before=0.03)
    std_n, far_n = sigma_n(apart_n, measured)
    assert far_n < 2.5 * std_n
    by_file = measured._replace(zero_before_n=20.0, scale_before=0.003)
    assert sigma_n(apart_n, by_file)[0] <= std_n
    assert sigma_n(0.0, by_file)[0] < 0.8 * sigma_n(0.0, measured)[0]


def taking_off(scale, deck, seconds, installed=INSTALLED, zero_n=0.0):
    """Estimate, sigma, truth so long after the throttle rests at 9 kN; mounts and deck err by these parts.

    `zero_n`: the mounts show so much more at every thrust.
    """
    out, heard, off = np.zeros((onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD), np.zeros(N_SOURCES)

    def thrust_of(t_s):
        return 600.0 + 8400.0 * min(max(t_s - 300.0, 0.0), 6.0) / 6.0

    errors = np.array((scale * SHARE, scale * (1 - SHARE), deck, deck, deck))
    zeros_n = zero_n * np.array((SHARE, 1 - SHARE, 0.0, 0.0, 0.0))
    *_, (rows, n) = flown(lambda t_s: errors * thrust_of(t_s) + zeros_n, 306.0 + seconds, thrust_of)
    evidence.weigh(rows, n, SHARE, onsets.WELL, installed, heard[0], out)
    more_n2 = evidence.uncorrected_n2(rows, n, SHARE, off, installed, out[onsets.WELL, 1:])
    beside = np.stack([out[:, 0], out[:, 1] - out[onsets.WELL, 1], np.sqrt(out[:, 2])], axis=1)
    weighed = Weighed(beside, onsets.WELL, np.sqrt(more_n2), BY_MOUNTS)
    return *mix(out[onsets.WELL, 1], beside[onsets.WELL, 2], weighed), thrust_of(306.0 + seconds)


@pytest.mark.parametrize("seconds", [2.0, 4.0, 8.0, 16.0])
@pytest.mark.parametrize("deck", [0.0, 0.06])
def test_a_wrong_scale_of_all_mounts_is_in_the_band_before_the_deck_can_show_it(deck, seconds):
    """Crosstalk of 15 %, in a take-off: N1 and fuel flow follow, so they say little yet, or err to the same side."""
    thrust_n, std_n, truth_n = taking_off(0.15, deck, seconds)
    assert abs(thrust_n - truth_n) < 3.0 * std_n


@pytest.mark.parametrize("zero_n", [-80.0, -40.0, 0.0])
@pytest.mark.parametrize("seconds", [8.0, 16.0])
def test_a_zero_that_hides_a_wrong_scale_at_idle_does_not_prove_it_right(zero_n, seconds):
    """The twin's crosstalk of 15 % beside a deck that errs to the same side: mounts and deck agree at idle."""
    thrust_n, std_n, truth_n = taking_off(0.165, 0.08, seconds, zero_n=zero_n)
    assert abs(thrust_n - truth_n) < 3.0 * std_n


def test_a_scale_that_was_measured_costs_less_band():
    """What is left in a take-off is a third of the brochure's sigma, which alone would see a fault of both mounts."""
    _, std_n, _ = taking_off(0.0, 0.0, 4.0, installed=INSTALLED._replace(zero_n=20.0, scale=0.0045))
    assert std_n < 0.7 * taking_off(0.0, 0.0, 4.0)[1]


def test_a_scale_that_a_tethered_run_has_told_is_doubted_as_any_fault_and_in_the_band_once():
    """The mounts' own sigma has what the run left of zero and scale; one hypothesis doubts the scale, less often."""
    out, heard = np.zeros((2, onsets.N_HYPOTHESES, 3)), np.zeros(1, onsets.HEARD)
    bare = INSTALLED._replace(zero_n=0.0, scale=0.0)
    *_, (rows, n) = flown(lambda t_s: [0.0] * 5, 60.0)
    more_n2 = []
    for said, installed in zip(out, (bare._replace(scale=0.03), bare._replace(told_scale=0.03)), strict=True):
        evidence.weigh(rows, n, SHARE, onsets.WELL, installed, heard[0], said)
        args = rows, n, SHARE, np.zeros(N_SOURCES), installed, said[onsets.WELL, 1:]
        more_n2.append(evidence.uncorrected_n2(*args))
    assert np.array_equal(out[0, onsets.SCALE_OFF, 1:], out[1, onsets.SCALE_OFF, 1:])
    assert 0.0 < out[1, onsets.SCALE_OFF, 0] < 0.1 * out[0, onsets.SCALE_OFF, 0]
    *_, (rows, n) = flown(lambda t_s: 900.0 * np.array((SHARE, 1.0 - SHARE, 0, 0, 0)), 60.0)  # 30 % since the start
    evidence.weigh(rows, n, SHARE, onsets.WELL, bare._replace(told_scale=0.004), heard[0], out[0])
    assert out[0, onsets.WELL, 0] < 0.1 and out[0, onsets.MOUNTS_OFF, 0] > 0.3  # or the brochure is, all of it
    *_, (rows, n) = flown(lambda t_s: [0.0] * 5, 60.0)
    plain = evidence.uncorrected_n2(rows, n, SHARE, np.zeros(N_SOURCES), bare, out[1, onsets.WELL, 1:])
    assert more_n2[0] > more_n2[1] == plain
