"""What is inside a record of an MCAP file: texts, and the records of a chunk. ValueError where it does not fit.

Reference: MCAP format specification, version 0 (https://mcap.dev/spec).
"""

import zlib
from struct import Struct

import zstandard

MAX_RECORD_BYTES = 64 * 1024 * 1024  # untrusted input: longer records are refused
_CHUNK_HEAD = Struct("<QQQII")
_U64 = Struct("<Q")


def text_at(content: bytes, at: int) -> tuple[str, int]:
    """A length-prefixed text at `at`, and where it ends."""
    end = at + 4 + int.from_bytes(content[at : at + 4], "little")
    if end > len(content):
        raise ValueError("text longer than its record")
    return content[at + 4 : end].decode(), end


def inflated(content: bytes) -> bytes:
    """The records inside a chunk, checksum judged."""
    _, _, size, crc, name_bytes = _CHUNK_HEAD.unpack_from(content)
    at = _CHUNK_HEAD.size + name_bytes
    compression = content[_CHUNK_HEAD.size : at]
    (n_bytes,) = _U64.unpack_from(content, at)
    squeezed = content[at + _U64.size :]
    if size > MAX_RECORD_BYTES or n_bytes != len(squeezed):
        raise ValueError(f"chunk of {size} bytes in {n_bytes}, {len(squeezed)} present")
    if compression == b"zstd":
        records = _unzstd(squeezed, size)
    elif compression == b"":
        records = squeezed
    else:
        raise ValueError(f"compression {compression!r}, expected zstd or none")
    if len(records) != size:
        raise ValueError(f"chunk gives {len(records)} bytes, expected {size}")
    expect_crc("chunk", crc, zlib.crc32(records))
    return records


def _unzstd(squeezed: bytes, size: int) -> bytes:
    stated = zstandard.get_frame_parameters(squeezed).content_size
    if stated not in (size, zstandard.CONTENTSIZE_UNKNOWN):  # before it is allowed to allocate
        raise ValueError(f"zstd frame of {stated} bytes, expected {size}")
    return zstandard.ZstdDecompressor().decompress(squeezed, max_output_size=size)


def expect_crc(what: str, stored: int, calculated: int) -> None:
    if stored not in (0, calculated):  # 0: the writer left it out
        raise ValueError(f"checksum of the {what} is {calculated:08x}, expected {stored:08x}")
