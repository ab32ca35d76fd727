"""Mounts whose axis leans: the aircraft's file says how far, a flight says it better, and the rest is in the band."""

import json
from itertools import product

import numpy as np
import pytest

from tests.commission.test_drag import flight
from tests.model.test_rigid_body import LOWER, SETTLE_S, UPPER, says_n, unloaded
from thrustd.__main__ import main
from thrustd.commission.drag import fit_drag, with_drag
from thrustd.core.aircraft import Cant
from thrustd.core.calibration import Calibration, read_calibration, write_calibration
from thrustd.core.errors import ConfigError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.installation.installation import Installation, read_installation
from thrustd.installation.shipped import shipped
from thrustd.sensors.errors import installed_n2
from thrustd.sensors.past import MORE_G, WIDTH
from thrustd.twin.installation import PLAIN, carried_parts
from thrustd.twin.mount import advance

HIL = read_installation(shipped("deploy/hil.toml", "config"))
FILE = "citation-ii.toml"
BOTH = "cant = { left = { deg = 2.0, std_deg = 0.5 }, right = { deg = -1.0, std_deg = 0.25 } }\n"


def with_cant(line: str) -> Installation:
    return Installation(HIL.config, {**HIL.files, FILE: line.encode() + HIL.files[FILE]}, "test")


def leaning_mm(thrust_n: float, load_g: float, cant_deg: float) -> np.ndarray:
    """Of left upper and lower in the twin, without friction."""
    knobs, accel_g = PLAIN._replace(cant_deg=cant_deg), np.array([[0.0], [0.0], [load_g]])
    loads_n, ends = carried_parts(0.4603, knobs, np.array([thrust_n]), accel_g, 0.0)[:, 0], []
    for physics, load_n in zip((UPPER, LOWER), loads_n, strict=True):
        smooth = physics._replace(friction_n=(), friction_mm=())
        ends.append(advance(smooth, unloaded(smooth), np.full(SETTLE_S, load_n), 1.0)[-1])
    return np.array(ends)


def test_what_a_cant_makes_of_the_weight_is_taken_off_at_any_thrust():
    """What is left is what the same model leaves of mounts that do not lean, but for where the curve begins."""
    known, off_n = with_cant(BOTH).aircraft(), {}
    for thrust_n, load_g in product((0.0, 6000.0), (1.0, 1.5)):
        for name, cant_deg, aircraft in (
            ("straight", 0.0, HIL.aircraft()),
            ("known", 2.0, known),
            ("unknown", 2.0, HIL.aircraft()),
        ):
            read_mm = leaning_mm(thrust_n, load_g, cant_deg) - leaning_mm(0.0, 1.0, cant_deg)
            off_n[name, thrust_n, load_g] = says_n(aircraft, read_mm, load_g).sum() - thrust_n
        begins_n = off_n["known", thrust_n, load_g] - off_n["straight", thrust_n, load_g]
        assert abs(begins_n) < (2.0 if thrust_n == 0.0 else 25.0)
    for thrust_n in (0.0, 6000.0):
        pulled_n = {name: off_n[name, thrust_n, 1.5] - off_n[name, thrust_n, 1.0] for name, *_ in off_n}
        assert pulled_n["known"] == pytest.approx(pulled_n["straight"], abs=2.0)
        assert pulled_n["unknown"] == pytest.approx(pulled_n["straight"] - 64.0, abs=2.0)  # 373 kg, half a g, 2 deg


def test_it_flies_as_the_lean_of_a_calibration_does_and_that_replaces_it():
    measured = 'on = "2026-01-01"\n[mount.{}]\nlean_deg = {}\nlean_std_deg = 0.1\n'
    upper = HIL.config.mount[0]
    of_file, of_flight = with_cant(BOTH), HIL.calibrated_by(measured.format("left_upper", 2.0))
    assert of_file.model(upper) == of_flight.model(upper) != HIL.model(upper)
    both = of_file.calibrated_by(measured.format("left_upper", 0.7))
    assert both.model(upper) == HIL.calibrated_by(measured.format("left_upper", 0.7)).model(upper)
    assert both.aircraft().cant["left_upper"] == Cant(deg=0.7, std_deg=0.1)
    assert both.aircraft().cant["left_lower"] == Cant(deg=2.0, std_deg=0.5)  # nobody measured it
    none = of_file.calibrated_by('on = "2026-01-01"\n[mount.left_upper]\nlean_deg = 0.0\nlean_std_deg = 0.1\n')
    assert none.model(upper) == HIL.model(upper)  # a flight found that it does not lean


def test_a_mounts_own_comes_before_its_engines():
    found = with_cant(BOTH.replace(" }\n", ", left_lower = { deg = 0.5, std_deg = 0.1 } }\n")).aircraft().cant
    assert {name: cant.deg for name, cant in found.items()} == {
        "left_upper": 2.0, "left_lower": 0.5, "right_upper": -1.0, "right_lower": -1.0,
    }  # fmt: skip


def test_its_sigma_is_in_the_band_where_the_load_factor_is_not_one():
    std_n_g = with_cant(BOTH).aircraft().cant_n_g()
    assert std_n_g == pytest.approx(373.0 * STANDARD_GRAVITY_M_S2 * np.radians(0.5))
    assert HIL.aircraft().cant_n_g() == 0.0
    rows = np.zeros((2, WIDTH))
    rows[0, MORE_G], rows[1, MORE_G] = 0.8, -0.5
    plain, leaning = HIL.aircraft().installed(), with_cant(BOTH).aircraft().installed()
    assert installed_n2(rows, 0, 0, leaning) == pytest.approx(installed_n2(rows, 0, 0, plain) + (0.8 * std_n_g) ** 2)
    assert installed_n2(rows, 0, 1, leaning) < installed_n2(rows, 0, 1, plain)  # a push-over errs the other way
    level, pulled = (with_cant(BOTH).aircraft().terms_n(4000.0, 5000.0, more_g, 0.1) for more_g in (0.0, 0.8))
    assert level["cant"] == 0.0 and pulled["cant"] == pytest.approx(0.8 * std_n_g)
    measured = "[mount.{}]\nlean_deg = 1.0\nlean_std_deg = 0.05\n"
    text = 'on = "2026-01-01"\n' + "".join(measured.format(mount.name) for mount in HIL.config.mount)
    assert with_cant(BOTH).calibrated_by(text).aircraft().cant_n_g() == pytest.approx(0.1 * std_n_g)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("cant = { lefty = { deg = 1.0, std_deg = 0.1 } }", "cant.lefty: expected one of left, right, left_upper"),
        ("cant = { left = { deg = 1.0 } }", "std_deg"),
        ("cant = { left = { deg = 30.0, std_deg = 0.1 } }", "cant"),
        ("accelerometer_m = { middle = [0.0, 0.0, 0.0] }", "accelerometer_m.middle: expected one of left, right"),
    ],
)
def test_what_nobody_has_or_could_be_is_one_line(line, words):
    with pytest.raises(ConfigError, match=words) as refused:
        with_cant(line + "\n").aircraft()
    assert str(refused.value).startswith(f"test: {FILE}: ") and "\n" not in str(refused.value)


def pulling_up(seed, left_deg=1.0):
    """Pull-ups and push-overs in cruise: what the mounts lean beyond what the file has."""
    level, rng = flight(), np.random.default_rng(seed)
    load_g = 1.0 + 0.6 * np.sin(level.time_s / 4.0) * (np.arange(len(level)) % 100 < 25)
    seen_n = 373.0 * STANDARD_GRAVITY_M_S2 * np.sin(np.radians(left_deg)) * (load_g - 1.0)
    columns = {
        name: level[name] - 0.5 * (seen_n + 100.0 * rng.standard_normal(len(level)))
        for name in level.channels
        if name.startswith("model_N")
    }
    return level.with_channels(accel_z_g=load_g, **columns)


def test_a_flight_moves_it_as_far_as_its_sigma_lets_it_and_the_same_flight_again_says_the_same():
    """Mounts lean 2 deg; the file says 1 deg, exactly, by half a degree, or nearly nothing."""
    found = {}
    for std_deg in (0.0, 0.5, 20.0):
        said = f"{{ deg = 1.0, std_deg = {std_deg} }}"
        installation = with_cant(f"cant = {{ left = {said}, right = {said} }}\n")
        fit = found[std_deg] = fit_drag([pulling_up(1)], installation)
        calibration = with_drag(Calibration(on="2026-01-01"), fit, installation, "2026-01-02")
        assert calibration.mount["left_lower"].lean_deg == pytest.approx(fit.lean_deg[0], abs=1e-3)
        assert read_calibration(write_calibration(calibration), "c") == calibration
        again = fit_drag([pulling_up(1)], installation.calibrated_by(write_calibration(calibration)))
        assert again.lean_deg == pytest.approx(fit.lean_deg) and again.lean_std_deg == pytest.approx(fit.lean_std_deg)
    stds = {std_deg: fit.lean_std_deg[0] for std_deg, fit in found.items()}
    assert found[0.0].lean_deg == pytest.approx([1.0, 1.0], abs=0.05)
    assert found[20.0].lean_deg == pytest.approx([2.0, 2.0], abs=3.0 * stds[20.0])
    assert 1.0 < found[0.5].lean_deg[0] < found[20.0].lean_deg[0] and stds[0.5] < stds[20.0]
    assert stds[0.5] ** -2 == pytest.approx(stds[20.0] ** -2 + 0.5**-2, rel=0.1)


def test_flights_together_count_what_the_file_says_once():
    installation = with_cant("cant = { left = { deg = 1.0, std_deg = 0.1 } }\n")
    first, second, both = (fit_drag(flights, installation).lean_std_deg for flights in
                           ([pulling_up(1)], [pulling_up(2)], [pulling_up(1), pulling_up(2)]))  # fmt: skip
    for one, other, together, assumed in zip(first, second, both, (0.1, 3.0), strict=True):
        assert together**-2 == pytest.approx(one**-2 + other**-2 - assumed**-2)


def test_check_says_it(tmp_path, capsys):
    folder = shipped("deploy/hil.toml", "config").parent
    text = (folder / "hil.toml").read_text().replace("../models", str(folder.parent / "models"))
    (tmp_path / "hil.toml").write_text(text)
    (tmp_path / FILE).write_text(BOTH + (folder / FILE).read_text())
    (tmp_path / "canaerospace.dbc").write_bytes((folder / "canaerospace.dbc").read_bytes())
    assert main(["check", str(tmp_path / "hil.toml")]) == 0
    assert "left_upper: leans +2.00 +- 0.98 deg (95 %), nose up" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "hil.toml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["cant"]["right_lower"] == {"deg": -1.0, "std_deg": 0.25}
