"""`thrustd VERB ...`: hands over to the verb; bad input is one line and exit status 2, never a traceback."""

import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NoReturn

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by numpy at its start: matrices here are small, threads spin

from thrustd import __version__
from thrustd.core.errors import ThrustdError, one_line

if TYPE_CHECKING:
    from thrustd.cli.verb import Parser


def parser() -> "Parser":
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
    from thrustd.cli.verb import Parser

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


def _ended(words: str, status: int) -> int:
    sys.stderr.write(f"thrustd: {one_line(words)}\n")
    return status


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 done, 1 the answer is no, 2 bad input, 130 interrupted."""
    with suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGTERM, _terminated)  # the daemon sets its own
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # as it is under nohup
            signal.signal(signal.SIGHUP, _terminated)
    try:  # also while the verbs are loaded: whoever presses Ctrl-C at once gets no traceback
        from thrustd.cli.files import check_outputs, check_text

        check_text(sys.argv[1:] if arguments is None else arguments)
        chosen = parser().parse_args(arguments)
        check_outputs(vars(chosen))
        status: int = chosen.verb(chosen)
        return status
    except ThrustdError as problem:
        return _ended(str(problem), 2)
    except KeyboardInterrupt:
        return _ended("interrupted", 130)
    except BrokenPipeError:
        return 0
    except OSError as problem:  # a name that is too long, a folder that may not be searched
        where = f"{problem.filename}: " if problem.filename else ""
        return _ended(where + (problem.strerror or str(problem)), 2)
    finally:
        gc.enable()  # a verb that failed while it loaded had it off


if __name__ == "__main__":
    sys.exit(main())
