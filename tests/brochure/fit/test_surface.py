"""The thrust surface: generalises over sets left out, real pairs when they are at hand; wrong rows are left out."""

import os

import numpy as np
import pytest

from tests.conftest import PH_LAB, ROOT
from thrustd.brochure.deck import Deck, total_ratios
from thrustd.brochure.deck_data import corrected_thrust
from thrustd.brochure.fit.surface import COLUMNS, fit_surface, read_pairs
from thrustd.core.errors import RecordingError

PATH = ROOT / "models" / "brochure" / "jt15d-4.json"
DECK = Deck.from_json(PATH.read_text(), PATH.name).data


def write_pairs(path, wrong_row=None):
    """Twelve sets of ten rows that the shipped surface would give."""
    rng = np.random.default_rng(3)
    lines = [",".join(COLUMNS)]
    for k in range(120):
        mach, altitude_m = rng.uniform(0.2, 0.5), rng.uniform(1500.0, 6000.0)
        delta, theta = total_ratios(mach, altitude_m, 15.0 - 0.0065 * altitude_m)
        flow = rng.uniform(0.06, 0.12)
        thrust = delta * corrected_thrust(DECK.thrust, flow, mach) * (1.5 if k == wrong_row else 1.0)
        fuel = flow * delta * np.sqrt(theta)
        lines.append(f"{altitude_m},{mach},0.0,{k // 10},{fuel},{fuel},{thrust},{thrust}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_scripted_pairs_come_out_again_on_sets_left_out(tmp_path):
    _, errors = fit_surface(read_pairs(write_pairs(tmp_path / "pairs.csv")))
    assert errors["pairs_leave_one_set_out_rms"] < 0.003
    assert errors["pairs_left_out_as_outliers"] == 0


def test_a_wrong_row_is_left_out_and_counted(tmp_path):
    _, errors = fit_surface(read_pairs(write_pairs(tmp_path / "pairs.csv", wrong_row=7)))
    assert errors["pairs_left_out_as_outliers"] == 2  # both engines of the row
    assert errors["pairs_leave_one_set_out_rms"] < 0.003


def test_the_brochure_programs_pairs_on_sets_left_out():
    path = PH_LAB / "brochure_pairs.csv"
    if not path.exists():
        pytest.skip("the brochure program's pairs are not beside the repository")
    _, errors = fit_surface(read_pairs(path))
    assert errors["pairs_leave_one_set_out_rms_with_outliers"] < 0.005
    assert abs(errors["static_take_off"]) < 0.02


def test_a_missing_column_is_named(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("altitude_m,mach\n1000,0.3\n")
    with pytest.raises(RecordingError, match=r"^pairs.csv: no column 'deltaT_K'"):
        read_pairs(path)


@pytest.mark.parametrize("content", ["", "altitude_m", "\n"])
def test_a_file_without_pairs_is_one_line(tmp_path, content):
    (tmp_path / "pairs.csv").write_text(content)
    with pytest.raises(RecordingError, match=r"^pairs.csv: "):
        read_pairs(tmp_path / "pairs.csv")


def test_pairs_do_not_come_from_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pairs.csv")
    with pytest.raises(RecordingError, match="it is a pipe, expected a file"):
        read_pairs(tmp_path / "pairs.csv")
