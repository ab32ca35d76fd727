"""What all verbs share: the parser that complains in one line, JSON output, the console, the progress bar."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import msgspec

from thrustd.core.errors import UsageError, printable

if TYPE_CHECKING:
    from rich.console import Console

Verb = Callable[[argparse.Namespace], int]
Verbs = Any  # argparse's sub-parser collection has no public type
Advance = Callable[[float], None]  # fraction done, 0 to 1


class Help(argparse.RawDescriptionHelpFormatter):
    """An option that takes a file says FILE, not its own name once more."""

    def _get_default_metavar_for_optional(self, action: argparse.Action) -> str:
        is_file = action.type is Path or getattr(action.type, "__name__", "") == "file_name"
        return "FILE" if is_file else super()._get_default_metavar_for_optional(action)


class Parser(argparse.ArgumentParser):
    """Argument errors are one line, like every other error."""

    def error(self, message: str) -> NoReturn:
        verb = self.prog.removeprefix("thrustd").strip()
        raise UsageError(f"{verb}{': ' if verb else ''}{message} (see {self.prog} --help)")


def add_verb(verbs: Verbs, name: str, verb: Verb, summary: str, example: str) -> argparse.ArgumentParser:
    """A sub-command with its one-line summary and an example in the help."""
    parser: argparse.ArgumentParser = verbs.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=Help,
    )
    parser.set_defaults(verb=verb)
    return parser


def file_type(suffix: str) -> Callable[[str], Path]:
    """For an argument that names a file of one type to write."""

    def file_name(text: str) -> Path:
        if Path(text).suffix.lower() != suffix:
            raise argparse.ArgumentTypeError(f"{text}: expected a name that ends in {suffix}")
        return Path(text)

    return file_name


def day(text: str) -> date:
    """For an argument that dates a measurement."""
    try:
        on = date.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}: expected a day of the calendar, year-month-day") from None
    if on > date.today() + timedelta(days=1):  # it is tomorrow somewhere
        raise argparse.ArgumentTypeError(f"{text}: expected a day that has been")
    return on


def seed(text: str) -> int:
    """For an argument that numbers a draw."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text}: expected a whole number, 0 or more")
    return int(text)


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output and nothing else")


def print_json(value: Any) -> None:
    """One JSON object; NaN and infinity become null."""
    sys.stdout.write(msgspec.json.encode(value).decode() + "\n")


def tell(arguments: argparse.Namespace, value: Any, say: Callable[[], object]) -> None:
    """The JSON object where it was asked for, else what `say` prints."""
    print_json(value) if arguments.json else say()


def console() -> "Console":
    """Where tables go: as wide as the terminal, 120 columns into a file or pipe."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 120, markup=False, highlight=False)


def note(text: str) -> None:
    """A remark for the user: standard error, so that standard output stays clean."""
    sys.stderr.write(printable(text) + "\n")


@contextmanager
def progress(label: str) -> Iterator[Advance]:
    """A bar on standard error that takes the fraction done; into a file or pipe one line when it is done.

    It leaves no trace when the work fails: bad input is one line, and that line is the message.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=Console(stderr=True))
    task = bar.add_task(printable(label), total=1.0)

    def advance(fraction: float) -> None:
        bar.update(task, completed=fraction)

    bar.start()
    try:
        yield advance
    except BaseException:
        bar.live.transient = True
        bar.live.stop()
        raise
    advance(1.0)
    bar.stop()
