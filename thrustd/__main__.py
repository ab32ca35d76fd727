"""`thrustd VERB ...`: hands over to the verb; bad input is one line and exit status 2, never a traceback."""

import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by numpy at its start: matrices here are small, threads spin

from thrustd import __version__
from thrustd.cli import (
    budget,
    commissioning,
    data,
    demo,
    diagnosis,
    fleet,
    flight,
    flighttest,
    identification,
    simulate,
    status,
    workbench,
)
from thrustd.cli.files import check_outputs, check_text
from thrustd.cli.verb import Parser, note
from thrustd.core.errors import ThrustdError, one_line


def parser() -> Parser:
    top = Parser(prog="thrustd", description="In-flight jet thrust from the deformation of the engine mounts.")
    top.add_argument("--version", action="version", version=f"thrustd {__version__}")
    verbs = top.add_subparsers(title="verbs", metavar="VERB", required=True, parser_class=Parser)
    for group in (
        demo,
        flight,
        status,
        simulate,
        flighttest,
        data,
        identification,
        commissioning,
        budget,
        diagnosis,
        fleet,
        workbench,
    ):
        group.add_verbs(verbs)
    return top


def _terminated(number: int, frame: object) -> NoReturn:
    """Ended from outside: as if interrupted, so that nothing half-written stays behind."""
    raise SystemExit(128 + number)


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 done, 1 the answer is no, 2 bad input, 130 interrupted."""
    with suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGTERM, _terminated)  # the daemon sets its own
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # as it is under nohup
            signal.signal(signal.SIGHUP, _terminated)
    try:
        check_text(sys.argv[1:] if arguments is None else arguments)
        chosen = parser().parse_args(arguments)
        check_outputs(vars(chosen))
        status: int = chosen.verb(chosen)
        return status
    except ThrustdError as problem:
        note(f"thrustd: {one_line(str(problem))}")
        return 2
    except KeyboardInterrupt:
        note("thrustd: interrupted")
        return 130
    except BrokenPipeError:
        return 0
    except OSError as problem:  # a name that is too long, a folder that may not be searched
        where = f"{problem.filename}: " if problem.filename else ""
        note(f"thrustd: {one_line(where + (problem.strerror or str(problem)))}")
        return 2
    finally:
        gc.enable()  # a verb that failed while it loaded had it off


if __name__ == "__main__":
    sys.exit(main())
