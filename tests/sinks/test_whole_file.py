"""What is written whole takes the place of a file, never of a device or a pipe."""

import os
import resource
import stat
import subprocess
import sys
import tempfile

import pytest

from thrustd.core.errors import UsageError
from thrustd.sinks import whole_file
from thrustd.sinks.latest_file import replace_file
from thrustd.sinks.whole_file import whole_folder, write_whole


def test_a_file_is_replaced_whole(tmp_path):
    path = tmp_path / "out.txt"
    for content in ("first", "second"):
        write_whole(path, content)
        replace_file(path, content.encode())
        assert path.read_text() == content
    assert [each.name for each in tmp_path.iterdir()] == ["out.txt"]


def test_a_pipe_is_refused_and_stays(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(UsageError, match="it is a device, expected a file"):
        write_whole(path, "content")
    with pytest.raises(OSError, match="it is a device"):
        replace_file(path, b"content")
    assert stat.S_ISFIFO(path.stat().st_mode)
    assert [each.name for each in tmp_path.iterdir()] == ["pipe"]


KILLED = """
import sys, time
from pathlib import Path
from thrustd.sinks.whole_file import whole_folder
with whole_folder(Path(sys.argv[1])) as folder:
    folder.mkdir()
    (folder / "half.json").write_text("half")
    print("written", flush=True)
    time.sleep(600)
"""


def test_a_folder_takes_its_place_whole_or_leaves_nothing(tmp_path):
    out = tmp_path / "deep" / "[1] aircraft"
    for _ in range(2):
        with pytest.raises(UsageError, match="half way"), whole_folder(out) as folder:
            folder.mkdir()
            raise UsageError("half way")
        assert list(out.parent.iterdir()) == []
    out.mkdir()
    with whole_folder(out) as folder:
        folder.mkdir()
        (folder / "hil.toml").write_text("whole")
        assert list(out.iterdir()) == []
    assert [each.name for each in out.parent.iterdir()] == [out.name]
    assert (out / "hil.toml").read_text() == "whole"


def test_a_full_disk_names_the_folder_and_leaves_nothing(tmp_path):
    out, before = tmp_path / "aircraft", resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError, match="File too large") as refused, whole_folder(out) as folder:
            folder.mkdir()
            (folder / "model.json").write_text("x" * 2000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert refused.value.filename == str(out) and list(tmp_path.iterdir()) == []


def test_killed_half_way_there_is_no_folder_and_the_next_time_takes_away_what_was_left(tmp_path):
    out = tmp_path / "aircraft"
    command = [sys.executable, "-c", KILLED, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as killed, subprocess.Popen(command, stdout=-1) as lives:
        for each in (killed, lives):
            assert each.stdout.readline() == b"written\n"
        killed.kill()
        killed.wait()
        assert not out.exists() and len(list(tmp_path.iterdir())) == 2
        with whole_folder(out) as folder:
            folder.mkdir()
            drafts = [each for each in tmp_path.iterdir() if (each / out.name / "half.json").exists()]
            assert len(drafts) == 1  # of the one that still writes
        lives.kill()
    assert out.is_dir()


def test_two_that_start_together_do_not_take_away_each_others_folder(tmp_path, monkeypatch):
    made = []

    def taken_at_once(**where):
        made.append(tempfile.mkdtemp(**where))
        if len(made) == 1:
            os.rmdir(made[0])  # as another process does that sees it before it is locked
        return made[-1]

    monkeypatch.setattr(whole_file, "mkdtemp", taken_at_once)
    with whole_folder(tmp_path / "aircraft") as folder:
        folder.mkdir()
    assert len(made) == 2 and [each.name for each in tmp_path.iterdir()] == ["aircraft"]
