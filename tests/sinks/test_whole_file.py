"""What is written whole takes the place of a file, never of a device or a pipe."""

import os
import stat

import pytest

from thrustd.core.errors import UsageError
from thrustd.sinks.latest_file import replace_file
from thrustd.sinks.whole_file import write_whole


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
