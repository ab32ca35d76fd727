"""Columns of anyone's file in the roles that the verbs read, and what they are judged against (`--against`)."""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thrustd.cli.verb import note
from thrustd.core.errors import RecordingError, UsageError
from thrustd.installation.folder import configuration_of
from thrustd.installation.shipped import CONFIGURATION, DECK, given_or_shipped

if TYPE_CHECKING:
    from thrustd.core.aircraft import MountPlace
    from thrustd.installation.installation import Installation
    from thrustd.model.artifact import ModelSpec
    from thrustd.records.recording import Recording
    from thrustd.records.roles import Roles
    from thrustd.records.time_axis import TimeAxis

TIME = "time_s"
MOUNT_COLUMNS = ("deformation_mm", "force_N")


def add_roles(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--input", metavar="COLUMN", default=MOUNT_COLUMNS[0], help=f"what the model reads (default {MOUNT_COLUMNS[0]})"
    )
    parser.add_argument(
        "--output",
        metavar="COLUMN",
        default=MOUNT_COLUMNS[1],
        help=f"what the model gives, in any unit, sign and scale (default {MOUNT_COLUMNS[1]})",
    )
    add_time(parser)
    add_rename(parser)


def add_time(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--time", metavar="COLUMN", default=TIME, help=f"column of time in seconds (default {TIME})")
    parser.add_argument("--rate", type=float, metavar="HZ", help="samples per second, for files without a time column")


def add_rename(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--rename", action="append", default=[], metavar="THEIRS=OURS",
        help="rename a column; OURS*FACTOR+OFFSET converts its unit; may be repeated",
    )  # fmt: skip


def add_reference(parser: argparse.ArgumentParser) -> None:
    """What a measurement is judged against, in whose columns."""
    add_roles(parser)
    parser.add_argument(
        "--trust-units",
        action="store_true",
        help="take the units from the column names, whatever the size of the values",
    )
    parser.add_argument("--against", default="", metavar="COLUMN", help="reference: a column, or 'brochure'")
    add_mount(parser, "mount of a flight recording, e.g. left_upper")
    parser.add_argument("--deck", type=Path, help=f"with --against brochure (default: --config's, or {DECK})")


def add_mount(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument("--mount", default="", help=what)
    parser.add_argument("--config", type=configuration_of, help=f"with --mount (default: the shipped {CONFIGURATION})")


def recordings_in_roles(paths: Sequence[Path], arguments: argparse.Namespace, roles: "Roles") -> list["Recording"]:
    """Recordings with the chosen columns under the names that every estimation reads; excluded stretches left out."""
    from thrustd.records.marks import read_marks, without_excluded
    from thrustd.records.roles import with_roles

    found = []
    for path, record in _timed(paths, arguments):
        _check_there(record, roles)
        found.append(without_excluded(with_roles(record, roles), read_marks(path)))
    return found


def recordings_to_judge(paths: Sequence[Path], arguments: argparse.Namespace) -> list["Recording"]:
    """The same where a recording may name its reference otherwise (--against) or by its mount (--mount)."""
    from thrustd.records.marks import read_marks, without_excluded
    from thrustd.records.roles import with_trusted_units

    roles = roles_of_arguments(arguments)
    _check_one_way(arguments, roles)
    if roles.own:
        records = [without_excluded(record, read_marks(path)) for path, record in _timed(paths, arguments)]
    else:
        records = recordings_in_roles(paths, arguments, roles)
    for record in records:
        for remark in (line for line in record.notes if line.startswith(TIME)):  # another clock than its own
            note(f"{record.name}: {remark}")
    return [with_trusted_units(record) for record in records] if arguments.trust_units else records


@contextmanager
def own_words(roles: "Roles") -> Iterator[None]:
    """Complaints about a recording name the columns as its file does."""
    try:
        yield
    except RecordingError as problem:
        raise RecordingError(roles.in_words(str(problem))) from problem


def roles_of_arguments(arguments: argparse.Namespace) -> "Roles":
    from thrustd.records.roles import Roles

    return Roles(arguments.input, arguments.output)


def time_axis(arguments: argparse.Namespace) -> "TimeAxis":
    """As --time and --rate say."""
    from thrustd.records.time_axis import TimeAxis

    if arguments.rate is not None and not 0 < arguments.rate <= 1e9:
        raise UsageError(f"--rate {arguments.rate:g}: expected samples per second, above 0, at most 1e9")
    if arguments.time != TIME and arguments.rate is not None:
        raise UsageError(f"--rate {arguments.rate:g}: --time {arguments.time} says when; expected one of both")
    return TimeAxis(arguments.time, arguments.rate)


def _timed(paths: Sequence[Path], arguments: argparse.Namespace) -> list[tuple[Path, "Recording"]]:
    from thrustd.records.rename import read_rename
    from thrustd.records.time_axis import read_timed

    axis = time_axis(arguments)
    renames = [read_rename(text) for text in arguments.rename]
    return [(path, read_timed(path, axis, renames)) for path in paths]


def _check_there(record: "Recording", roles: "Roles") -> None:
    from thrustd.records.recording import TIME, no_column

    missing = [name for name in roles if name not in record and name != TIME]
    if missing:
        left_out = "".join(f"; {line}" for line in record.notes)
        raise UsageError(
            f"{no_column(record.name, missing[0], record.channels)}{left_out}; "
            "expected their names with --input COLUMN and --output COLUMN"
        )


def _check_one_way(arguments: argparse.Namespace, roles: "Roles") -> None:
    """A column has one role, said once."""
    if arguments.against and roles.output != MOUNT_COLUMNS[1]:
        raise UsageError(f"--output {roles.output} and --against {arguments.against}: expected one of the two")
    if arguments.mount and not roles.own:
        raise UsageError(f"--mount {arguments.mount} names the columns of a flight: expected no --input or --output")


def reference(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the measurement is judged against, as all three verbs take it."""
    from thrustd.installation.shipped import read_deck

    deck = None
    if arguments.against == "brochure":
        own = arguments.deck is None and arguments.config is not None
        deck = _installation(arguments).deck() if own else read_deck(arguments.deck)
    return {"against": arguments.against, "mount": place_in_aircraft(arguments), "deck": deck}


def place_in_aircraft(arguments: argparse.Namespace) -> "MountPlace | None":
    """The mount that is looked at, as the configuration has it."""
    return _installation(arguments).place(arguments.mount) if arguments.mount else None


def note_other_mounts(arguments: argparse.Namespace, specs: Iterable["ModelSpec"]) -> None:
    """A line where a model is called as another mount of the configuration."""
    if not arguments.mount:
        return
    known = {mount.name for mount in _installation(arguments).config.mount} - {arguments.mount}
    for name in dict.fromkeys(spec.name for spec in specs):
        if name.replace("-", "_") in known:
            note(f"warning: --mount {arguments.mount}: the model is called {name}, another mount of the configuration")


def others_of_engine(arguments: argparse.Namespace) -> "tuple[tuple[MountPlace, ModelSpec], ...]":
    """The other mounts of its engine with their models."""
    return _installation(arguments).others_of(arguments.mount) if arguments.mount else ()


def _installation(arguments: argparse.Namespace) -> "Installation":
    from thrustd.installation.installation import read_installation  # and with it all that flies, compiled

    return read_installation(given_or_shipped(arguments.config, CONFIGURATION, "--config"))
