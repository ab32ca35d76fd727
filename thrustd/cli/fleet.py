"""The verb fleet: replay, compare, identify or judge the health of hundreds of files on Dask, one table for all."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from thrustd.cli.files import read_models
from thrustd.cli.verb import Verbs, add_json, add_verb, console, file_type, note, progress, tell
from thrustd.core.errors import UsageError

if TYPE_CHECKING:
    from thrustd.fleet.fleet import Job
    from thrustd.records.rows import Row


def add_verbs(verbs: Verbs) -> None:
    fleet = add_verb(
        verbs, "fleet", fleet_verb, "replay, compare or identify many files, or follow engine health, in one table",
        "thrustd fleet replay flights/*.mcap -o table.parquet\n"
        "  thrustd fleet health flights/*.mcap -o health.parquet --report health.html\n"
        "  thrustd fleet compare bench/*.csv --model models/left-upper.json -o table.parquet\n"
        "  thrustd fleet identify bench/*.csv --out models/ -o table.parquet --scheduler tcp://10.0.0.5:8786",
    )  # fmt: skip
    fleet.add_argument("job", choices=("replay", "compare", "identify", "health"))
    fleet.add_argument("files", type=Path, nargs="+", help="flight logs (replay, health) or recordings")
    fleet.add_argument("-o", "--table", type=file_type(".parquet"), required=True, help="table to write (Parquet)")
    fleet.add_argument("--model", type=Path, action="append", default=[], help="with compare: model artifact")
    fleet.add_argument("--structure", action="append", default=[], help="with identify: structure (default hw-pwl)")
    fleet.add_argument(
        "--out", type=Path, metavar="FOLDER", help="folder for estimate logs (replay) or models (identify)"
    )
    fleet.add_argument(
        "--processes",
        type=int,
        default=os.cpu_count() or 1,
        metavar="N",
        help="number of processes on this machine (default: one per core)",
    )
    fleet.add_argument("--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler")
    fleet.add_argument("--deck", type=Path, help="with health: brochure deck (default: the shipped one)")
    fleet.add_argument("--report", type=file_type(".html"), help="with health: page to write (.html)")
    add_json(fleet)


def fleet_verb(arguments: argparse.Namespace) -> int:
    try:
        from thrustd.fleet.fleet import at, local, run_fleet
    except ModuleNotFoundError as problem:
        raise UsageError(
            f"thrustd fleet: {problem.name} is not installed, expected: pip install 'thrustd[fleet]'"
        ) from None
    from thrustd.records.rows import write_rows

    if not 1 <= arguments.processes <= 1024:
        raise UsageError(f"--processes {arguments.processes}: expected 1 to 1024")
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
    workers = at(arguments.scheduler) if arguments.scheduler else local(arguments.processes)
    with progress(f"fleet {arguments.job}") as advance:
        rows = run_fleet(_job(arguments), [file.absolute() for file in arguments.files], workers, advance)
    write_rows(rows, arguments.table)
    errors = [row for row in rows if row["error"]]
    for row in errors:
        note(f"{row['error']}")
    if arguments.job == "health":
        _tell_health(rows, arguments)
        return 1 if errors else 0
    report = {"table": str(arguments.table), "files": len(arguments.files), "rows": len(rows), "errors": len(errors)}
    tell(arguments, report, lambda: print(", ".join(f"{key}: {value}" for key, value in report.items())))
    return 1 if errors else 0


def _tell_health(rows: "list[Row]", arguments: argparse.Namespace) -> None:
    from thrustd.flighttest.questions import health_of

    found = health_of(rows)
    if arguments.report is not None:
        found.write_page(arguments.report)
    tell(arguments, found.found, lambda: found.show(console()))


def _job(arguments: argparse.Namespace) -> "Job":
    from thrustd.fleet.fleet import CompareJob, IdentifyJob, ReplayJob
    from thrustd.flighttest.health import HealthJob
    from thrustd.installation.shipped import own_or_shipped, read_deck

    out = str(arguments.out.absolute()) if arguments.out is not None else ""
    if arguments.job == "replay":
        return ReplayJob(out)
    if arguments.job == "health":
        read_deck(arguments.deck)  # what is wrong with it is said once, before any work
        return HealthJob(str(arguments.deck.absolute()) if arguments.deck is not None else "")
    if arguments.job == "compare":
        if not arguments.model:
            raise UsageError("thrustd fleet compare: --model is missing; expected at least one model artifact")
        models = [own_or_shipped(path, "--model") for path in arguments.model]
        read_models(models)  # what is wrong with one is said once, before any work
        return CompareJob(tuple(str(model.absolute()) for model in models))
    if not out:
        raise UsageError("thrustd fleet identify: --out is missing; expected the folder for the models")
    return IdentifyJob(out, tuple(arguments.structure) or ("hw-pwl",))
