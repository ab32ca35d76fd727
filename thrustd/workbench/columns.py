"""Recordings as files a zoom can jump into: one memory-mapped column per channel with its pyramid beside it.

    .thrustd/columns/<key>/meta.json             what the recording is; the key is made of name, size and change time
                           time.npy              (n,) float64
                           c000.npy c000.mm.npy  column (n,) float64 and its pyramid (2, m) float32
                           <model key>/          the same for the force and the residual of one model

A recording is prepared once, by the worker process; the server only maps what is there. A folder appears whole or not
at all (it is renamed into place), so a prepared recording is never half a one.
"""

import hashlib
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.records.recording import Recording, signal_of, unit_of
from thrustd.workbench.pyramid import Singles, build

META = "meta.json"
WRITERS = 2  # threads: numpy and the disk work side by side
CACHE_BYTES = 20 << 30  # prepared columns kept per folder; the longest unused go first


class ChannelMeta(msgspec.Struct, frozen=True):
    name: str
    unit: str
    meaning: str
    low: float | None  # None: nothing but missing values
    high: float | None
    missing: int


class ColumnsMeta(msgspec.Struct, frozen=True):
    """What a set of columns holds, in the order of its files."""

    name: str
    samples: int
    start_s: float
    stop_s: float
    sample_hz: float
    channels: tuple[ChannelMeta, ...]
    notes: tuple[str, ...] = ()


class Columns:
    """One prepared set of columns, mapped."""

    def __init__(self, folder: Path, time_s: Floats | None = None) -> None:
        self.folder = folder
        self.meta = msgspec.json.decode((folder / META).read_bytes(), type=ColumnsMeta)
        self.time_s: Floats = np.load(folder / "time.npy", mmap_mode="r") if time_s is None else time_s
        self._at = {channel.name: i for i, channel in enumerate(self.meta.channels)}
        self._mapped: dict[str, Floats | Singles] = {}

    def __contains__(self, channel: str) -> bool:
        return channel in self._at

    def column(self, channel: str) -> Floats:
        """The column (n,), every sample."""
        values: Floats = self._map(f"c{self._at[channel]:03d}.npy")
        return values

    def levels(self, channel: str) -> Singles:
        """Its pyramid (2, m)."""
        levels: Singles = self._map(f"c{self._at[channel]:03d}.mm.npy")
        return levels

    def _map(self, file: str) -> Any:
        if file not in self._mapped:
            self._mapped[file] = np.load(self.folder / file, mmap_mode="r")
        return self._mapped[file]


def columns_key(path: Path, said: str = "") -> str:
    """Changes whenever the file does, or what is said of it."""
    stat = path.stat()
    return hashlib.sha256(f"{path}|{stat.st_size}|{stat.st_mtime_ns}{said}".encode()).hexdigest()[:20]


def open_columns(folder: Path, time_s: Floats | None = None) -> Columns | None:
    """The columns prepared there (`time_s`: those of the recording, for a model's); None while there are none."""
    try:
        return Columns(folder, time_s)
    except (OSError, ValueError, msgspec.DecodeError):
        return None


def write_columns(folder: Path, record: Recording, with_time: bool = True) -> ColumnsMeta:
    """Columns and pyramids of a recording as `folder`, whole or not at all."""
    part = folder.with_name(f"{folder.name}.{os.getpid()}.part")
    part.mkdir(parents=True)
    try:
        meta = _write(part, record, with_time)
        if folder.exists():
            shutil.rmtree(folder)
        part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return meta


def _write(part: Path, record: Recording, with_time: bool) -> ColumnsMeta:
    if with_time:
        np.save(part / "time.npy", record.time_s)
    with ThreadPoolExecutor(WRITERS) as pool:
        writing = [
            pool.submit(_write_channel, part, i, name, column)
            for i, (name, column) in enumerate(record.channels.items())
        ]
        channels = tuple(written.result() for written in writing)
    start_s, stop_s = float(record.time_s[0]), float(record.time_s[-1])
    meta = ColumnsMeta(record.name, len(record), start_s, stop_s, record.sample_hz, channels, record.notes)
    (part / META).write_bytes(msgspec.json.encode(meta))
    return meta


def _write_channel(part: Path, number: int, name: str, column: Floats) -> ChannelMeta:
    levels = build(column)
    np.save(part / f"c{number:03d}.npy", column)
    np.save(part / f"c{number:03d}.mm.npy", levels)
    return _channel_meta(name, column, levels)


def _channel_meta(name: str, column: Floats, levels: Singles) -> ChannelMeta:
    signal = signal_of(name)
    top = levels[:, -min(levels.shape[1], 8) :]
    known = bool(np.isfinite(top).any())
    low, high = (float(np.nanmin(top[0])), float(np.nanmax(top[1]))) if known else (None, None)
    missing = int(np.count_nonzero(~np.isfinite(column)))
    return ChannelMeta(name, unit_of(name), signal.meaning if signal else "", low, high, missing)


def forget_old(state: Path, keep_bytes: int = CACHE_BYTES) -> None:
    """Delete the longest unused columns beyond `keep_bytes`."""
    folders = [folder for folder in (state / "columns").glob("*") if folder.is_dir()]
    folders.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
    total = 0
    for folder in folders:
        total += sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        if total > keep_bytes:
            shutil.rmtree(folder, ignore_errors=True)
