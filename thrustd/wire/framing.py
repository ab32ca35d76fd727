"""COBS framing with a CRC: a byte stream in any cut -> payloads, and what is none (ICD section 1).

    frame = COBS(payload + crc) + 0x00,   crc = CRC-16/XMODEM of payload, little-endian

The result does not depend on how the stream is cut into chunks. Empty space between two delimiters is no frame
and no damage. Reference: S. Cheshire, M. Baker, Consistent Overhead Byte Stuffing, IEEE/ACM Trans. Netw. 7(2), 1999.
"""

from binascii import crc_hqx
from typing import Any, Final, NamedTuple

import numba
import numpy as np
from cobs import cobs

from thrustd.core.columns import Bytes, Flags, Integers
from thrustd.core.jit import compiled, together

DELIMITER = b"\x00"
CRC_BYTES = 2
DEFAULT_MAX_FRAME_BYTES = 64  # the longest version 1 ADC frame is 44 bytes on the wire

DAMAGED: Final = -1  # as `length` of a piece: no COBS, too short, a wrong checksum, or no delimiter for too long
_PENDING, _SKIPPING = range(2)  # bytes of an unfinished frame; inside an overlong run, until the next delimiter
_CRC_TABLE = np.array([crc_hqx(bytes((byte,)), 0) for byte in range(256)], np.int64)


class Pieces(NamedTuple):
    """What chunks of bytes complete, in order."""

    chunk: Integers  # (n,) which of the chunks
    length: Integers  # (n,) bytes of payload, or DAMAGED
    payload: Bytes  # (n, longest payload)


_Room = tuple[Integers, Integers, Bytes]  # of Pieces


def encode_frame(payload: bytes) -> bytes:
    """`payload` (any bytes) as it goes on the wire, delimiter included."""
    crc = crc_hqx(payload, 0).to_bytes(CRC_BYTES, "little")
    return bytes(cobs.encode(payload + crc)) + DELIMITER


class Deframer:
    """Cuts a byte stream into frames. Holds at most `max_frame_bytes` of an unfinished one."""

    __slots__ = ("_frame", "_place", "_room")

    def __init__(self, max_frame_bytes: int = DEFAULT_MAX_FRAME_BYTES) -> None:
        self._frame = np.zeros(max_frame_bytes, np.uint8)
        self._place = np.zeros(2, np.int64)
        self._room = _room(0, max_frame_bytes)

    def cut(self, data: Bytes, ends: Integers, left_out: Flags) -> Pieces:
        """What chunks complete, in order: chunk i ends before data[ends[i]] and is not of this stream when left out.

        The arrays are good until the next call.
        """
        most = len(data) // 2 + len(ends) + 1  # the shortest damage takes two bytes
        if len(self._room.chunk) < most:
            self._room = _room(most, len(self._frame))
        chunk, length, payload = self._room
        n = _cut(data, ends, left_out, self._frame, self._place, (chunk, length, payload))
        return Pieces(chunk[:n], length[:n], payload[:n])


def _room(most: int, longest: int) -> Pieces:
    return Pieces(np.empty(most, np.int64), np.empty(most, np.int64), np.empty((most, longest), np.uint8))


@compiled
def _unpack(frame: Bytes, n: int, payload: Bytes) -> int:
    """COBS and checksum of frame[:n]; -> bytes of payload, or DAMAGED."""
    at = size = 0
    while at < n:
        code = int(frame[at])
        if at + code > n:
            return DAMAGED
        for i in range(at + 1, at + code):
            payload[size] = frame[i]
            size += 1
        at += code
        if code < 255 and at < n:
            payload[size] = 0
            size += 1
    if size <= CRC_BYTES:
        return DAMAGED
    crc = 0
    for i in range(size - CRC_BYTES):
        crc = (crc << 8 & 0xFF00) ^ _CRC_TABLE[crc >> 8 ^ int(payload[i])]
    stored = int(payload[size - 2]) | int(payload[size - 1]) << 8
    return size - CRC_BYTES if crc == stored else DAMAGED


def _cut_chunks(data: Bytes, ends: Integers, left_out: Flags, frame: Bytes, place: Integers, out: _Room) -> int:
    chunk, length, payload = out
    n, at = 0, 0
    for i in range(len(ends)):
        if left_out[i]:
            at = ends[i]
            continue
        while at < ends[i]:
            byte = data[at]
            at += 1
            if byte == 0:
                if place[_PENDING] and not place[_SKIPPING]:
                    chunk[n], length[n] = i, _unpack(frame, place[_PENDING], payload[n])
                    n += 1
                place[_PENDING] = place[_SKIPPING] = 0
            elif place[_PENDING] < len(frame):
                frame[place[_PENDING]] = byte
                place[_PENDING] += 1
            elif not place[_SKIPPING]:
                place[_SKIPPING] = 1
                chunk[n], length[n] = i, DAMAGED
                n += 1
    return n


_ROW, _BYTES = numba.int64[::1], numba.uint8[::1]
_PIECES = together(_ROW, _ROW, numba.uint8[:, ::1])
_cut: Any = compiled(_cut_chunks, numba.int64(_BYTES, _ROW, numba.boolean[::1], _BYTES, _ROW, _PIECES))
