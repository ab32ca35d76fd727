"""A CAN bus between processes of one machine that needs no network: python-can's interface "fifo".

    can.Bus(interface="fifo", channel="a folder")

Every member owns a named pipe in the folder and writes what it sends into the pipes of all others, one
`struct can_frame` of 16 bytes at a time (below PIPE_BUF: frames never mix). It stands in for SocketCAN where the
kernel has no vcan. As there, a frame nobody listens to is gone, and a member that does not read loses what does not
fit. Unlike there, a sender with time (`timeout` not 0) first waits for room: a flight can be played faster than life
and nothing is lost.
"""

import errno
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from fcntl import F_SETPIPE_SZ, fcntl
from pathlib import Path
from select import POLLIN, POLLOUT, poll
from struct import Struct
from uuid import uuid4

import can

CAN_FRAME = Struct("=IB3x8s")  # linux/can.h: identifier and flags, length, padding, data
EXTENDED, REMOTE, ERROR, IDENT = 0x80000000, 0x40000000, 0x20000000, 0x1FFFFFFF
PIPE_BYTES = 1 << 20  # the most that the kernel gives without privileges: 65 536 frames
READ_BYTES = 4096 * CAN_FRAME.size
LOOK_S = 0.1  # how often a sender looks for new members
LONGEST_WAIT_S = 5.0  # for room at one member; from then on it is not waited for until it has read something


class FifoBus(can.BusABC):
    """One member."""

    def __init__(self, channel: str, can_filters: can.typechecking.CanFilters | None = None, **kwargs: object) -> None:
        self._folder = Path(channel)
        self._name = uuid4().hex
        self._heard: Iterator[tuple[int, int, bytes]] = iter(())
        self._others: dict[str, int] = {}
        self._stalled: set[str] = set()
        self._looked_s = -LOOK_S
        self.channel_info = f"fifo {channel}"
        try:
            self._inbox = self._open_inbox()
        except OSError as problem:
            raise can.CanInitializationError(f"{channel}: {problem.strerror}") from None
        super().__init__(channel, can_filters, **kwargs)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Into every other member's pipe, waiting up to `timeout` seconds for room in each."""
        flags = EXTENDED * msg.is_extended_id | REMOTE * msg.is_remote_frame | ERROR * msg.is_error_frame
        frame = CAN_FRAME.pack(msg.arbitration_id | flags, len(msg.data), bytes(msg.data))
        self._look()
        for name in list(self._others):
            try:
                self._write(name, frame, LONGEST_WAIT_S if timeout is None else timeout)
            except BrokenPipeError:  # its reader is gone
                self._forget(name)

    def shutdown(self) -> None:
        """Leave the bus."""
        if self._is_shutdown:
            return
        super().shutdown()
        (self._folder / self._name).unlink(missing_ok=True)
        os.close(self._inbox)
        for pipe in self._others.values():
            os.close(pipe)
        self._others.clear()

    def fileno(self) -> int:
        return self._inbox

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        frame = next(self._heard, None)
        if frame is None:
            self._heard = self._read(timeout)
            frame = next(self._heard, None)
        return None if frame is None else _message(*frame), False

    def _read(self, timeout: float | None) -> Iterator[tuple[int, int, bytes]]:
        """What has arrived, waiting up to `timeout` seconds for the first frame."""
        _wait(self._inbox, POLLIN, timeout)
        with suppress(BlockingIOError):
            return CAN_FRAME.iter_unpack(os.read(self._inbox, READ_BYTES))
        return iter(())

    def _look(self) -> None:
        """Every now and then: who has come."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        present = {name for name in os.listdir(self._folder) if not name.startswith(".")}
        for name in present - {self._name, *self._others}:
            self._meet(name)

    def _meet(self, name: str) -> None:
        path = self._folder / name
        try:
            self._others[name] = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as problem:
            if problem.errno == errno.ENXIO:  # nobody reads it: its owner was killed
                path.unlink(missing_ok=True)

    def _forget(self, name: str) -> None:
        os.close(self._others.pop(name))
        self._stalled.discard(name)
        (self._folder / name).unlink(missing_ok=True)

    def _write(self, name: str, frame: bytes, wait_s: float) -> None:
        pipe, room = self._others[name], True
        while room:
            with suppress(BlockingIOError):
                os.write(pipe, frame)
                self._stalled.discard(name)
                return
            room = name not in self._stalled and _wait(pipe, POLLOUT, wait_s)
        if wait_s > 0:
            self._stalled.add(name)

    def _open_inbox(self) -> int:
        """Our pipe; it gets its name when it can be written, so nobody takes it for one that was left behind."""
        self._folder.mkdir(parents=True, exist_ok=True)
        unborn = self._folder / f".{self._name}"
        os.mkfifo(unborn)
        inbox = os.open(unborn, os.O_RDWR | os.O_NONBLOCK)  # also for writing: no end of file when others leave
        with suppress(OSError):  # a smaller pipe works too
            fcntl(inbox, F_SETPIPE_SZ, PIPE_BYTES)
        unborn.rename(self._folder / self._name)
        return inbox


def _wait(descriptor: int, for_what: int, timeout_s: float | None) -> bool:
    watch = poll()
    watch.register(descriptor, for_what)
    return bool(watch.poll(None if timeout_s is None else timeout_s * 1000.0))


def _message(ident: int, length: int, data: bytes) -> can.Message:
    return can.Message(
        timestamp=time.time(),
        arbitration_id=ident & IDENT,
        is_extended_id=bool(ident & EXTENDED),
        is_remote_frame=bool(ident & REMOTE),
        is_error_frame=bool(ident & ERROR),
        data=data[:length],
    )
