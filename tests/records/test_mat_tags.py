"""MATLAB files whose tags lie: refused before scipy's compiled reader believes them."""

import io
import zlib
from pathlib import Path
from struct import pack

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix

from tests.cli.test_hostile_files import refused_in_bounds
from thrustd.core.errors import RecordingError
from thrustd.records.files import read_recording
from thrustd.records.mat_tags import HEAD_BYTES, check_elements

FLAGS_AT = HEAD_BYTES + 16  # of the first variable
TIME_S = np.arange(50.0)
LARGEST = 1 << 20


def mat(variables: dict[str, object], packed: bool = False) -> bytes:
    file = io.BytesIO()
    savemat(file, variables, do_compression=packed)
    return file.getvalue()


PLAIN = mat({"time_s": TIME_S, "force_N": TIME_S})
KINDS = {
    "time_s": TIME_S,
    "text": "word",
    "cell": np.array([TIME_S, "word"], dtype=object),
    "structure": {"inner": {"a": TIME_S, "b": "word"}},
    "sparse": csc_matrix(np.eye(3)),
    "imaginary": 1j * TIME_S,
    "none": np.array([np.zeros((0, 0)), "word"], dtype=object),
    "yes": np.array([True]),
}


def test_a_flag_that_promises_what_is_not_there_does_not_end_the_process(tmp_path: Path) -> None:
    content = bytearray(PLAIN)
    content[FLAGS_AT + 1] |= 0x08  # complex: scipy reads on into the next variable and never comes back
    (tmp_path / "a.mat").write_bytes(content)
    line = refused_in_bounds("info", tmp_path / "a.mat")
    assert "a.mat: not a readable MATLAB v5 file: 1 parts of a matrix, expected 2" in line


@pytest.mark.parametrize("packed", [False, True])
def test_every_kind_of_variable_passes(tmp_path: Path, packed: bool) -> None:
    content = mat(KINDS, packed)
    check_elements(memoryview(content), LARGEST)
    (tmp_path / "a.mat").write_bytes(mat(dict(KINDS, imaginary=TIME_S), packed))
    assert np.array_equal(read_recording(tmp_path / "a.mat").time_s, TIME_S)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_four_wrong_bytes_are_refused_or_harmless(tmp_path: Path, kind: str) -> None:
    content, rng = mat({kind: KINDS[kind], "time_s": TIME_S}), np.random.default_rng(0)
    for _ in range(60):
        damaged = bytearray(content)
        for place in rng.integers(HEAD_BYTES, len(content), 4).tolist():
            damaged[place] = rng.choice([0, 1, 14, 15, rng.integers(256)])
        (tmp_path / "a.mat").write_bytes(damaged)
        try:
            read_recording(tmp_path / "a.mat")
        except RecordingError as problem:
            assert len(str(problem).splitlines()) == 1


def test_a_variable_that_unpacks_to_more_than_it_may_is_refused() -> None:
    matrix = pack("<II", 14, 4 * LARGEST) + bytes(4 * LARGEST)
    content = PLAIN[:HEAD_BYTES] + pack("<II", 15, len(zlib.compress(matrix))) + zlib.compress(matrix)
    with pytest.raises(ValueError, match="unpacks to more than"):
        check_elements(memoryview(content), LARGEST)


def test_structures_in_structures_without_end_are_refused() -> None:
    inner: object = TIME_S
    for _ in range(100):
        inner = {"a": inner}
    with pytest.raises(ValueError, match="structures in each other"):
        check_elements(memoryview(mat({"s": inner})), LARGEST)


def test_a_cell_that_promises_a_thousand_million_costs_nothing() -> None:
    content = bytearray(mat({"cell": np.array([1.0, "word"], dtype=object)}))
    at = FLAGS_AT + 16  # its two dimensions
    content[at : at + 8] = pack("<ii", 1 << 15, 1 << 15)
    with pytest.raises(ValueError, match="2 parts of a matrix, expected 1073741824"):
        check_elements(memoryview(content), LARGEST)
