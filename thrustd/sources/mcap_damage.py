"""Where an MCAP file is damaged, what that cost, and where its next whole chunk begins.

A chunk carries its own lengths, so that one is recognised in the middle of a file, whatever stands before it:

    u8 opcode 6 | u64 length | u64 u64 u64 u32 | u32 4 | "zstd" | u64 length - 44 | ...
"""

from collections.abc import Sequence
from struct import Struct
from typing import BinaryIO, NamedTuple

CHUNK = 6
SHOWN_GAPS = 3
_SIGN = b"\x04\0\0\0zstd"
_SIGN_AT = 28  # in the content of a chunk
_HEAD_BYTES = 9
_OVERHEAD_BYTES = 44  # of the content, before what is compressed
_HEAD = Struct("<BQ")
_BLOCK_BYTES = 1 << 20


class Gap(NamedTuple):
    """A stretch of the file that gave nothing."""

    at: int  # byte
    why: str
    n_records: int = 1  # left out one after the other; 0: what is damaged is not read
    from_ns: int | None = None  # log time of the last message before; None: before any message
    to_ns: int | None = None  # of the first message behind; None: to the end of the file

    def words(self, origin_ns: int | None) -> str:
        """What was lost, in seconds after `origin_ns` (the first message of the file), and why."""
        why = f"byte {self.at}: {self.why}"
        if self.n_records == 0:
            return f"damaged outside of its messages ({why})"
        chunks = f"{self.n_records} chunk{'s' if self.n_records > 1 else ''}"
        if self.from_ns is None or origin_ns is None:
            return f"{chunks} damaged: its beginning is lost ({why})"
        since = f"from {(self.from_ns - origin_ns) * 1e-9:.2f} s"
        if self.to_ns is None:
            return f"{chunks} damaged: all {since} on is lost ({why})"
        return f"{chunks} damaged: {(self.to_ns - self.from_ns) * 1e-9:.2f} s {since} on are lost ({why})"


def account(gaps: Sequence[Gap], origin_ns: int | None) -> str:
    """What the gaps cost together, and the first few one by one; empty for none."""
    told = [gap.words(origin_ns) for gap in gaps[:SHOWN_GAPS]]
    more = [f"and {len(gaps) - len(told)} more"] if len(gaps) > len(told) else []
    if len(gaps) > 1:
        known_ns = sum(gap.to_ns - gap.from_ns for gap in gaps if gap.from_ns is not None and gap.to_ns is not None)
        told[0] = f"{len(gaps)} places, {known_ns * 1e-9:.1f} s at least: {told[0]}"
    return "; ".join(told + more)


def looks_like_chunk(content: bytes) -> bool:
    """Whether a record's content is that of a compressed chunk, whatever its opcode says."""
    return content[_SIGN_AT : _SIGN_AT + len(_SIGN)] == _SIGN


def next_chunk(stream: BinaryIO, begin: int) -> int | None:
    """Where the first chunk at or behind byte `begin` begins; None when there is none. Moves the stream."""
    stream.seek(begin)
    window, at = b"", begin  # `window` begins at byte `at`
    while block := stream.read(_BLOCK_BYTES):
        window += block
        found = window.find(_SIGN)
        while found >= 0:
            start = found - _SIGN_AT - _HEAD_BYTES
            head, tail = (
                window[max(start, 0) : start + _HEAD_BYTES],
                window[found + len(_SIGN) : found + len(_SIGN) + 8],
            )
            if start >= 0 and _is_chunk(head, tail):
                return at + start
            found = window.find(_SIGN, found + 1)
        kept = min(len(window), _SIGN_AT + _HEAD_BYTES + len(_SIGN) + 8)
        window, at = window[-kept:], at + len(window) - kept
    return None


def _is_chunk(head: bytes, tail: bytes) -> bool:
    opcode, length = _HEAD.unpack(head)
    return bool(opcode == CHUNK and len(tail) == 8 and length == _OVERHEAD_BYTES + int.from_bytes(tail, "little"))
