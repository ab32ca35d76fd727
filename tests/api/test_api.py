"""The names at the top: models on arrays, tables, figures that come back, nothing overwritten."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

import thrustd as td
from tests.conftest import ROOT
from tests.diagnose.scene import mount, record
from tests.flighttest.scene import made_flight
from thrustd.api.flights import health, transients
from thrustd.api.model import Model
from thrustd.core.errors import ModelError, RecordingError, UsageError
from thrustd.model.artifact import EffectSpec
from thrustd.records.files import write_recording

INERTIA = EffectSpec("axial_inertia", {"mass_kg": 60.0})
SHIPPED = ROOT / "models" / "left-upper.json"


def test_importing_loads_nothing_and_the_names_are_there():
    code = "import sys, thrustd; print(len(thrustd.__all__), 'numpy' in sys.modules, *dir(thrustd))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert said[:2] == ["10", "False"] and set(td.__all__) < set(said)
    with pytest.raises(AttributeError, match="nonsense"):
        _ = td.nonsense


def test_a_name_is_the_function_although_a_room_is_called_so():
    import thrustd.identify.identify
    import thrustd.replay.replay  # noqa: F401

    assert all(callable(getattr(td, name)) for name in td.__all__)


def test_a_model_is_called_on_arrays_and_on_recordings():
    model = Model(mount(effects=[INERTIA]))
    data = record([INERTIA], n=2000)
    assert model.channels == ("accel_x_g",)
    by_arrays = model(data["deformation_mm"], rate_hz=20.0, accel_x_g=data["accel_x_g"])
    np.testing.assert_allclose(by_arrays, model(data), rtol=1e-12)  # 1 / (median step) is 20 Hz to the last bit but one
    assert np.std(by_arrays - data["force_N"]) < 13.0  # the load cell's own noise
    at_rest = model(np.full(100, 0.5), rate_hz=20.0, accel_x_g=0.1)
    still = model(np.full(100, 0.5), rate_hz=20.0, accel_x_g=0.0)
    assert at_rest - still == pytest.approx(60.0 * 9.80665 * 0.1, rel=1e-6)


def test_the_channels_of_a_model_are_what_it_is_called_with():
    model = td.load(SHIPPED)
    assert len(set(model.channels)) == len(model.channels) and "deformation_mm" not in model.channels
    still = {name: 0.0 for name in model.channels}
    assert np.isfinite(model(np.full(50, 0.5), rate_hz=100, **still)).all()


def test_what_a_model_cannot_be_called_with_is_one_line():
    model = Model(mount(effects=[INERTIA]))
    with pytest.raises(ModelError, match="accel_x_g"):
        model(np.zeros(5))
    with pytest.raises(UsageError, match="does not read 'mach'"):
        model(np.zeros(5), accel_x_g=0.0, mach=0.3)
    with pytest.raises(UsageError, match=r"accel_x_g has shape \(4,\)"):
        model(np.zeros(5), accel_x_g=np.zeros(4))
    with pytest.raises(UsageError, match="shape"):
        model(np.zeros((5, 2)), accel_x_g=0.0)


def test_files_are_read_by_str_and_path_and_never_overwritten(tmp_path):
    path = tmp_path / "bench.csv"
    assert td.write(record(n=400), path) == path
    one, other = td.read(str(path)), td.read(path)
    np.testing.assert_array_equal(one["force_N"], other["force_N"])
    before = path.read_bytes()
    with pytest.raises(UsageError, match="already exists"):
        td.write(one, path)
    assert path.read_bytes() == before
    td.write(one.window(0, 5), path, overwrite=True)
    assert len(td.read(path)) == 100
    model = td.load(str(SHIPPED))
    td.write(model, tmp_path / "copy.json")
    assert td.load(tmp_path / "copy.json").spec == model.spec
    with pytest.raises(RecordingError, match="nothing"):
        td.read(tmp_path / "nothing.csv")


def test_a_reference_of_the_users_own_is_not_the_truth_of_the_log(tmp_path):
    columns = record(n=400)
    flight = columns.with_channels(
        deformation_mm_left_upper=columns["deformation_mm"], force_N_left_upper=columns["force_N"] + 1000.0
    )
    own, log = tmp_path / "own.csv", tmp_path / "log.csv"
    write_recording(flight, own)
    write_recording(flight.select([name for name in flight.channels if name != "force_N"]), log)
    kept = td.read(own, mount="left_upper")
    np.testing.assert_array_equal(kept["force_N"], columns["force_N"])
    assert any("force_N: the column of the file is kept" in note for note in kept.notes)
    np.testing.assert_array_equal(td.read(log, mount="left_upper")["force_N"], columns["force_N"] + 1000.0)


def test_columns_of_anyone(tmp_path):
    path = tmp_path / "theirs.csv"
    t = np.arange(0, 10, 0.1)
    rows = "\n".join(f"{a:.1f},{b:.4f},{c:.4f}" for a, b, c in zip(t, np.sin(t), np.cos(t), strict=True))
    path.write_text("Time [s],LVDT (V),Load [kN]\n" + rows + "\n")
    data = td.read(path, time="Time [s]", input="LVDT (V)", output="Load [kN]")
    np.testing.assert_allclose(data["deformation_mm"], np.sin(t), atol=1e-4)


def test_the_loop_compiles_nothing_that_only_flies():
    flies = "('thrustd.pipeline', 'thrustd.sensors', 'thrustd.fusion')"
    code = "import sys, thrustd.api.files, thrustd.api.loop, thrustd.workbench.finding;"
    code += f"print([name for name in sys.modules if name.startswith({flies})])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_errors_speak_python(tmp_path):
    path = tmp_path / "theirs.csv"
    path.write_text("Time [s],Load [kN]\n0,1\n1,2\n2,3\n")
    with pytest.raises(
        RecordingError,
        match=r"expected rename=\['Time \[s\]=time_s', 'Load \[kN\]=force_N\*1000.0'\], or .*time=COLUMN",
    ):
        td.read(path)
    with pytest.raises(UsageError, match=r"rename=\['Load \[kN\]=force_N\*1000.0'\]"):
        td.read(path, rename=["Time [s]=time_s", "Load [kN]=force_N"])
    with pytest.raises(RecordingError, match="mount=left_up: not in the configuration"):
        td.read(path, time="Time [s]", mount="left_up")
    assert "Load [kN]" in repr(td.read(path, time="Time [s]"))


def test_tables_for_prompts_notebooks_and_pandas():
    data, model = record([INERTIA], n=2000), Model(mount())
    assert "deformation_mm" in repr(data) and "2000 samples" in repr(data)
    assert "<pre" in data._repr_html_() and "accel_x_g" in data._repr_html_()
    frame = data.to_pandas()
    assert frame.index.name == "time_s" and len(frame) == 2000
    np.testing.assert_array_equal(frame["force_N"], data["force_N"])
    assert "hammerstein" in repr(model) and set(model.to_pandas()["name"]) == {"tau_s"}


def test_compare_gives_a_table_and_a_figure_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bare, whole, data = Model(mount()), Model(mount(effects=[INERTIA])), record([INERTIA], n=4000)
    found = td.compare([bare, whole], data)
    rmse = found.to_pandas()["rmse_n"].to_list()
    assert rmse[1] < 13.0 < rmse[0]
    assert isinstance(found.plot(), Figure) and isinstance(td.compare(bare, data).plot(), Figure)
    assert not list(tmp_path.iterdir())
    assert all(path.exists() for path in found.pictures("pictures"))
    with pytest.raises(UsageError, match="already exists"):
        found.pictures("pictures")


def test_a_channel_that_a_model_reads_and_a_record_lacks_is_said():
    data = record([INERTIA], n=4000)
    bare = data.select([name for name in data.channels if name != "accel_x_g"])
    with pytest.warns(UserWarning, match="accel_x_g is not recorded, 0 g taken for it"):
        td.compare(Model(mount(effects=[INERTIA])), bare)


def test_diagnose_and_extend_in_memory():
    model, data = Model(mount()), record([INERTIA], n=12_000)
    found = td.diagnose(model, data)
    assert found.verdict == ("axial_inertia",) and "axial_inertia" in repr(found)
    better = td.extend(model, data, found)
    assert better.spec.effects[0].parameters["mass_kg"] == pytest.approx(60.0, rel=0.05)
    assert not model.spec.effects  # the given one is left as it is
    assert "ledger + axial_inertia" in repr(better)
    assert len(found.to_pandas()) >= 5


def test_flights(tmp_path):
    log = tmp_path / "made.csv"
    write_recording(made_flight(), log)
    points = td.points(str(log), least_s=30)
    assert len(points.to_pandas()) == 3 and isinstance(points.plot(), Figure) and "TSFC" in repr(points)
    with pytest.raises(UsageError, match="no limit 'moch'"):
        td.points(log, moch=1.0)
    with pytest.raises(RecordingError, match="no mass"):
        td.performance(log)
    with pytest.raises(UsageError, match="performance: no limit 'moch'"):
        td.performance(log, moch=1.0)
    moved = transients(log)
    assert not moved.found.events and "no event" in repr(moved)
    write_recording(made_flight(seed=1), tmp_path / "other.csv")
    over = health([log, tmp_path / "other.csv"])
    assert isinstance(over.plot(), Figure) and "6 or more tell a change" in repr(over) and len(over.to_pandas()) >= 6
