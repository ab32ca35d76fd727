"""Models run on recordings, as columns the time histories draw."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Progress
from thrustd.diagnose.compare.compare import free_runs
from thrustd.identify.error_map import rates_of
from thrustd.identify.segments import DEFORMATION, bridged, segments_of
from thrustd.model.artifact import ErrorMap, ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.region_error import region_stds_n
from thrustd.records.files import file_sha256
from thrustd.records.recording import Recording, make_recording
from thrustd.records.time_axis import read_timed
from thrustd.workbench.columns import write_columns
from thrustd.workbench.folder import Folder
from thrustd.workbench.prepare import prepare


def recording_of(folder: Folder, name: str) -> Recording:
    """The recording from its columns: mapped, so that a long one is not read twice."""
    prepare(folder, name, lambda share, note: None)
    columns = folder.columns(name)
    if columns is None:  # it has no time yet: says so
        return read_timed(folder.path(name), folder.mapping(name).axis)
    channels: Mapping[str, Floats] = {c.name: columns.column(c.name) for c in columns.meta.channels}
    sha256 = file_sha256(folder.path(name))
    return make_recording(columns.meta.name, {"time_s": columns.time_s, **channels}, None, sha256, columns.meta.notes)


def band_of(error: ErrorMap | None, force_n: Floats, record: Recording) -> dict[str, Floats]:
    """The 95 % band of a model (n,), N, from the error map of its identification; nothing without one."""
    if error is None:
        return {}
    rate_n_s = np.abs(rates_of(np.nan_to_num(force_n), 1.0 / record.sample_hz))
    half_n = SIGMAS_95 * region_stds_n(error, force_n, rate_n_s)
    return {"band_low": force_n - half_n, "band_high": force_n + half_n}


def simulate_models(folder: Folder, name: str, models: Sequence[str], progress: Progress) -> dict[str, Any]:
    """Columns `model` (force, N) and `residual` (measured - model, N) of each model on the recording."""
    prepare(folder, name, progress)
    record: Recording | None = None
    for i, model in enumerate(models):
        if folder.model_columns(name, model) is None:
            progress(0.2 + 0.8 * i / len(models), f"running {model}")
            record = record or recording_of(folder, name)
            force_n = model_force(folder.model(model), record)
            channels = {"model": force_n}
            if "force_N" in record:
                channels["residual"] = record["force_N"] - force_n
            channels |= band_of(folder.model(model).error, force_n, record)
            run = make_recording(f"{model} on {name}", {"time_s": record.time_s, **channels})
            write_columns(folder.model_columns_folder(name, model), run, with_time=False)
    return {"recording": name, "models": list(models)}


def model_force(spec: ModelSpec, record: Recording) -> Floats:
    """Free run of a model over every stretch of a recording, on its own time axis (n,), N; NaN in holes.

    It begins in the state that the reference shows, as in `compare`; at rest where there is none.
    """
    needed = [channel for stage in model_stages(spec, 1.0) for channel in stage.channels]
    force_n = np.full(len(record), np.nan)
    reference_n = record["force_N"] if "force_N" in record else force_n.copy()
    record = record.with_channels(force_N=np.zeros(len(record)))  # also where the reference is missing
    for segment in segments_of([record], dict.fromkeys(needed)):
        first, last = np.searchsorted(record.time_s, [segment.start_s, segment.time_s[-1] + 0.5 * segment.dt_s])
        at_s = record.time_s[first:last]
        told = replace(segment, force_n=np.interp(segment.time_s, record.time_s, reference_n))
        run = free_runs(spec, told)[1]
        force_n[first:last] = run if len(run) == len(at_s) else np.interp(at_s, segment.time_s, run)
    read = [bridged(record[name]) for name in dict.fromkeys([DEFORMATION, *needed])]
    return np.where(np.all(np.isfinite(read), axis=0), force_n, np.nan)  # memory runs on through a hole, no picture
