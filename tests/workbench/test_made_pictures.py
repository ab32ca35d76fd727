"""What the worker makes of models and flights: identification, figures of print size, errors of flights."""

import json

import numpy as np
import pytest

from tests.conftest import simple_model
from tests.workbench.test_server import small_record
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.compare import compare
from thrustd.identify.identify import identify
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording
from thrustd.workbench.folder import Folder
from thrustd.workbench.identified import identified_json
from thrustd.workbench.model_runs import simulate_models
from thrustd.workbench.orders import order_of
from thrustd.workbench.prepare import with_errors
from thrustd.workbench.print_figure import write_figure


def quiet(share, note=""):
    """Nobody listens."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("made")
    (root / ".thrustd").mkdir()
    write_recording(small_record(), root / "measured.csv")
    (root / "model.json").write_text(write_model(simple_model()))
    folder = Folder(root)
    simulate_models(folder, "measured.csv", ["model.json"], quiet)
    return folder


def test_a_model_begins_in_the_histories_as_in_a_comparison(folder):
    (compared,) = compare({"m": simple_model()}, [small_record()]).comparisons
    shown = folder.model_columns("measured.csv", "model.json").column("model")
    assert shown == pytest.approx(compared.model_n, abs=0.01)


def test_an_identification_says_errors_curve_and_relaxation():
    record = small_record()
    found = identified_json(identify([record], name="mount"), "mount.json", [record])
    assert found["rmse_n"] == pytest.approx(12, rel=0.1) and found["validation_n"] == pytest.approx(12, rel=0.15)
    static = found["static"]
    slope = np.polyfit(static["deformation_mm"], static["force_n"], 1)[0]
    assert slope == pytest.approx(4900, rel=0.01)
    assert found["relaxation"]["share"][-1] == pytest.approx(1, abs=0.01)
    loop = found["loops"][0]
    assert np.nanstd(np.array(loop["measured_n"], float)) < 20
    json.dumps(found)


def figure(folder, **changes):
    body = {
        "kind": "figure", "recording": "measured.csv", "title": "measured.csv, 10 to 50 s",
        "panels": [{"title": "force [N]", "channels": ["force_N", "model@model.json"]},
                   {"title": "measured - model [N]", "channels": ["residual@model.json"]}],
        "start_s": 10.0, "stop_s": 50.0, "format": "svg",
    } | changes  # fmt: skip
    _, _, arguments = order_of(folder, json.dumps(body).encode())
    return folder.state / "reports" / write_figure(folder, arguments, quiet)["report"]


def test_a_figure_for_print_has_a_title_and_180_mm(folder):
    svg = figure(folder).read_text()
    assert 'width="510.23' in svg and "<!-- time [s] -->" in svg and "<!-- measured.csv, 10 to 50 s -->" in svg
    assert "<!-- measured -->" in svg and "model@" not in svg  # names as a person says them
    png = figure(folder, format="png").read_bytes()
    assert png.startswith(b"\x89PNG") and int.from_bytes(png[16:20]) == pytest.approx(180 / 25.4 * 300, abs=2)


@pytest.mark.parametrize(
    "changes",
    [{"stop_s": 10.0}, {"format": "exe"}, {"panels": []}, {"panels": [{"title": "x", "channels": ["nothing"]}]}],
)
def test_figures_that_cannot_be_are_one_line(folder, changes):
    with pytest.raises(UsageError):
        figure(folder, **changes)


def test_the_error_of_a_flight_with_a_truth():
    t = np.arange(5.0)
    flight = make_recording(
        "flight", {"time_s": t, "estimate_thrust_n_left": t + 10, "thrust_N_left": t, "estimate_thrust_n_right": t}
    )
    found = with_errors(flight)
    assert found["fused_minus_truth_left_N"] == pytest.approx(10) and "fused_minus_truth_right_N" not in found
