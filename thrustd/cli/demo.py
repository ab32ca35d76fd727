"""The verb demo: a short flight that comes with thrustd, replayed: numbers, estimate log, picture."""

import argparse
from pathlib import Path

from thrustd.cli.verb import Verbs, add_json, add_verb, console, note, progress, tell
from thrustd.core.errors import UsageError

FLIGHT = "replay_logs/throttle-steps.mcap"
WRITTEN = "estimates.mcap", "flight.png"


def add_verbs(verbs: Verbs) -> None:
    demo = add_verb(
        verbs, "demo", demo_verb, "replay a short flight that comes with thrustd: numbers, estimate log, picture",
        "thrustd demo --folder out/demo",
    )  # fmt: skip
    demo.add_argument(
        "--folder",
        type=Path,
        default=Path("thrustd-demo"),
        metavar="FOLDER",
        help="folder to write to (default thrustd-demo)",
    )
    add_json(demo)


def demo_verb(arguments: argparse.Namespace) -> int:
    log, drawn = (arguments.folder / name for name in WRITTEN)
    for path in (log, drawn):
        if path.exists():
            raise UsageError(f"{path}: already exists; expected another --folder")
    if arguments.folder.exists() and not arguments.folder.is_dir():
        raise UsageError(f"--folder {arguments.folder}: is a file; expected a folder")
    from thrustd.core.jit import say_compiling

    say_compiling()  # before anything that is compiled is imported
    from thrustd.installation.shipped import shipped
    from thrustd.replay.picture import FlightPicture
    from thrustd.replay.replay import replay
    from thrustd.replay.summary_table import largest_n, print_summary

    flight = shipped(FLIGHT, "demo")
    arguments.folder.mkdir(parents=True, exist_ok=True)
    picture = FlightPicture()
    with progress(f"replay {flight.name}") as advance:
        summary = replay(flight, log, advance=advance, picture=picture)
    picture.save(drawn, summary.log, largest_n(summary))
    tell(arguments, summary, lambda: print_summary(summary, console()))
    note(f"written: {log}, {drawn}; then: thrustd points {log} --limit least_s=10")
    return 0
