"""Work in processes of their own is the same work."""

import os
import subprocess
import sys

import pytest

from thrustd.commission import beside as module
from thrustd.commission.beside import answers


@pytest.fixture(autouse=True)
def two(monkeypatch):
    """Processors."""
    monkeypatch.setattr(module, "processors", lambda: 2)


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A module with this work, by its name."""

    def write(work):
        (tmp_path / "worker.py").write_text(f"import os, sys\nfrom thrustd.commission.beside import serve\n{work}\n")
        monkeypatch.syspath_prepend(tmp_path)
        return "worker"

    return write


def test_answers_come_in_order_and_each_is_told(written):
    name, told = written("serve(lambda asked: asked[::-1])"), []
    assert answers(name, [b"ab", b"cd", bytes(3) + bytes(range(256)) * 4000], told.append)[:2] == [b"ba", b"dc"]
    assert told == [1, 2, 3]


def test_each_has_a_process_of_ours(written):
    name = written("serve(lambda asked: f'{os.getppid()} {os.getpid()}'.encode())")
    found = [said.split() for said in answers(name, [b"", b"", b""], int)]
    assert {int(parent) for parent, _ in found} == {os.getpid()} and len({own for _, own in found}) == 3


def test_a_process_that_dies_is_told_and_the_others_end(written):
    with pytest.raises(RuntimeError, match="a process of worker ended with status 3"):
        answers(written("serve(lambda asked: os._exit(3) if asked else asked)"), [b"x", b"", b""], int)


def test_what_is_printed_is_no_answer(written, capfd):
    name = written("serve(lambda asked: [print(asked.decode()), asked][1])")
    assert answers(name, [b"one", b"two"], int) == [b"one", b"two"]
    assert set(capfd.readouterr().err.split()) == {"one", "two"}


@pytest.mark.parametrize("heard", [b"", bytes(3), (5).to_bytes(8) + b"half"])
def test_one_whose_owner_ended_while_it_asked_says_nothing(heard):
    """As on SIGTERM: it printed a traceback over the terminal."""
    one = subprocess.run(
        [sys.executable, "-m", "thrustd.commission.one_mount"], input=heard, capture_output=True, check=True
    )
    assert (one.stdout, one.stderr) == (b"", b"")
