"""One process per configuration, checkpoint and log: a second one would send every estimate twice, overwrite the
first one's checkpoint and delete its logs, also when it flies a copy of the configuration.

The claim is a socket in Linux's abstract name space, called after the real path: it needs no file that could be left
behind, survives an editor that replaces the configuration, and is gone the moment its process is.
"""

import hashlib
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from struct import Struct

from thrustd.core.errors import UsageError

PEER = Struct("3i")  # struct ucred: process, user, group
ASKED = 4096  # questions that are heard: none is ever accepted, and each keeps its place


@contextmanager
def only_one(path: Path) -> Iterator[None]:
    """Hold the claim on a path; UsageError with the process that has it already."""
    name = "\0thrustd-" + hashlib.sha256(os.path.realpath(path).encode()).hexdigest()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as claim:
        try:
            claim.bind(name)
        except OSError:
            raise UsageError(
                f"{path}: flown by {_owner(name)} already, expected one process per configuration, checkpoint and log"
            ) from None
        claim.listen(ASKED)  # so that a second process can ask who we are
        yield


def _owner(name: str) -> str:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as question:
        question.setblocking(False)
        try:
            question.connect(name)
            process, *_ = PEER.unpack(question.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER.size))
        except OSError:  # it ended just now, or others ask, too
            return "another process"
    return f"process {process}"
