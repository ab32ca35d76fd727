"""The server ends quietly although pages are still open."""

import asyncio
import logging

from thrustd.workbench.serve import _not_at_the_end


def record(message, problem):
    info = (type(problem), problem, None) if problem else None
    return logging.LogRecord("uvicorn.error", logging.ERROR, "", 0, message, (), info)


def test_only_the_end_of_open_pages_is_kept_quiet():
    assert not _not_at_the_end(record("Exception in ASGI application", asyncio.CancelledError()))
    assert not _not_at_the_end(record("Cancel 1 running task(s), timeout graceful shutdown exceeded", None))
    assert _not_at_the_end(record("Exception in ASGI application", ValueError("x")))
