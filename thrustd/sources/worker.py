"""The thread of a receiver: it keeps something open, says when it goes and comes back, and ends when told."""

from collections.abc import Callable
from contextlib import suppress
from threading import Event as Flag
from threading import Thread
from typing import TypeVar

FIRST_DELAY_S = 0.1
LONGEST_DELAY_S = 2.0
JOIN_S = 5.0

Port = TypeVar("Port")


class Worker:
    """One daemon thread around `work`, which returns soon after `stopping` is set."""

    __slots__ = ("_thread", "stopping")

    def __init__(self, name: str, work: Callable[[], None]) -> None:
        self.stopping = Flag()
        self._thread = Thread(target=work, name=name, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        """Ask the thread to end and wait for it."""
        self.stopping.set()
        if self._thread.is_alive():
            self._thread.join(JOIN_S)


def keep_open(
    stopping: Flag,
    open_port: Callable[[], Port],
    receive: Callable[[Port], None],
    tell: Callable[[str, bool], None],
) -> None:
    """Open, receive until it fails, open again with growing delays; `tell` "unplugged" and its end once each.

    `open_port` and `receive` may raise what they like: drivers do (`termios.error` is no OSError), and whatever it is,
    the port is not there.
    """
    missing, delay_s = False, FIRST_DELAY_S
    while not stopping.is_set():
        port = None
        with suppress(Exception):
            port = open_port()
        if port is not None:
            if missing:
                tell("unplugged", False)
            missing, delay_s = False, FIRST_DELAY_S
            with suppress(Exception):
                receive(port)
        if not missing and not stopping.is_set():
            tell("unplugged", True)
        missing = True
        stopping.wait(delay_s)
        delay_s = min(2 * delay_s, LONGEST_DELAY_S)
