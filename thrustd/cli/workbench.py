"""The verb workbench: the local page."""

import argparse
from pathlib import Path

from thrustd.cli.verb import Verbs, add_verb, note


def add_verbs(verbs: Verbs) -> None:
    parser = add_verb(
        verbs, "workbench", workbench_verb, "open a folder in the browser: where a model fails, what is missing",
        "thrustd workbench measurements/",
    )  # fmt: skip
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path(), help="folder of recordings and models (default: this one)"
    )
    parser.add_argument("--port", type=int, default=0, help="port on 127.0.0.1 (default: any free one)")
    parser.add_argument("--no-browser", action="store_true", help="only print the address")


def workbench_verb(arguments: argparse.Namespace) -> int:
    from thrustd.workbench.serve import serve

    def announce(url: str) -> None:
        note("thrustd workbench: open this address (it works for you alone, until you press Ctrl+C)")
        print(url, flush=True)

    serve(arguments.folder, arguments.port, not arguments.no_browser, announce)
    return 0
