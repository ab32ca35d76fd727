"""The verb budget."""

import argparse
from pathlib import Path
from typing import Any

from thrustd.cli.verb import Verbs, add_json, add_verb, console, note, print_json
from thrustd.core.errors import UsageError
from thrustd.installation.folder import configuration_of

LEAST_S = 2.0  # of a window: terms are told once a second


def add_verbs(verbs: Verbs) -> None:
    budget = add_verb(
        verbs, "budget", budget_verb, "list the terms of the band over part of a flight, systematic and random",
        "thrustd budget flight.mcap --at 600 660",
    )  # fmt: skip
    budget.add_argument("log", type=Path, help="log with raw events (of `thrustd run`)")
    budget.add_argument(
        "--at", type=float, nargs=2, required=True, metavar=("T0", "T1"), help="seconds since the log's first estimate"
    )
    budget.add_argument("--config", type=configuration_of, help="use this configuration instead of the log's own")
    budget.add_argument("--picture", type=Path, metavar="PNG", help="draw the terms as bars")
    add_json(budget)


def budget_verb(arguments: argparse.Namespace) -> int:
    from thrustd.installation.installation import read_installation
    from thrustd.replay.budget import budgets
    from thrustd.replay.replay import open_installation
    from thrustd.sources.log_run import LogRun, run_paths

    begin_s, end_s = arguments.at
    if not 0 <= begin_s <= end_s - LEAST_S:
        expected = f"expected T0 not below 0 and T1 at least {LEAST_S:g} s behind it"
        raise UsageError(f"--at {begin_s:g} {end_s:g}: {expected}")
    config = read_installation(arguments.config) if arguments.config else None
    log = LogRun(run_paths(arguments.log))
    found = budgets(log, open_installation(log, config), begin_s, end_s)
    if arguments.picture:
        from thrustd.replay.budget_picture import save

        save(arguments.picture, f"{arguments.log.name}, {begin_s:g} to {end_s:g} s", found)
    if arguments.json:
        print_json({"at": [begin_s, end_s], "engines": found})
    else:
        for each in found:
            _print_budget(each)
    if config is None:
        note("by the configuration in the log; --config asks another one")
    return 0


def _print_budget(budget: Any) -> None:
    from rich.table import Table

    from thrustd.core.measures import SIGMAS_95

    table = Table("source", "term", "kind", "sigma, N", title=f"{budget.engine}: {budget.thrust_n:.0f} N")
    for row in budget.rows:
        table.add_row(row.source, row.term, row.kind, f"{row.std_n:.1f}")
    console().print(table)
    unused = "not used, no term of it is in the band"
    of_mounts = f"sum of systematic terms {budget.mounts_n:.1f} N, the filter used {budget.filter_n:.1f} N"
    of_brochure = f"sum of terms {budget.brochure_n:.1f} N" if budget.of("brochure") else unused
    print(f"mounts: {of_mounts if budget.of('mounts') else unused}")
    print(f"brochure: {of_brochure}")
    print(f"fused: one sigma {budget.fused_n:.1f} N, 95 % band +- {SIGMAS_95 * budget.fused_n:.0f} N")
