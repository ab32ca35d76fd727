"""Framing: any cut of the stream gives the same payloads and the same damage."""

from hypothesis import given
from hypothesis import strategies as st

from tests.wire.one_by_one import deframed
from thrustd.wire.framing import DEFAULT_MAX_FRAME_BYTES, Deframer, encode_frame

payloads = st.lists(st.binary(min_size=1, max_size=48), max_size=8)


def fed_whole(stream: bytes) -> list[bytes | None]:
    return deframed(Deframer(), stream)


def fed_bytewise(stream: bytes) -> list[bytes | None]:
    deframer = Deframer()
    return [item for i in range(len(stream)) for item in deframed(deframer, stream[i : i + 1])]


@given(payloads)
def test_payloads_come_out_as_they_went_in(sent: list[bytes]) -> None:
    stream = b"".join(map(encode_frame, sent))
    assert fed_whole(stream) == sent
    assert fed_bytewise(stream) == sent


@given(st.binary(max_size=600), st.lists(st.integers(1, 90), max_size=40))
def test_the_cut_of_noise_does_not_matter(noise: bytes, cuts: list[int]) -> None:
    deframer, found, at = Deframer(), [], 0
    for cut in [*cuts, len(noise)]:
        found += deframed(deframer, noise[at : at + cut])
        at += cut
    assert found == fed_whole(noise) == fed_bytewise(noise)


@given(st.binary(max_size=300), st.binary(min_size=1, max_size=48))
def test_a_frame_after_noise_and_a_delimiter_is_found(noise: bytes, payload: bytes) -> None:
    assert fed_whole(noise + b"\x00" + encode_frame(payload))[-1] == payload


@given(st.binary(min_size=1, max_size=48), st.data())
def test_one_flipped_bit_never_passes(payload: bytes, data: st.DataObject) -> None:
    frame = bytearray(encode_frame(payload))
    at = data.draw(st.integers(0, len(frame) - 1))
    frame[at] ^= 1 << data.draw(st.integers(0, 7))
    assert payload not in fed_whole(bytes(frame) + b"\x00")


def test_trailing_bytes_wait_for_their_delimiter() -> None:
    first, second = encode_frame(b"first"), encode_frame(b"second")
    deframer = Deframer()
    assert deframed(deframer, first + second[:3]) == [b"first"]
    assert deframed(deframer, second[3:]) == [b"second"]


def test_every_damage_is_told() -> None:
    good = encode_frame(b"payload")
    assert fed_whole(good[:2] + b"\x55" + good[3:]) == [None]
    assert fed_whole(b"\xff\x01\x00") == [None]
    assert fed_whole(b"\x02\x07\x00") == [None]
    assert fed_whole(b"\x01" * (DEFAULT_MAX_FRAME_BYTES + 1) + b"\x00") == [None]
    assert fed_whole(b"\x00\x00\x00") == []


def test_an_endless_run_without_delimiter_costs_one_fault_and_no_memory() -> None:
    deframer = Deframer()
    found = [item for _ in range(1000) for item in deframed(deframer, b"\x01" * 100)]
    assert found == [None]
    assert deframed(deframer, b"\x00" + encode_frame(b"after")) == [b"after"]
