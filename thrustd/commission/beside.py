"""The same work on several things at once, each in a process of its own: models of two mounts share nothing.

A process is a module, run: it reads what it is asked from its standard input, bytes, and writes its answer. It asks
its owner for nothing meanwhile, and ends where nobody reads what it writes.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from selectors import EVENT_READ, DefaultSelector
from typing import Any

SIZE = 8  # bytes that say how many are asked
Told = Callable[[int], None]  # so many are done


def processors() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def answers(module: str, asked: Sequence[bytes], told: Told) -> list[bytes]:
    """Of a process for each, in the order they were asked; as many at once as there are processors."""
    found: dict[int, bytes] = {}
    running: list[subprocess.Popen[bytes]] = []
    try:
        with DefaultSelector() as wires:
            while len(found) < len(asked):
                while len(running) < len(asked) and len(running) - len(found) < processors():
                    running.append(_begun(module, asked[len(running)]))
                    wires.register(_reader(running[-1]), EVENT_READ, len(running) - 1)
                for key, _ in wires.select():
                    wires.unregister(key.fileobj)
                    found[key.data] = _answer(module, running[key.data])
                    told(len(found))
    finally:
        for process in running:
            process.kill()
            process.wait()
            _reader(process).close()
    return [found[place] for place in range(len(asked))]


def _begun(module: str, asked: bytes) -> subprocess.Popen[bytes]:
    pipe, same = subprocess.PIPE, os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen((sys.executable, "-P", "-m", module), stdin=pipe, stdout=pipe, env=same)
    assert process.stdin is not None
    with suppress(BrokenPipeError):  # it died: its status says so
        process.stdin.write(len(asked).to_bytes(SIZE))
        process.stdin.write(asked)
        process.stdin.close()
    return process


def _reader(process: subprocess.Popen[bytes]) -> Any:
    assert process.stdout is not None
    return process.stdout


def _answer(module: str, process: subprocess.Popen[bytes]) -> bytes:
    said: bytes = _reader(process).read()
    if process.wait() != 0:
        raise RuntimeError(f"a process of {module} ended with status {process.returncode}")
    return said


def serve(work: Callable[[bytes], bytes]) -> None:
    """What such a module does when it is run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: its owner ends it
    size, asked, out = sys.stdin.buffer.read(SIZE), sys.stdin.buffer.read(), os.fdopen(os.dup(1), "wb")
    if len(size) < SIZE or len(asked) < int.from_bytes(size):
        return  # its owner ended while it asked
    os.dup2(2, 1)  # nothing that is printed gets into the answer
    with suppress(BrokenPipeError), out:
        out.write(work(asked))
