"""Files made to hurt: one line, exit status 2, in bounded time and memory, whatever they are."""

import errno
import os
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.io import savemat

from tests.cli.test_bad_input import edit, refused
from tests.conftest import small_aircraft
from thrustd.core.config import read_config
from thrustd.core.errors import ConfigError, ModelError, RecordingError, UsageError, one_line
from thrustd.installation.installation import CONFIG
from thrustd.model.expression import expression_effect
from thrustd.onboard.checkpoint import Clocks, read_checkpoint
from thrustd.records.files import read_recording, write_recording
from thrustd.records.npz_file import METADATA_NAME
from thrustd.records.parquet_file import METADATA_KEY
from thrustd.records.recording import make_recording
from thrustd.sources.plain_file import read_plain

PATIENCE_S = 120
MEMORY_BYTES = 3 << 30  # of address space: numba and pyarrow alone map one
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[1]),) * 2)
from thrustd.__main__ import main
sys.exit(main(sys.argv[2:]))
"""


def in_bounds(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A verb in a process with little memory and little time."""
    command = [sys.executable, "-c", LIMITED, str(MEMORY_BYTES), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def refused_in_bounds(*arguments: object) -> str:
    done = in_bounds(*arguments)
    lines = done.stderr.splitlines()
    assert (done.returncode, done.stdout, len(lines)) == (2, "", 1), done.stderr[-2000:]
    return lines[0]


@pytest.mark.parametrize("name", ["deck.json", "can.dbc", "left_upper.json"])
def test_a_device_or_a_pipe_is_no_file(broken: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    edit(broken / "aircraft.toml", f'"{name}"', '"/dev/zero"')
    assert "/dev/zero: cannot be read: it is a device, expected a file" in refused(
        capsys, "check", broken / "aircraft.toml"
    )
    edit(broken / "aircraft.toml", '"/dev/zero"', '"pipe"')
    os.mkfifo(broken / "pipe")
    assert "pipe: cannot be read: it is a pipe" in refused(capsys, "check", broken / "aircraft.toml")


def test_a_configuration_a_recording_or_a_log_may_not_be_a_pipe(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, verb in (("a.toml", "check"), ("a.mcap", "replay"), ("a.csv", "info"), ("a.json", "info")):
        os.mkfifo(tmp_path / name)
        assert "it is a pipe, expected a file" in refused(capsys, verb, tmp_path / name)


def test_a_checkpoint_may_not_be_a_pipe_and_costs_only_the_warm_start(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "checkpoint")
    found = read_checkpoint(tmp_path / "checkpoint", {}, Clocks("", 0, 0), 10)
    assert found.refused
    assert "it is a pipe, expected a file: starting cold" in found.word
    assert read_checkpoint(Path("/dev/zero"), {}, Clocks("", 0, 0), 10).refused


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz", ".mat", ".mcap"])
def test_a_file_that_may_not_be_read_is_not_called_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    (tmp_path / f"a{suffix}").write_bytes(bytes(200))

    def refuse(*_: object, **__: object) -> None:  # to root, who may run this, chmod means nothing
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(RecordingError, match=f"a{suffix}: cannot be read: Permission denied"):
        read_recording(tmp_path / f"a{suffix}")


def test_a_plain_file_has_a_largest_size(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(10))
    assert read_plain(path, 10, UsageError) == bytes(10)
    with pytest.raises(UsageError, match="10 bytes, expected at most 9"):
        read_plain(path, 9, UsageError)
    with pytest.raises(UsageError, match="cannot be read: No such file"):
        read_plain(tmp_path / "none", 9, UsageError)
    with pytest.raises(UsageError, match="it is a folder"):
        read_plain(tmp_path, 9, UsageError)


@pytest.mark.parametrize("text", [".".join("a" * 100_000) + " = 1", "[" + ".".join("a" * 100_000) + "]"])
def test_a_long_dotted_key_costs_no_memory(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.toml").write_text(text)
    assert "names between dots" in refused_in_bounds("check", tmp_path / "a.toml")


@pytest.mark.parametrize("key", ["a.b.c.d.e.f.g.h.i", '"a" . "b".\'c\'.d.e.f.g.h.i'])
def test_dotted_keys_are_short_and_other_dots_do_not_count(key: str) -> None:
    with pytest.raises(ConfigError, match="expected at most 8 names between dots"):
        read_config(f"[x]\n{{{key} = 1}}", "a.toml")
    text = small_aircraft().files[CONFIG].decode()
    dotted = text.replace('name = "test"', 'name = "1.2.3 4.5.6 7.8.9 1.2.3"') + "\n# " + "0.5, " * 50
    assert read_config(dotted, "a.toml").aircraft.name == "1.2.3 4.5.6 7.8.9 1.2.3"


@pytest.mark.parametrize(
    "text", ["-" * 380 + "mach", "(" * 90 + "mach" + ")" * 90 + "+k", "abs(" * 70 + "mach" + ")" * 70]
)
def test_a_formula_of_signs_is_refused(text: str) -> None:
    with pytest.raises(ModelError, match=r"nested too deep|not a formula|expected a factor"):
        expression_effect(text)


def test_a_formula_may_still_be_a_long_sum() -> None:
    effect = expression_effect("k*mach" + "+k*mach**2" * 20)
    assert effect.channels == ("mach",)


def test_a_csv_of_a_hundred_thousand_columns_is_refused(tmp_path: Path) -> None:
    names = [f"c{i}" for i in range(100_000)]
    path = tmp_path / "wide.csv"
    path.write_text(",".join(["time_s", *names]) + "\n" + ",".join(["0"] * 100_001) + "\n")
    assert "wide.csv: 100001 columns; expected one per channel" in refused_in_bounds("info", path)
    path.write_text("time_s," + "x" * (2 << 20) + "\n0,1\n")
    assert "first line has more than" in refused_in_bounds("info", path)


@pytest.fixture
def npz(tmp_path: Path) -> Path:
    path = tmp_path / "record.npz"
    rng = np.random.default_rng(0)
    write_recording(make_recording("record", {"time_s": np.arange(1000.0), "force_N": rng.normal(size=1000)}), path)
    return path


@pytest.mark.parametrize("name", ["force_N.npy", "force_N"])
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_archive_with_two_arrays_of_one_name_is_refused(npz: Path, name: str) -> None:
    with zipfile.ZipFile(npz, "a") as archive:
        archive.writestr(name, archive.read("force_N.npy"))
    with pytest.raises(RecordingError, match="'force_N' is in it more than once"):
        read_recording(npz)


def test_damaged_members_of_an_archive_are_refused(npz: Path) -> None:
    content = npz.read_bytes()
    rng, heard = np.random.default_rng(0), 0
    for _ in range(300):
        damaged = bytearray(content)
        at = rng.integers(0, len(damaged), rng.integers(1, 5))
        damaged[at[0]] ^= 0xFF
        for place in at[1:].tolist():
            damaged[place] = rng.integers(256)
        npz.write_bytes(damaged)
        try:
            read_recording(npz)
        except RecordingError as problem:
            heard += 1
            assert len(str(problem).splitlines()) == 1
    assert heard > 250


def test_a_deflated_member_that_is_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "record.npz"
    np.savez_compressed(path, time_s=np.arange(1000.0), force_N=np.arange(1000.0))
    content = bytearray(path.read_bytes())
    content[200:240] = bytes(40)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"record.npz: not a readable npz archive: .*"):
        read_recording(path)


@pytest.mark.parametrize("promised", [(10**12,), (2**62, 2**62), (-1,)])
def test_a_member_that_promises_more_than_it_holds_is_refused(tmp_path: Path, promised: tuple[int, ...]) -> None:
    path = tmp_path / "record.npz"
    with zipfile.ZipFile(path, "w") as archive, archive.open("time_s.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": promised})
        member.write(bytes(80))
    assert "record.npz: not a readable npz archive" in refused_in_bounds("info", path)


def test_an_archive_that_unpacks_to_all_memory_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("time_s.npy", "w") as member:
        np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (1 << 26,)})
        for _ in range(64):
            member.write(bytes(8 << 20))
    assert path.stat().st_size < 1e6
    assert "that unpack to 536871" in refused_in_bounds("info", path)


def test_a_matlab_file_or_a_table_that_unpacks_to_all_memory_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "bomb.mat", {"time_s": np.zeros(1 << 26)}, do_compression=True)
    parquet.write_table(pa.table({"time_s": np.zeros(1 << 26)}), tmp_path / "bomb.parquet")
    for name in ("bomb.mat", "bomb.parquet"):
        assert (tmp_path / name).stat().st_size < 1e6
        assert f"{name}: " in (line := refused_in_bounds("info", tmp_path / name))
        assert "that unpack to 536870912" in line


def test_texts_of_a_table_are_left_out_unread(tmp_path: Path) -> None:
    text = pa.DictionaryArray.from_arrays(np.zeros(1000, np.int32), pa.array(["x" * 10_000_000]))  # 10 GB, unpacked
    table = pa.table({"time_s": np.arange(1000.0), "force_N": np.arange(1000.0), "remark": text})
    parquet.write_table(table, tmp_path / "a.parquet", store_schema=False)
    assert (tmp_path / "a.parquet").stat().st_size < 1e6
    done = in_bounds("info", tmp_path / "a.parquet")
    assert (done.returncode, done.stderr) == (0, "")
    assert "remark: string column left out" in done.stdout


def test_a_column_that_comes_twice_is_named(tmp_path: Path) -> None:
    parquet.write_table(pa.Table.from_arrays([pa.array([1.0])] * 2, names=["time_s"] * 2), tmp_path / "a.parquet")
    with pytest.raises(RecordingError, match=r"a.parquet: column 'time_s' appears twice; expected once"):
        read_recording(tmp_path / "a.parquet")


@pytest.mark.parametrize("metadata", ["{", "[1]", '{"a": 1}', "nonsense", '{"a": ' * 2000])
def test_damaged_metadata_are_refused(tmp_path: Path, metadata: str) -> None:
    columns = {"time_s": np.arange(10.0), "force_N": np.arange(10.0)}
    np.savez(tmp_path / "a.npz", **columns, **{METADATA_NAME: np.array(metadata)})
    table = pa.table(columns).replace_schema_metadata({METADATA_KEY: metadata.encode()})
    parquet.write_table(table, tmp_path / "a.parquet")
    for name in ("a.npz", "a.parquet"):
        with pytest.raises(RecordingError, match=f"{name}: its metadata are damaged"):
            read_recording(tmp_path / name)


@pytest.mark.parametrize(
    "columns",
    [
        {"Dadc1_mach": 9, "Dadc1_alt": 10, "time": 10},
        {"Dadc1_mach": 10, "Dadc1_alt": 10, "time": 10, "lh_engine_FMF": 3},
        {"ff_l": 10, "ts": 10},
        {"ff_l": 10, "ts": 10, "mach": 10, "alt": 10, "tas": 10, "roc": 10, "mass": 4},
        {"ff_l": 1, "ts": 1, "mach": 1, "alt": 1, "tas": 1, "roc": 1, "mass": 1},
        {"ff_l": 10, "ts": 10, "mach": 10, "alt": 10, "tas": 10, "roc": 10, "mass": 10, "acc": 2},
    ],
)
def test_flights_of_other_shapes_are_refused(tmp_path: Path, columns: dict[str, int]) -> None:
    np.savez(tmp_path / "a.npz", **{name: np.arange(float(rows)) for name, rows in columns.items()})
    with pytest.raises(RecordingError, match=r"a.npz: .*expected"):
        read_recording(tmp_path / "a.npz")


@pytest.mark.parametrize("wrong", [np.zeros((10, 2)), np.array(["a"] * 10), np.zeros(10, complex)])
@pytest.mark.parametrize("column", ["time_s", "force_N"])
def test_a_channel_of_another_shape_or_kind_is_refused(tmp_path: Path, column: str, wrong: np.ndarray) -> None:
    np.savez(tmp_path / "a.npz", **({"time_s": np.arange(10.0), "force_N": np.arange(10.0)} | {column: wrong}))
    with pytest.raises(RecordingError, match=rf"a.npz: {column} has shape .*expected 1-D numbers"):
        read_recording(tmp_path / "a.npz")


def test_a_units_table_of_one_entry_is_no_traceback(tmp_path: Path) -> None:
    np.savez(
        tmp_path / "a.npz", time_s=np.arange(9.0), force_N=np.arange(9.0), _names=np.array("x"), _units=np.array(1)
    )
    assert len(read_recording(tmp_path / "a.npz")) == 9


@pytest.mark.parametrize("suffix", [".npz", ".parquet"])
def test_column_names_do_not_steer_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    path, name = tmp_path / f"a{suffix}", "\x1b]0;owned\x07\x1b[31mforce"
    columns = {"time_s": np.arange(10.0), name: np.arange(10.0)}
    if suffix == ".npz":
        np.savez(path, **columns)
    else:
        parquet.write_table(pa.table(columns), path)
    line = refused(capsys, "info", path)
    assert line.isprintable()
    assert r"column name '\x1b]0;owned\x07\x1b[31mforce' holds control characters" in line


def test_what_is_left_out_is_named_without_control_characters(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **{"time_s": np.arange(10.0), "force_N": np.arange(10.0), "\x1b[2Jx": np.zeros((2, 2))})
    notes = read_recording(path).notes
    assert any(r"\x1b[2Jx" in note for note in notes)
    assert all(note.isprintable() for note in notes)


def test_a_line_is_one_line_printable_and_not_endless() -> None:
    assert one_line("a\n b\x1b[0m\u202e") == r"a b\x1b[0m\u202e"
    assert len(one_line("x" * 10**6)) < 2100
    assert zlib.crc32(one_line("plain").encode()) == zlib.crc32(b"plain")
