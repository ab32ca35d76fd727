"""One process per configuration: a second one would send every estimate twice and overwrite the first one's checkpoint.

The claim is a socket in Linux's abstract name space, called after the configuration's real path: it needs no file that
could be left behind, survives an editor that replaces the configuration, and is gone the moment its process is.
"""

import hashlib
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from struct import Struct

from thrustd.core.errors import UsageError

PEER = Struct("3i")  # struct ucred: process, user, group
ASKED = 4096  # questions that are heard: none is ever accepted, and each keeps its place


@contextmanager
def only_one(config: Path) -> Iterator[None]:
    """Hold the claim on a configuration; UsageError with the process that has it already."""
    name = "\0thrustd-" + hashlib.sha256(str(config.resolve()).encode()).hexdigest()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as claim:
        try:
            claim.bind(name)
        except OSError:
            raise UsageError(
                f"{config}: flown by {_owner(name)} already, expected one process per configuration"
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
