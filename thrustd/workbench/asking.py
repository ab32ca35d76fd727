"""Compare, as the page asks it: whole recordings, or only the samples under a condition."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from thrustd.core.columns import Flags
from thrustd.core.errors import UsageError
from thrustd.core.types import Progress
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.regions import regions_of
from thrustd.records.marks import read_marks, without_excluded
from thrustd.records.recording import Recording
from thrustd.workbench.figures import comparison_json
from thrustd.workbench.folder import Folder
from thrustd.workbench.intervals import intervals_of
from thrustd.workbench.model_runs import recording_of


def marked_recordings(folder: Folder, names: Sequence[str]) -> list[Recording]:
    """The recordings as their marks say they should be used, named as the folder names them."""
    return [
        replace(without_excluded(recording_of(folder, name), read_marks(folder.path(name))), name=name)
        for name in names
    ]


def ask_compare(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """The report of `thrustd compare`, with what the page draws."""
    models = {name: folder.model(name) for name in arguments["models"]}
    progress(0.02, "reading")
    records = marked_recordings(folder, arguments["recordings"])
    condition = arguments.get("condition")
    masks = [_mask(record, condition) for record in records] if condition else []
    for i, mask in enumerate(masks):
        records[i] = _only(records[i], mask)
    report = compare(models, records, progress=lambda share, note: progress(0.1 + 0.6 * share, note))
    progress(0.75, "pictures")
    cells = [comparison_json(c) for c in report.comparisons]
    answer: dict[str, Any] = {"cells": cells, "remarks": list(report.remarks)}
    if condition:
        answer["condition"] = {
            "intervals": {r.name: intervals_of(m, r.time_s) for r, m in zip(records, masks, strict=True)},
            "time_share": float(np.concatenate(masks).mean()),
        }
    return answer


def _mask(record: Recording, condition: Mapping[str, Any]) -> Flags:
    mask: Flags = np.ones(len(record), dtype=bool)
    channel, low, high, phase = (condition[key] for key in ("channel", "low", "high", "phase"))
    if channel:
        column = record[channel]
        with np.errstate(invalid="ignore"):
            mask &= (column >= (-np.inf if low is None else low)) & (column <= (np.inf if high is None else high))
    if phase:
        force_n = np.nan_to_num(record["force_N"])
        found = {region.label: region.mask for region in regions_of(force_n, 1.0 / record.sample_hz, {})}
        mask &= found.get(phase, np.zeros(len(record), dtype=bool))
    return mask


def _only(record: Recording, mask: Flags) -> Recording:
    force_n = np.where(mask, record["force_N"], np.nan)
    if not np.isfinite(force_n).any():
        raise UsageError(f"{record.name}: no sample with force_N meets this condition")
    return replace(record, channels={**record.channels, "force_N": force_n})
