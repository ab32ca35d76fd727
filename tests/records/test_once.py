"""A recording given twice is refused by its content, whatever the copy is called and wherever several are given."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.scene import mount
from thrustd.brochure.fit.deck_fit import brochure_fit
from thrustd.commission.drag import fit_drag
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.identify.identify import identify
from thrustd.records.files import write_recording
from thrustd.records.once import check_each_once
from thrustd.records.recording import make_recording


def made(name, last=1.0):
    deformation = np.append(np.linspace(0.0, 1.0, 1999), last)
    columns = {"time_s": 0.05 * np.arange(2000), "deformation_mm": deformation, "force_N": 1000.0 * deformation}
    return make_recording(name, columns, sha256=name)


def test_content_tells_not_the_name_nor_the_file():
    with pytest.raises(UsageError, match=r"b\.csv: the same recording as a\.csv; expected every recording once"):
        check_each_once([made("a.csv"), made("b.csv")])
    check_each_once([made("a.csv"), made("a.csv", 1.1)])
    one = made("a.csv")
    other = replace(one, channels={"deformation_mm": one["force_N"], "force_N": one["deformation_mm"]})
    check_each_once([one, other])  # two mounts of one log


@pytest.mark.parametrize(
    "ask",
    [
        lambda twice: identify(twice),
        lambda twice: identify([made("c.csv", 1.1)], twice),
        lambda twice: compare({"m": mount()}, twice),
        lambda twice: diagnose(mount(), twice),
        lambda twice: extend(mount(), twice, ["creep"]),
        lambda twice: fit_drag(twice, None),
    ],
)
def test_wherever_several_are_given(ask):
    with pytest.raises(UsageError, match=r"the same recording as a\.csv"):
        ask([made("a.csv"), made("b.csv")])


def test_a_deck_is_not_fitted_to_a_flight_and_its_copy(tmp_path):
    paths = [tmp_path / name for name in ("a.csv", "b.parquet")]
    for path in paths:
        write_recording(made(path.name), path)
    with pytest.raises(UsageError, match=r"the same recording as a\.csv"):
        brochure_fit(paths, None)
