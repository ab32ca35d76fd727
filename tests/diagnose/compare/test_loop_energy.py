"""A passive mount takes energy from every cycle; a record in which it gives some has a turned sign."""

import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.diagnose.compare.loop_energy import loop_energy
from thrustd.records.recording import make_recording
from thrustd.records.roles import Roles, with_roles

DT_S = 0.02


def rig(loss=40.0, noise=5.0, seed=0, n=6000, name="x"):
    """A spring of 1000 N/mm with a friction of `loss` N, moved at three frequencies that do not go together."""
    rng, t = np.random.default_rng(seed), np.arange(n) * DT_S
    x = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (0.11, 0.17, 0.37)) / 3
    force = 1000 * x + 200 * x**3 + loss * np.tanh(np.gradient(x, DT_S) / 0.02) + rng.normal(0, noise, n)
    return make_recording(name, {"time_s": t, "deformation_mm": x + rng.normal(0, 3e-4, n), "force_N": force})


@pytest.mark.parametrize("column", ["force_N", "deformation_mm"])
def test_a_turned_sign_is_said(column):
    turned = rig().with_channels(**{column: -rig()[column]})
    energy = loop_energy(turned)
    assert energy.delivers and energy.mean_n == pytest.approx(-40, rel=0.15)
    assert "this mount would deliver energy" in energy.sentence([turned])
    assert "sign of force_N or of deformation_mm?" in energy.sentence([turned])


def test_the_energy_is_that_of_the_loops():
    healthy = loop_energy(rig())
    assert healthy.mean_n == pytest.approx(40, rel=0.15) and not healthy.delivers
    assert healthy.sentence([rig()]) == ""


def test_a_mount_of_the_scene_is_healthy_and_its_negative_is_not():
    data = record()
    assert not loop_energy([data]).delivers
    assert loop_energy([data.with_channels(force_N=-data["force_N"])]).delivers
    assert mount().effects == []  # relaxation alone dissipates


def test_a_spring_without_loss_is_not_suspected():
    assert not any(loop_energy(rig(loss=0.0, seed=seed)).delivers for seed in range(40))


def test_over_a_speed_the_way_is_its_integral():
    base = rig()
    speed = np.gradient(base["deformation_mm"] * 0.1, DT_S)
    over = with_roles(base.with_channels(v_cm_s=speed, f_N=-base["force_N"]), Roles("v_cm_s", "f_N"))
    energy = loop_energy(over)
    assert energy.delivers and "sign of f_N or of v_cm_s?" in energy.sentence([over])
    assert "does v_cm_s drive and f_N move" in energy.sentence([over])


def test_volts_times_what_they_move_are_no_work():
    """A piezo stack, whose displacement follows its voltage late, was asked for its sign."""
    turned = rig()
    stack = with_roles(
        turned.with_channels(drive_V=turned["deformation_mm"], x_um=-turned["force_N"]), Roles("drive_V", "x_um")
    )
    other = with_roles(
        turned.with_channels(x_mm=turned["deformation_mm"], f_kN=-turned["force_N"]), Roles("x_mm", "f_kN")
    )
    assert loop_energy(other).delivers and not loop_energy(stack).delivers


def test_too_little_to_judge_is_not_judged():
    assert not loop_energy(rig(n=25)).delivers
    still = rig().with_channels(deformation_mm=np.zeros(6000))
    assert not loop_energy(still).delivers
