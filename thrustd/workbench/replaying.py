"""A flight log through the pipeline again, as `thrustd replay` does it: its estimates are in a new log beside it."""

from collections.abc import Mapping
from typing import Any

from thrustd.core.types import Progress
from thrustd.replay.replay import replay
from thrustd.workbench.folder import Folder


def replay_log(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Whole or not at all."""
    progress(0.0, "loading the estimator")
    replay(
        folder.path(arguments["recording"]),
        folder.new_path(arguments["out"]),
        advance=lambda share: progress(share, "replaying"),
    )
    return {"recording": arguments["out"]}
