"""Opens the page: a loopback socket, a fresh token, the server until it is told to stop.

The token never stands on a command line, where other users of the machine could read it: the browser is given a file
that only this user may open, and that leads to the page.
"""

import asyncio
import logging
import os
import secrets
import socket
import webbrowser
from collections.abc import Callable
from pathlib import Path

import uvicorn

from thrustd.core.errors import UsageError
from thrustd.workbench.guard import Guard
from thrustd.workbench.server import application

LOOPBACK = "127.0.0.1"
DOOR = """<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0;url={url}"><title>thrustd workbench</title>
"""


def serve(root: Path, port: int = 0, browser: bool = True, announce: Callable[[str], None] = print) -> None:
    """Serve `root` until interrupted; `announce` hears the address to open."""
    with listening(port) as listener:
        token = secrets.token_urlsafe(24)
        port = listener.getsockname()[1]
        app = Guard(application(root), token, port)
        url = f"http://{LOOPBACK}:{port}/{token}/"
        announce(url)
        door = _door(root, url)
        if browser:
            webbrowser.open(door.as_uri())
        config = uvicorn.Config(
            app, log_level="warning", access_log=False, server_header=False, timeout_graceful_shutdown=1, ws="none"
        )
        logging.getLogger("uvicorn.error").addFilter(_not_at_the_end)
        try:
            uvicorn.Server(config).run(sockets=[listener])
        finally:
            door.unlink(missing_ok=True)


def _not_at_the_end(record: logging.LogRecord) -> bool:
    """Pages that are still open are cut off when the server ends; uvicorn calls that an error, with a traceback."""
    problem = record.exc_info[1] if record.exc_info else None
    return not isinstance(problem, asyncio.CancelledError) and "timeout graceful shutdown" not in record.getMessage()


def listening(port: int) -> socket.socket:
    """A socket on the loopback interface; UsageError when the port is taken."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)  # so that asyncio sets TCP_NODELAY
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((LOOPBACK, port))
        listener.listen()  # before the address is told: whoever is early waits instead of being refused
    except (OSError, OverflowError) as problem:
        listener.close()
        raise UsageError(f"--port {port}: cannot be used on {LOOPBACK}: {problem}") from None
    return listener


def _door(root: Path, url: str) -> Path:
    """A file only this user can read which leads the browser to the page."""
    door = root.resolve() / ".thrustd" / "open.html"
    door.unlink(missing_ok=True)
    descriptor = os.open(door, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(DOOR.format(url=url))
    return door
