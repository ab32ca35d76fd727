"""A command of thrustd that lives faster: `python -m benchmarks.fast_clock 10 run aircraft.toml`.

The process's clocks and the waits of its threads run so many times as fast as ours. A flight played at that speed is
then, to an otherwise unchanged daemon, a flight in real time: rates, ages and device times agree. Its queue holds as
much of our time as in flight: another process that takes the processor for a second takes a second of ours.
"""

import sys
import threading
import time


def hurry(speed: float) -> None:
    """From now on, for whoever asks Python for the time."""
    monotonic_ns, wait = time.monotonic_ns, threading.Event.wait
    start_ns, utc_ns = monotonic_ns(), time.time_ns()

    def since_ns() -> int:
        return int((monotonic_ns() - start_ns) * speed)

    def shorter_wait(flag: threading.Event, timeout: float | None = None) -> bool:
        return wait(flag, None if timeout is None else timeout / speed)

    vars(time).update(monotonic_ns=lambda: start_ns + since_ns(), time_ns=lambda: utc_ns + since_ns())
    setattr(threading.Event, "wait", shorter_wait)  # noqa: B010 - so does everybody who waits


def main() -> int:
    speed = float(sys.argv[1])
    hurry(speed)
    from thrustd.__main__ import main as thrustd  # after the clocks: they are bound when a module is loaded
    from thrustd.sources import merge

    merge.EventQueue.__init__.__defaults__ = (int(merge.MAX_EVENTS * speed),)
    return thrustd(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
