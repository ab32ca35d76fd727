"""Verbs of a flight test: points, performance, transients."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from thrustd.cli.verb import Verbs, add_json, add_verb, console, file_type, progress, tell
from thrustd.core.errors import UsageError
from thrustd.installation.shipped import AIRCRAFT

if TYPE_CHECKING:
    from thrustd.core.steady import SteadyLimits
    from thrustd.flighttest.answer import Answer


def add_verbs(verbs: Verbs) -> None:
    _add_points(verbs)
    _add_performance(verbs)
    _add_transients(verbs)


def _add_points(verbs: Verbs) -> None:
    points = add_verb(
        verbs, "points", points_verb, "find the test points of a flight: steady windows with thrust, fuel flow and U95",
        "thrustd points out/estimates.mcap -o points.csv --report points.html\n"
        "  thrustd points flight.npz --marks measurement_running\n"
        "  thrustd points out/estimates.mcap --auto --limit mach=0.01 --limit least_s=60",
    )  # fmt: skip
    points.add_argument(
        "log", type=Path, help="estimate log, raw log (replayed first) or recording with N1 and air data"
    )
    how = points.add_mutually_exclusive_group()
    how.add_argument("--auto", action="store_true", help="find points by the limits (default for a log without marks)")
    how.add_argument(
        "--marks",
        metavar="CSV|CHANNEL",
        help="take windows from a CSV (start_s, end_s) or from where a channel is above 0",
    )
    add_limits(points)
    add_outputs(points)


def _add_performance(verbs: Verbs) -> None:
    performance = add_verb(
        verbs, "performance", performance_verb, "fit the drag polar of flights: C_D0, Oswald's e, L/D, with intervals",
        "thrustd performance out/estimates.mcap --mass-sheet mass.toml --report polar.html\n"
        "  thrustd performance flights/*.npz -o points.parquet      (recordings with a column mass_kg)",
    )  # fmt: skip
    performance.add_argument("log", type=Path, nargs="+", help="estimate logs, raw logs or recordings")
    performance.add_argument(
        "--mass-sheet", type=Path, action="append", default=[], metavar="TOML",
        help="file with empty_kg, payload_kg, fuel_kg, std_kg; one per log, or one for all",
    )  # fmt: skip
    performance.add_argument(
        "--marks", metavar="CSV|CHANNEL", help="use windows of a CSV, or where a channel is above 0"
    )
    add_limits(performance)
    add_outputs(performance)


def _add_transients(verbs: Verbs) -> None:
    transients = add_verb(
        verbs, "transients", transients_verb, "find spool-ups, overshoots, possible flame-outs and surges of a flight",
        "thrustd transients out/estimates.mcap --report transients.html",
    )  # fmt: skip
    transients.add_argument("log", type=Path, help="estimate log, raw log (replayed first) or recording with N1")
    add_outputs(transients)


def add_outputs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--deck", type=Path, help="brochure deck for recordings without estimates")
    parser.add_argument("--aircraft", type=Path, help=f"aircraft data with [fuel] and [wing] (default {AIRCRAFT})")
    parser.add_argument("-o", "--out", type=Path, help="table to write (.csv or .parquet)")
    parser.add_argument("--report", type=file_type(".html"), help="page to write (.html): table and picture")
    add_json(parser)


def check_table(out: Path | None) -> None:
    """Before any work."""
    from thrustd.records.rows import TYPES

    if out is not None and out.suffix.lower() not in TYPES:
        raise UsageError(f"{out}: expected a name that ends in {' or '.join(TYPES)}")


def add_limits(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--limit", action="append", default=[], metavar="NAME=VALUE",
        help="change a limit: mach, altitude_m, n1_pct, accel_x_g, load_factor_g, least_n1_pct, least_s",
    )  # fmt: skip


def limits_of(arguments: argparse.Namespace) -> "SteadyLimits":
    """The defaults with what `--limit` changes."""
    import msgspec

    from thrustd.core.steady import SteadyLimits

    known = msgspec.to_builtins(SteadyLimits())
    for text in arguments.limit:
        name, _, value = text.partition("=")
        if name not in known:
            raise UsageError(f"--limit {text}: expected NAME=VALUE, NAME one of {', '.join(known)}")
        try:
            known[name] = float(value)
        except ValueError:
            raise UsageError(f"--limit {text}: expected a number behind =") from None
        if not 0 < known[name] < 1e6:
            raise UsageError(f"--limit {text}: expected above 0")
    return SteadyLimits(**known)


def points_verb(arguments: argparse.Namespace) -> int:
    from thrustd.flighttest.questions import points

    check_table(arguments.out)
    limits, given = limits_of(arguments), (arguments.deck, arguments.aircraft)
    with progress(f"points of {arguments.log.name}"):
        found = points(arguments.log, limits, arguments.marks, arguments.auto, *given)
    return _hand_over(arguments, found)


def performance_verb(arguments: argparse.Namespace) -> int:
    from thrustd.flighttest.mass_sheet import read_mass_sheet
    from thrustd.flighttest.questions import performance

    check_table(arguments.out)
    limits, given = limits_of(arguments), (arguments.deck, arguments.aircraft)
    sheets = [read_mass_sheet(path) for path in arguments.mass_sheet]
    with progress("performance") as advance:
        found = performance(arguments.log, sheets, limits, arguments.marks, *given, lambda share, _: advance(share))
    return _hand_over(arguments, found)


def transients_verb(arguments: argparse.Namespace) -> int:
    from thrustd.flighttest.questions import transients

    check_table(arguments.out)
    with progress(f"transients of {arguments.log.name}"):
        found = transients(arguments.log, arguments.deck, arguments.aircraft)
    return _hand_over(arguments, found)


def _hand_over(arguments: argparse.Namespace, answer: "Answer") -> int:
    """What was found, where it was asked for: table, page, JSON or terminal."""
    from thrustd.records.rows import write_rows

    if arguments.out is not None:
        write_rows(answer.found.rows(), arguments.out)
    if arguments.report is not None:
        answer.write_page(arguments.report)
    tell(arguments, answer.found, lambda: answer.show(console()))
    return 0
