"""The elements of a MATLAB v5 file, walked before scipy reads them: its reader trusts every tag and may crash on one.

    element   i4 type, i4 bytes, data, padded to 8     small (1 to 4 bytes): u2 type, u2 bytes, data in the next four
    matrix    flags, dimensions, name, then by class: numbers [and imaginary ones], text, indices, matrices
    packed    a matrix deflated

MATLAB, "MAT-File Format", R2019b, chapter 1. What is no such element is a ValueError.
"""

import zlib
from collections.abc import Iterator, Sequence
from math import prod
from struct import unpack_from
from typing import Final, NamedTuple

MATRIX, PACKED = 14, 15
FLAGS: Final = (6,)
COUNTS: Final = 5, 6  # i4, and u4 as others write it
NAME: Final = 1, 16  # i1, and UTF-8
NUMBER_BYTES: Final = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}  # by type of element
TEXTS: Final = (*NUMBER_BYTES, 16, 17, 18)
CELL, STRUCTURE, OBJECT, TEXT, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
NUMBERS: Final = range(6, 16)
COMPLEX: Final = 0x800
HEAD_BYTES = 128
MOST_DEEP = 64  # a structure in a structure ...: scipy goes down as deep as the file says


class Element(NamedTuple):
    kind: int
    data: memoryview


def check_elements(content: memoryview, most_bytes: int) -> None:
    """ValueError where `content`, a whole file, is no row of matrices; none may unpack to more than `most_bytes`."""
    if len(content) < HEAD_BYTES:
        raise ValueError(f"{len(content)} bytes, no header")
    order = "<" if bytes(content[126:128]) == b"IM" else ">"
    for element in _elements(content[HEAD_BYTES:], order, padded=False):
        inner = [element] if element.kind != PACKED else _unpacked(element.data, order, most_bytes)
        for matrix in inner:
            _check_matrix(matrix, order, 0)


def _elements(data: memoryview, order: str, padded: bool = True) -> Iterator[Element]:
    """Those that follow each other; at the top of a file they are neither padded nor small."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise ValueError("could not read bytes of a tag")
        first, n_bytes = unpack_from(f"{order}II", data, at)
        small = first >> 16 if padded else 0
        begin = at + 4 if small else at + 8
        kind, n_bytes = (first & 0xFFFF, small) if small else (first, n_bytes)
        if n_bytes > (4 if small else len(data) - begin):
            raise ValueError(f"could not read bytes: {n_bytes} are promised, {len(data) - begin} are left")
        yield Element(kind, data[begin : begin + n_bytes])
        at = at + 8 if small else begin + n_bytes + (-n_bytes % 8 if padded else 0)


def _unpacked(data: memoryview, order: str, most_bytes: int) -> Sequence[Element]:
    stream = zlib.decompressobj()
    content = stream.decompress(data, most_bytes)
    if stream.unconsumed_tail:
        raise ValueError(f"a variable that unpacks to more than {most_bytes} bytes")
    found = tuple(_elements(memoryview(content), order, padded=False))
    if len(found) != 1:
        raise ValueError(f"{len(found)} variables packed as one")
    return found


def _check_matrix(matrix: Element, order: str, depth: int) -> None:
    if matrix.kind != MATRIX or depth > MOST_DEEP:
        raise ValueError("no matrix where one is due" if depth <= MOST_DEEP else f"{depth} structures in each other")
    parts = list(_elements(matrix.data, order)) if matrix.data else []
    if not parts:
        return  # an empty one, as MATLAB writes for an empty cell
    flags_of, *parts = parts
    _expect(flags_of, FLAGS, 8)
    (flags,) = unpack_from(f"{order}I", flags_of.data)
    kind = flags & 0xFF
    if kind == OPAQUE:
        for part in _exactly(parts, 4)[:3]:
            _expect(part, NAME)
        return _check_matrices(parts[3:], 1, order, depth)
    shape_of, name, *parts = _at_least(parts, 2)
    _expect(shape_of, COUNTS, 8)
    _expect(name, NAME)
    shape = unpack_from(f"{order}{len(shape_of.data) // 4}i", shape_of.data)
    if min(shape) < 0:
        raise ValueError(f"a matrix of shape {shape}")
    _check_content(parts, kind, prod(shape), bool(flags & COMPLEX), order, depth)


def _check_content(parts: list[Element], kind: int, size: int, is_complex: bool, order: str, depth: int) -> None:
    """What follows flags, shape and name in a matrix of this kind."""
    if kind in NUMBERS:
        for part in _exactly(parts, 2 if is_complex else 1):
            _expect(part, tuple(NUMBER_BYTES))
            if len(part.data) != size * NUMBER_BYTES[part.kind]:
                raise ValueError(f"{size} numbers promised in {len(part.data)} bytes of type {part.kind}")
    elif kind == TEXT:
        for part in _exactly(parts, 1) if size else parts[:1]:
            _expect(part, TEXTS)
    elif kind == SPARSE:
        for part in _exactly(parts, 4 if is_complex else 3):
            _expect(part, tuple(NUMBER_BYTES))
    else:
        _check_matrices(*_inner(parts, kind, size, order), order, depth)


def _inner(parts: list[Element], kind: int, size: int, order: str) -> tuple[list[Element], int]:
    """The matrices in one of this kind, and how many there should be."""
    if kind == CELL:
        return parts, size
    if kind == FUNCTION:
        return parts, 1
    if kind not in (STRUCTURE, OBJECT):
        raise ValueError(f"a matrix of class {kind}")
    if kind == OBJECT:
        class_name, *parts = _at_least(parts, 1)
        _expect(class_name, NAME)
    length_of, names, *parts = _at_least(parts, 2)
    _expect(length_of, COUNTS, 4)
    _expect(names, NAME)
    (length,) = unpack_from(f"{order}i", length_of.data)
    if length <= 0 or len(names.data) % length:
        raise ValueError(f"names of fields of {length} bytes in {len(names.data)}")
    return parts, size * (len(names.data) // length)


def _check_matrices(parts: list[Element], count: int, order: str, depth: int) -> None:
    for part in _exactly(parts, count):
        _check_matrix(part, order, depth + 1)


def _expect(element: Element, kinds: Sequence[int], least_bytes: int = 0) -> None:
    if element.kind not in kinds or len(element.data) < least_bytes:
        raise ValueError(f"an element of type {element.kind} and {len(element.data)} bytes, expected another")


def _at_least(parts: list[Element], count: int) -> list[Element]:
    if len(parts) < count:
        raise ValueError(f"{len(parts)} parts of a matrix, expected {count} or more")
    return parts


def _exactly(parts: list[Element], count: int) -> list[Element]:
    if len(parts) != count:
        raise ValueError(f"{len(parts)} parts of a matrix, expected {count}")
    return parts
