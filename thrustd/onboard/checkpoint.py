"""The checkpoint of a flying pipeline: its snapshot with what decides whether another process may take it over.

    {"sha256": hash of the body's bytes, "body": {boot, clocks, hashes of configuration and models, snapshot}}

Within one boot the age is the monotonic clock's; after a reboot the calendar clock's, and the snapshot's times are
moved onto the new monotonic clock. Hours in service have no age: a checkpoint that is too old for the rest still tells
them, for each mount whose hours in the calibration file are those it began with. Who mounts another one, or counts
anew (`thrustd calibrate hours`), changes that file, and then the file is right.
"""

import hashlib
import os
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from thrustd.core.errors import UsageError
from thrustd.installation.installation import WarmStart
from thrustd.sources.plain_file import read_plain

SCHEMA = "thrustd.onboard.checkpoint.v7"
MAX_BYTES = 4_000_000
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
OWN_STATUS = Path("/proc/self/stat")
STARTED = 19  # proc(5): field 22 of the file, the third is the first behind the name


Service = dict[str, tuple[float, float]]  # by mount: hours in the calibration file, seconds in service now


class Clocks(NamedTuple):
    """What time it is, and whose monotonic clock says so."""

    boot: str
    monotonic_ns: int
    utc_ns: int


class Checkpoint(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is in the file."""

    schema: str
    clocks: Clocks
    sha256: dict[str, str]  # of the configuration and every file it names
    snapshot: dict[str, Any]
    service: Service = {}


class _Envelope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    sha256: str
    body: msgspec.Raw


class Resume(NamedTuple):
    """What there is to go on with: the state, or None; and the reason in words."""

    start: WarmStart | None
    word: str
    refused: bool  # there was a checkpoint, and it is not good
    service: Service | None = None

    def service_s(self, calibrated_h: Mapping[str, float]) -> tuple[float, ...]:
        """Of the mounts, which the calibration file gives these hours."""
        told = self.service or {}
        known = [(told.get(name, (hours, 3600.0 * hours)), hours) for name, hours in calibrated_h.items()]
        return tuple(now_s if began_h == hours else 3600.0 * hours for (began_h, now_s), hours in known)

    def overruled(self, calibrated_h: Mapping[str, float]) -> list[str]:
        """A line for each mount whose hours the calibration file changed: those that the checkpoint told are gone."""
        told, lines = self.service or {}, []
        for name, hours in calibrated_h.items():
            began_h, now_s = told.get(name, (hours, 0.0))
            if began_h != hours:
                by = "of the calibration file, which changed"
                lines.append(f"{name}: {hours:.2f} h in service, {by}; the checkpoint told {now_s / 3600.0:.2f} h")
        return lines


@cache
def _boot() -> str:
    """Read once: in flight there may be no file left to open."""
    return BOOT_ID.read_text().strip() if BOOT_ID.exists() else ""


def clocks() -> Clocks:
    """Now."""
    return Clocks(_boot(), time.monotonic_ns(), time.time_ns())


def at_start(now: Clocks) -> Clocks:
    """What `now` was when this process began: a machine that was slow to start it makes no checkpoint older."""
    try:
        fields = OWN_STATUS.read_text().rpartition(")")[2].split()  # behind the name, which may hold anything
        began_s = int(fields[STARTED]) / os.sysconf("SC_CLK_TCK")  # since boot
    except (OSError, ValueError, IndexError):  # a kernel that does not say
        return now
    age_ns = round((time.clock_gettime(time.CLOCK_BOOTTIME) - began_s) * 1e9)
    return now._replace(monotonic_ns=now.monotonic_ns - age_ns, utc_ns=now.utc_ns - age_ns)


def encode(checkpoint: Checkpoint) -> bytes:
    body = msgspec.json.encode(checkpoint)
    return msgspec.json.encode(_Envelope(hashlib.sha256(body).hexdigest(), msgspec.Raw(body)))


def read_checkpoint(path: Path, sha256: Mapping[str, str], now: Clocks, max_age_s: float) -> Resume:
    """Judge the checkpoint at `path` for an installation with these file hashes. Never raises."""
    if not os.path.exists(path):
        return Resume(None, f"{path}: no checkpoint, starting cold", False)
    try:
        content = read_plain(path, MAX_BYTES, UsageError)
    except UsageError as problem:
        return Resume(None, f"{problem}: starting cold", True)
    return judge(path, content, sha256, now, max_age_s)


def judge(path: Path, content: bytes, sha256: Mapping[str, str], now: Clocks, max_age_s: float) -> Resume:
    """Whether the bytes of a checkpoint may be taken over."""
    try:
        envelope = msgspec.json.decode(content, type=_Envelope)
        if hashlib.sha256(envelope.body).hexdigest() != envelope.sha256:
            return _refuse(path, "damaged: its checksum does not match")
        body = msgspec.json.decode(envelope.body, type=Checkpoint)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        return _refuse(path, f"damaged: {problem}")
    if body.schema != SCHEMA:
        return _refuse(path, f"schema {body.schema!r}, expected {SCHEMA!r}")
    if body.sha256 != dict(sha256):
        return _refuse(path, f"of another {_difference(body.sha256, sha256)}", body.service)
    same_boot = body.clocks.boot == now.boot != ""
    then_ns = body.clocks.monotonic_ns if same_boot else body.clocks.utc_ns
    age_s = ((now.monotonic_ns if same_boot else now.utc_ns) - then_ns) * 1e-9
    if not 0 <= age_s <= max_age_s:
        return _refuse(path, f"{age_s:.1f} s old, expected 0 to {max_age_s:g} s", body.service)
    shift_ns = 0 if same_boot else now.monotonic_ns - round(age_s * 1e9) - body.clocks.monotonic_ns
    return Resume(WarmStart(body.snapshot, shift_ns), f"{path}: {age_s:.1f} s old, starting warm", False, body.service)


def _refuse(path: Path, reason: str, service: Service | None = None) -> Resume:
    return Resume(None, f"{path}: {reason}: starting cold", True, service)


def _difference(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """The first file that is not the same."""
    names = sorted({*theirs, *ours})
    return next(name for name in names if theirs.get(name) != ours.get(name))
