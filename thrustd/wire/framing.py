"""COBS framing with a CRC: a byte stream in any cut -> payloads and named damage (ICD section 1).

    frame = COBS(payload + crc) + 0x00,   crc = CRC-16/XMODEM of payload, little-endian

The result does not depend on how the stream is cut into chunks. Empty space between two delimiters is no frame
and no damage. Reference: S. Cheshire, M. Baker, Consistent Overhead Byte Stuffing, IEEE/ACM Trans. Netw. 7(2), 1999.
"""

from binascii import crc_hqx
from typing import Literal

from cobs import cobs

DELIMITER = b"\x00"
CRC_BYTES = 2
DEFAULT_MAX_FRAME_BYTES = 64  # the longest version 1 ADC frame is 44 bytes on the wire

Damage = Literal["cobs", "crc", "length", "overlong"]


def encode_frame(payload: bytes) -> bytes:
    """`payload` (any bytes) as it goes on the wire, delimiter included."""
    crc = crc_hqx(payload, 0).to_bytes(CRC_BYTES, "little")
    return bytes(cobs.encode(payload + crc)) + DELIMITER


class Deframer:
    """Cuts a byte stream into frames. Holds at most `max_frame_bytes` of an unfinished one."""

    __slots__ = ("_max_frame_bytes", "_pending", "_skipping")

    def __init__(self, max_frame_bytes: int = DEFAULT_MAX_FRAME_BYTES) -> None:
        self._max_frame_bytes = max_frame_bytes
        self._pending = b""
        self._skipping = False  # inside an overlong run, until the next delimiter

    def feed(self, data: bytes) -> list[bytes | Damage]:
        """What `data` completes, in order: the payload of a good frame, the name of the damage of a bad one."""
        complete = (self._pending + data).split(DELIMITER)
        pending = complete.pop()
        found: list[bytes | Damage] = []
        for encoded in complete:
            if self._skipping:
                self._skipping = False
            elif encoded:
                found.append(self._unpack(encoded))
        if self._skipping:
            pending = b""
        elif len(pending) > self._max_frame_bytes:
            pending, self._skipping = b"", True
            found.append("overlong")
        self._pending = pending
        return found

    def _unpack(self, encoded: bytes) -> bytes | Damage:
        if len(encoded) > self._max_frame_bytes:
            return "overlong"
        try:
            frame: bytes = cobs.decode(encoded)
        except cobs.DecodeError:
            return "cobs"
        if len(frame) <= CRC_BYTES:
            return "length"
        payload = frame[:-CRC_BYTES]
        if crc_hqx(payload, 0) != frame[-2] | frame[-1] << 8:
            return "crc"
        return payload
