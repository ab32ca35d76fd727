"""Event batches: what goes in comes out, and damaged bytes are refused in one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.one_by_one import decode_batch, encode_batch
from thrustd.core.errors import LogError
from thrustd.core.faults import FAULT_KINDS
from thrustd.core.types import Event, Fault, Frame, Tick
from thrustd.wire.event_batch import Messages

t_ns = st.integers(-(2**63), 2**63 - 1)
events = st.lists(
    st.one_of(
        st.builds(Tick, t_ns),
        st.builds(Frame, t_ns, st.sampled_from(["adc", "can"]), st.integers(0, 2**32 - 1), st.binary(max_size=300)),
        st.builds(
            Fault,
            t_ns,
            st.sampled_from(["adc", "a port"]),
            st.sampled_from(list(FAULT_KINDS)),
            st.booleans(),
            st.integers(0, 9),
        ),
    ),
    max_size=64,
)  # fmt: skip


@given(st.integers(0, 2**64 - 1), events)
def test_round_trip(first_number: int, sent: list[Event]) -> None:
    number, decoded = decode_batch(encode_batch(first_number, sent))
    assert (number, decoded) == (first_number, sent)
    assert [type(event) for event in decoded] == [type(event) for event in sent]


@given(st.lists(events, min_size=1, max_size=5), st.data())
def test_messages_decoded_together_are_their_events_in_a_row(sent: list[list[Event]], data: st.DataObject) -> None:
    together = Messages([encode_batch(number, each) for number, each in enumerate(sent)])
    whole = [event for each in sent for event in each]
    assert together.batch.events() == whole
    assert (together.first_numbers, together.n_events) == (list(range(len(sent))), list(map(len, sent)))
    begin = data.draw(st.integers(0, len(whole)))
    end = data.draw(st.integers(begin, len(whole)))
    assert together.batch.part(begin, end).events() == whole[begin:end]
    assert [together.batch.event(i) for i in range(len(whole))] == whole


@given(events, st.data())
def test_a_cut_batch_is_refused(sent: list[Event], data: st.DataObject) -> None:
    whole = encode_batch(1, sent)
    with pytest.raises(LogError, match="event batch"):
        decode_batch(whole[: data.draw(st.integers(0, len(whole) - 1))])


@given(st.binary(max_size=400))
def test_noise_is_refused_or_decoded_but_never_crashes(noise: bytes) -> None:
    try:
        decode_batch(noise)
    except LogError as error:
        assert "\n" not in str(error)


def test_another_version_is_refused() -> None:
    whole = bytearray(encode_batch(0, [Tick(1)]))
    whole[0] = 2
    with pytest.raises(LogError, match="version 2, expected 1"):
        decode_batch(bytes(whole))
