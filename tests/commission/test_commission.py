"""From an aircraft's records to a folder that flies, or one line and no folder."""

import json
import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from tests.installation.test_geometry import changed
from thrustd.__main__ import main
from thrustd.bench.plan_test import BenchPlan, programme
from thrustd.cli.files import read_models
from thrustd.commission.commission import Commissioned, _kept, commission, summary_lines
from thrustd.commission.mount_models import THERMAL, Made, _hang, learn, mount_models
from thrustd.commission.one_mount import Answer, identified
from thrustd.commission.pieces import Pieces
from thrustd.commission.report import _effects, report_page
from thrustd.core.calibration import Calibration, MountCalibration, Zero, write_calibration
from thrustd.diagnose.extend.extend_report import ExtendReport
from thrustd.identify.artifact import witness_rows
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.artifact import EffectSpec, read_model, write_model
from thrustd.records.files import read_recording, write_recording
from thrustd.records.recording import make_recording
from thrustd.twin.aircraft import scripted
from thrustd.twin.airframe import draw_airframe
from thrustd.twin.bench import RIG, programme_bench, step_bench, weight_bench
from thrustd.twin.mount import LOWER, UPPER


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """Half an hour of bench for an upper and a lower mount, weight steps on the upper one."""
    folder = tmp_path_factory.mktemp("records")
    made = {
        "upper": step_bench(0.5, 61, UPPER), "lower": step_bench(0.5, 62, LOWER), "weight": weight_bench(0.3, 63, UPPER)
    }  # fmt: skip
    made["turned"] = made["upper"].with_channels(force_N=-made["upper"]["force_N"])
    made["kilonewtons"] = made["upper"].with_channels(force_N=made["upper"]["force_N"] / 1e3)
    made["still"] = made["upper"].with_channels(force_N=8.0 + 0 * made["upper"]["force_N"]).window(0.0, 30.0)
    for name, record in made.items():
        write_recording(record.resample(5.0), folder / f"{name}.parquet")
    return folder


@pytest.fixture(scope="module", autouse=True)
def one_model_of_a_bench():
    """A record is identified once: its model is the same, whichever mount a test says that it is of."""
    made: dict[tuple[str, ...], Answer] = {}

    def once(mount, records):
        key = tuple(record.sha256 for record in records)
        if key not in made:
            made[key] = identified(mount, records)
        spec = msgspec.structs.replace(read_model(made[key].model, mount), name=mount.replace("_", "-"))
        return msgspec.structs.replace(made[key], model=write_model(spec))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("thrustd.commission.mount_models.identified", once)
        yield


def given(records, upper="upper", lower="lower", more=()):
    bench = [f"upper={records / upper}.parquet", f"lower={records / lower}.parquet"]
    config = str(shipped("deploy/hil.toml", "config"))
    return ["commission", "--bench", *bench, "--aircraft", config, *more]


@pytest.fixture(scope="module")
def folder(records, tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "aircraft"
    assert main([*given(records, more=["--weight", f"{records / 'weight'}.parquet"]), "-o", str(out)]) == 0
    return out


def test_the_folder_flies_and_replays(folder, capsys):
    installation = read_installation(folder / "hil.toml")
    words = [line for line in installation.uncorrected()]
    assert words == [] and [mount.model for mount in installation.config.mount] == [
        f"models/{name}.json" for name in ("left_upper", "left_lower", "right_upper", "right_lower")
    ]
    log = folder.parent / "flight.mcap"
    config = str(folder / "hil.toml")
    assert main(["simulate", "--minutes", "4", "--seed", "5", "--config", config, "-o", str(log)]) == 0
    capsys.readouterr()
    assert main(["replay", str(log), "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)["scores"]
    assert max(scores[engine]["fused"]["rmse_n"] for engine in ("left", "right")) < 120.0


def test_mounts_of_one_bench_are_one_model(folder, records):
    """The weight record is of one upper mount; left and right still fly the same numbers."""
    specs = {path.stem: msgspec.json.decode(path.read_bytes()) for path in sorted((folder / "models").glob("*.json"))}
    for place in ("upper", "lower"):
        left, right = (specs[f"{side}_{place}"] for side in ("left", "right"))
        assert left.pop("name") != right.pop("name")
        assert left == right
    assert specs["left_upper"]["effects"] != specs["left_lower"]["effects"]


def test_a_mount_with_a_bench_more_is_not_the_one_without(monkeypatch):
    """Which benches a model is of is all of them, not the first."""
    hil = read_installation(shipped("deploy/hil.toml", "config"))
    benches = [make_recording(f"{name}.parquet", {"time_s": np.arange(3.0)}) for name in "abc"]
    bench = {
        "left_upper": benches[:2],
        "left_lower": benches[2:],
        "right_upper": benches[:1],
        "right_lower": benches[2:],
    }

    def identified(mount, records):
        spec = next(hil.bench_model(one) for one in hil.config.mount if one.name == mount)
        return Made(spec, 1.0, 2.0, [record.name for record in records], [f"identified as {mount}"])

    monkeypatch.setattr("thrustd.commission.mount_models._identified", identified)
    monkeypatch.setattr("thrustd.commission.mount_models._hang", lambda *_: None)  # these hang already
    made = mount_models(Pieces(bench, [], [], []), hil, lambda *_: None)
    assert list(made) == list(bench)
    assert {mount: one.benches for mount, one in made.items()} == {
        mount: [record.name for record in records] for mount, records in bench.items()
    }
    assert {mount: one.lines[0] for mount, one in made.items()} == {
        "left_upper": "identified as left_upper", "right_upper": "identified as right_upper",
        "left_lower": "identified as left_lower", "right_lower": "identified as left_lower",
    }  # fmt: skip
    assert made["right_lower"].spec.name == "right-lower"


def test_what_is_missing_is_said_and_in_the_band(folder):
    page = (folder / "report.html").read_text()
    assert "chamber: what temperature does" in page and "two flights" in page
    assert "weight: what normal load does" not in page
    fusion = read_installation(folder / "hil.toml").config.fusion
    assert fusion["mount_stiffness_std"] == pytest.approx(np.hypot(0.003, 0.006), rel=1e-3)


def test_the_report_gives_no_sigma_to_what_was_given():
    (spec,) = read_models([shipped("models/left-upper.json", "model")]).values()
    held = EffectSpec("engine_weight_shift", {"stretch_1_g": 0.01}, std={"stretch_1_g": 1e-8})
    found = EffectSpec("thermal_stiffness", {"stiffness_1_k": -2e-4}, std={"stiffness_1_k": 3e-6})
    given = {"given": ["engine_weight_shift.stretch_1_g = 0.01"]}
    one = Made(msgspec.structs.replace(spec, effects=[held, found], provenance=given), 5.0, 6.0, ["bench"])
    shown = re.findall(r"(given|3e-06|1e-08)</td>", _effects({"left_upper": one}))
    assert shown == ["given", "3e-06"]
    assert "engine_weight<" in _effects({"left_upper": one}) and "shift" not in _effects({"left_upper": one})


def test_a_chamber_that_teaches_nothing_is_said_on_the_terminal(tmp_path):
    (spec,) = read_models([shipped("models/left-upper.json", "model")]).values()
    bare = msgspec.structs.replace(spec, effects=[e for e in spec.effects if e.name not in THERMAL], witness=None)
    asked = make_recording("chamber", programme("steps", BenchPlan(hours=0.2, seed=64)))
    cool = UPPER._replace(softening_per_k=0.0, expansion_mm_k=0.0)
    rooms = [
        programme_bench(asked, seed, cool, RIG._replace(room_degc=room_degc)).resample(10.0)
        for seed, room_degc in ((64, -10.0), (65, 50.0))
    ]
    still = np.zeros(len(rooms[0]))
    chamber = [replace(room, name=f"room {i}") for i, room in enumerate(rooms)]
    chamber = [room.with_channels(accel_x_g=still, accel_z_g=still + 1.0) for room in chamber]
    made = {"left_upper": Made(bare, 5.0, 6.0, ["bench"])}
    learn(made, chamber, THERMAL, "temperature")
    lines = summary_lines(Commissioned(tmp_path, tmp_path, made, [], (), [], 0.003))
    assert [line for line in lines if line.startswith("left_upper: temperature: ") and "not added" in line]


def test_gains_that_were_measured_with_the_bases_models_are_said(tmp_path):
    """They are relative to a model's force, with a sigma of their own: on other models they mean nothing."""
    base = read_installation(shipped("deploy/hil.toml", "config"))
    zeroed, gain = (
        MountCalibration(zeros=(Zero("2026-01-01", 0.01, 0.002),)),
        MountCalibration(gain=1.02, gain_std=0.002),
    )
    for mount, said in ((zeroed, ""), (gain, "calibrate tether again")):
        known = Calibration(on="2026-01-01", mount={"left_upper": mount})
        kept = _kept(base.calibrated_by(write_calibration(known)))
        assert (said in kept) if said else not kept
        done = Commissioned(tmp_path, tmp_path, {}, [], (), [], 0.003, kept)
        assert [line for line in summary_lines(done) if line.startswith("kept: ")] == [f"kept: {kept}"] * bool(said)
        assert ("Kept: " in report_page(done)) == bool(said)


def test_a_mount_keeps_its_own_friction_when_another_one_is_weighed(monkeypatch):
    """What `extend` finds of the owner's friction by another law is no effect of the weight."""
    (spec,) = read_models([shipped("models/left-upper.json", "model")]).values()
    bare = msgspec.structs.replace(spec, effects=[e for e in spec.effects if e.name != "engine_weight"], witness=None)
    bare = msgspec.structs.replace(bare, witness=witness_rows(bare, 10.0))
    found = [EffectSpec("engine_weight", {"stiffening_1_n": 1e-5}), EffectSpec("hysteresis", {})]
    longer = msgspec.structs.replace(bare, effects=[*bare.effects, *found])
    report = ExtendReport(longer, ("engine_weight",), 20.0, 6.0, (), (), "N")
    monkeypatch.setattr("thrustd.commission.mount_models.extend", lambda *_, **__: report)
    made = {name: Made(bare, 5.0, 6.0, ["bench"]) for name in ("left_upper", "right_upper")}
    weight = step_bench(0.05, 66, UPPER)
    still = np.zeros(len(weight))
    learn(made, [weight.with_channels(accel_x_g=still, accel_z_g=still + 1.0)], ("engine_weight",), "weight")
    other = made["right_upper"] if made["left_upper"].spec is longer else made["left_upper"]
    assert [e.name for e in other.spec.effects] == [*(e.name for e in bare.effects), "engine_weight"]


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ({"upper": "lower", "lower": "upper"}, "each other's"),
        ({"upper": "upper", "lower": "upper"}, "two of the same place"),
        ({"upper": "weight", "lower": "nothing"}, "nothing.parquet"),
        ({"upper": "turned"}, "is the sign of force_N or deformation_mm turned?"),
        ({"upper": "kilonewtons"}, "is it kN?"),
        ({"upper": "still"}, "force_N spans"),
    ],
)
def test_a_bench_of_the_wrong_mount_is_one_line_and_no_folder(records, tmp_path, capsys, places, words):
    assert main([*given(records, **places), "-o", str(tmp_path / "out")]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.strip()]
    assert line.startswith("thrustd:") and words in line
    assert not list(tmp_path.iterdir())


def test_flights_without_fuel_flow_and_records_that_do_not_move_are_refused_before_any_work(records, tmp_path, capsys):
    time_s = np.arange(100.0)
    flight = make_recording("dry", {"time_s": time_s, "n1_pct_left": time_s, "mach": 0 * time_s})
    write_recording(flight, tmp_path / "dry.csv")
    dry, still = ["--flights", str(tmp_path / "dry.csv")], f"{records / 'upper'}.parquet"
    upper = read_recording(records / "upper.parquet")
    write_recording(upper.with_channels(temperature_degC=np.full(len(upper), 45.0)), tmp_path / "hot.parquet")
    weight, chamber = (["--weight", still], "hardly moves"), (["--chamber", still], "within 0.0 K of the benches")
    hot = ["--chamber", str(tmp_path / "hot.parquet")], "45.0 throughout; expected a cold and a hot record"
    for more, word in ((dry, "fuel_flow_kg_s"), weight, chamber, hot):
        assert main([*given(records, more=more), "-o", str(tmp_path / "out")]) == 2
        assert word in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_flights_that_make_no_deck_are_refused_before_the_mounts_are_identified(records, tmp_path, capsys, monkeypatch):
    def never(*_):
        raise AssertionError("minutes of work before a mistake is told that shows in seconds")

    monkeypatch.setattr("thrustd.commission.commission.mount_models", never)
    time_s = np.arange(0.0, 60.0, 0.1)
    flat = {"mach": 0.3, "pressure_altitude_m": 1e3, "sat_degC": 5.0, "n1_pct_left": 80.0, "fuel_flow_kg_s_left": 0.1}
    flight = make_recording("flight", {"time_s": time_s} | {name: np.full(len(time_s), v) for name, v in flat.items()})
    write_recording(flight, tmp_path / "flight.csv")
    twice = ["--flights", *[str(tmp_path / "flight.csv")] * 2]
    assert main([*given(records, more=twice), "-o", str(tmp_path / "out")]) == 2
    assert "the same recording" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["flight.csv"]


def test_two_flights_make_a_deck_of_their_own_and_the_report_tells_every_models_error(tmp_path, monkeypatch):
    config = shipped("deploy/hil.toml", "config")
    hil, flights = read_installation(config), [tmp_path / f"{seed}.parquet" for seed in (5, 6)]
    for path in flights:
        flight = scripted(900.0, int(path.stem), draw_airframe(5).healths).resample(2.0)
        write_recording(flight, path)
    made = {one.name: Made(hil.bench_model(one), 1.25, 2.0 + i, ["b"]) for i, one in enumerate(hil.config.mount)}
    monkeypatch.setattr("thrustd.commission.commission.mount_models", lambda *_: made)
    done = commission(Pieces({}, [], [], flights), hil, config, tmp_path / "aircraft", lambda *_: None)
    new, base = (json.loads(text) for text in ((done.folder / "deck.json").read_text(), hil.files[hil.config.deck]))
    assert new != base and read_installation(done.config).files["deck.json"] == (done.folder / "deck.json").read_bytes()
    assert {row["flight"] for row in done.deck_rows} == {path.name for path in flights}
    assert not any("flights" in piece.piece for piece in done.missing)
    page = (done.folder / "report.html").read_text()
    for i, name in enumerate(made):
        assert re.search(rf"{name}</td>\s*<td[^>]*>{2.0 + i:.1f}</td>\s*<td[^>]*>1.2</td>", page)


def test_a_bench_that_does_not_reach_what_the_weight_leaves_is_said():
    """The upper mount of a rigid body is unloaded by 1.4 kN; mounts that move together know no couple."""
    hil = read_installation(shipped("deploy/hil.toml", "config"))
    rigid = changed(("rigid_body = false", "rigid_body = true"))
    for installation, mount, said in ((hil, 0, False), (rigid, 0, True), (rigid, 1, False)):
        place = hil.config.mount[mount]
        spec = hil.bench_model(place)
        bench = msgspec.structs.replace(spec, effects=[e for e in spec.effects if e.name != "axial_inertia"])
        one = Made(msgspec.structs.replace(bench, witness=witness_rows(bench, 10.0)), 1.0, 2.0, [])
        _hang(one, place.name, installation)
        assert any("-1423 N" in line and "plan-test steps --low" in line for line in one.untold) == said


def test_a_bench_without_a_file_is_said_by_its_option(capsys):
    for given in ("upper=", "upper=a.csv,"):
        assert main(["commission", "--bench", given, "-o", "out"]) == 2
        assert f"--bench {given}: expected MOUNT=FILE" in capsys.readouterr().err


def test_who_interrupts_the_report_finds_no_folder(tmp_path, monkeypatch):
    config = shipped("deploy/hil.toml", "config")
    hil = read_installation(config)
    made = {one.name: Made(hil.bench_model(one), 1.0, 2.0, []) for one in hil.config.mount}

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("thrustd.commission.commission.mount_models", lambda *_: made)
    monkeypatch.setattr("thrustd.commission.commission.report_page", interrupted)
    with pytest.raises(KeyboardInterrupt):
        commission(Pieces({}, [], [], []), hil, config, tmp_path / "aircraft", lambda *_: None)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_told_before_any_work(tmp_path, capsys):
    (tmp_path / "file").write_text("x")
    bench = ["--bench", "upper=nothing.csv", "lower=nothing.csv"]
    assert main(["commission", *bench, "-o", str(tmp_path / "file" / "aircraft")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be written" in line and "expected a folder" in line


def test_a_folder_that_is_there_is_left_alone(records, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("thrustd.commission.commission.mount_models", lambda *_: {})  # told before that work
    (tmp_path / "link").symlink_to(tmp_path)
    assert main([*given(records), "-o", str(tmp_path / "link")]) == 2
    (tmp_path / "link").unlink()
    (tmp_path / "mine.txt").write_text("x")
    assert main([*given(records), "-o", str(tmp_path)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
