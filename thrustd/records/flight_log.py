"""A thrustd flight log as columns: what was estimated, measured and, for a simulated flight, true.

The grid is the times of one estimate topic (or of mounts, truth or readings, when nothing was estimated); everything
else is held from its last value before. Names:

    /estimate/left thrust_n          estimate_thrust_n_left
    /mount/left_upper deformation_mm deformation_mm_left_upper        other fields: mount_force_n_left_upper, ...
    /reading/n1_pct/left value       n1_pct_left
    /check/left asymmetry_n          check_asymmetry_n_left
    /terms/left zero_n               terms_zero_n_left
    /truth/left, /truth/left_upper   thrust_N_left, force_N_left_upper: the reference

A log that was cut off is read up to its last whole chunk; of a damaged one `--salvage` reads what is whole.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.core.errors import LogError, RecordingError
from thrustd.records.loaded import Loaded
from thrustd.records.recording import TIME
from thrustd.records.topics import Topic, append, level
from thrustd.wire.log_layout import FAULT_TOPIC

if TYPE_CHECKING:
    from thrustd.sources.mcap_log import LogFile
    from thrustd.sources.mcap_walk import LogMessage

LEFT_OUT = ("t_ns", "engine", "mount")  # said by the row and the topic already
FLIGHT_LOG = "thrustd flight log"
ZERO = "zero"  # the fault that says it: a mount's zero was taken off its samples from then on
ZEROED = "zeroed_s"  # of a recording, when that was first
REPLAY_FIRST = "readings, mounts and estimates are columns once it is replayed: thrustd replay LOG -o OUT.mcap"
REFERENCES = {"thrust_n": "thrust_N", "force_n": "force_N"}


def open_flight_log(path: Path, salvage: bool = False) -> "LogFile | None":
    """The log, or None when `path` is another kind of MCAP file."""
    from thrustd.sources.mcap_log import LogFile  # compiles the wire's columns: no other file needs them

    try:
        return LogFile(path, salvage)
    except LogError:
        return None


def read_flight_log(log: "LogFile") -> Loaded:
    topics: dict[str, Topic] = {}
    decode: Any = msgspec.json.Decoder().decode
    faults: list[LogMessage] = []
    for message in log.messages():
        if message.topic == FAULT_TOPIC:
            faults.append(message)
        else:
            append(topics.setdefault(message.topic, Topic([], {})), message.log_ns, decode(message.data))
    for topic in topics.values():
        level(topic)
    base = _base_topic(topics)
    if base is None:
        raise RecordingError(f"{log.path.name}: only raw events; replay it first, its estimates are then columns")
    times_ns = np.unique(np.array(topics[base].times_ns, dtype=np.int64))
    columns: dict[str, Floats] = {TIME: (times_ns - log.header.epoch_offset_ns) / 1e9}
    for name, topic in sorted(topics.items()):
        columns |= _held(name, topic, times_ns)
    notes = [f"flight log: columns held onto the times of {base}", f"{len(faults)} faults in the log"]
    if base.startswith("/truth/"):
        notes.append(f"only the truth beside raw events; {REPLAY_FIRST}")
    if log.damage:
        notes.append(log.damage)
    if log.cut:
        notes.append("log was cut off: read up to its last whole chunk")
    about = {"source": FLIGHT_LOG, "run": log.header.run}
    for fault in reversed([each for each in faults if decode(each.data)["kind"] == ZERO]):  # the first one stays
        about[ZEROED] = repr((fault.log_ns - log.header.epoch_offset_ns) / 1e9)
    return Loaded(columns, about, tuple(notes))


def _base_topic(topics: dict[str, Topic]) -> str | None:
    for kind in ("/estimate/", "/mount/", "/truth/", "/reading/"):
        found = sorted(name for name in topics if name.startswith(kind))
        if found:
            return found[0]
    return None


def _held(name: str, topic: Topic, times_ns: npt.NDArray[np.int64]) -> dict[str, Floats]:
    order = np.argsort(topic.times_ns, kind="stable")
    at = np.searchsorted(np.array(topic.times_ns, dtype=np.int64)[order], times_ns, side="right") - 1
    kind, *owner = name.strip("/").split("/")
    held: dict[str, Floats] = {}
    for field, values in topic.fields.items():
        if field not in LEFT_OUT:
            column = np.array(values)[order]
            held[_column_name(kind, owner, field)] = np.where(at >= 0, column[np.maximum(at, 0)], np.nan)
    return held


def _column_name(kind: str, owner: list[str], field: str) -> str:
    if kind == "reading":
        return "_".join(owner)
    if kind == "mount" and field == "deformation_mm":
        return "_".join([field, *owner])
    if kind == "truth" and field in REFERENCES:
        return "_".join([REFERENCES[field], *owner])
    return "_".join([kind, field, *owner])
