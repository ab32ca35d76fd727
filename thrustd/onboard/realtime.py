"""What the kernel may grant a process that must not be late: real-time scheduling, memory that stays in memory."""

import ctypes
import os
import resource
from collections.abc import Callable

from thrustd.core.config import Realtime

MCL_CURRENT_AND_FUTURE = 3  # sys/mman.h


def ask_for(wish: Realtime, say: Callable[[str], None]) -> None:
    """Set what is wished for the calling thread and those it starts from now on; a refusal is said, not raised.

    All threads of a process share its interpreter: one that waits for a processor makes the others wait for it.
    """
    if wish.fifo_priority:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(wish.fifo_priority))
        except OSError as problem:
            say(f"realtime.fifo_priority = {wish.fifo_priority}: refused: {problem.strerror}; ordinary scheduling")
    if wish.lock_memory:
        _lock_memory(say)


def _lock_memory(say: Callable[[str], None]) -> None:
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != resource.RLIM_INFINITY:
        # with a limit a later allocation could fail in flight: rather swap than stop
        say("realtime.lock_memory = true: refused: RLIMIT_MEMLOCK is not unlimited; memory is not locked")
        return
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(MCL_CURRENT_AND_FUTURE) != 0:
        say(f"realtime.lock_memory = true: refused: {os.strerror(ctypes.get_errno())}; memory is not locked")
