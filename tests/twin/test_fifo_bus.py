"""The CAN bus of named pipes: nothing lost while there is room, members come, leave and are killed."""

import os

import can
import pytest

from thrustd.twin.fifo_bus import PIPE_BYTES

PATIENCE_S = 20.0


def member(folder, **options):
    return can.Bus(interface="fifo", channel=str(folder), **options)


def message(number, **fields):
    return can.Message(arbitration_id=300, data=number.to_bytes(4, "big"), is_extended_id=False, **fields)


def numbers(bus, count):
    received = [bus.recv(PIPE_BYTES) for _ in range(count)]
    return [int.from_bytes(one.data, "big") for one in received]


def test_every_other_member_hears_every_message_in_order(tmp_path):
    with member(tmp_path / "bus") as sender, member(tmp_path / "bus") as one, member(tmp_path / "bus") as two:
        for number in range(5000):
            sender.send(message(number))
        assert numbers(one, 5000) == numbers(two, 5000) == list(range(5000))
        assert sender.recv(0) is None


@pytest.mark.parametrize(
    "sent",
    [
        can.Message(arbitration_id=0x1ABCDEF, data=b"", is_extended_id=True),
        can.Message(arbitration_id=5, is_remote_frame=True, is_extended_id=False),
        can.Message(arbitration_id=7, data=bytes(range(8)), is_extended_id=False),
        can.Message(arbitration_id=4, data=bytes(8), is_error_frame=True),
    ],
)
def test_a_message_arrives_as_it_was_sent(tmp_path, sent):
    with member(tmp_path) as sender, member(tmp_path) as listener:
        sender.send(sent)
        assert listener.recv(PATIENCE_S).equals(sent, timestamp_delta=None, check_channel=False)


def test_a_sender_without_time_does_not_wait_for_a_member_that_does_not_read(tmp_path):
    with member(tmp_path) as sender, member(tmp_path) as listener:
        for number in range(2 * PIPE_BYTES // 16):
            sender.send(message(number), timeout=0)
        found = []
        while (one := listener.recv(0)) is not None:
            found.append(int.from_bytes(one.data, "big"))
        assert found == list(range(len(found)))  # the first ones, as many as fit
        sender.send(message(7), timeout=0)
        assert numbers(listener, 1) == [7]


def test_members_come_and_go(tmp_path):
    with member(tmp_path) as sender:
        for number in range(3):
            with member(tmp_path) as listener:
                sender._looked_s = -1.0  # the sender looks again after 0.1 s; tests do not wait
                sender.send(message(number))
                assert numbers(listener, 1) == [number]
            sender.send(message(99))
        assert len(os.listdir(tmp_path)) == 1
    assert os.listdir(tmp_path) == []


def test_what_a_killed_member_left_is_cleared_away(tmp_path):
    os.mkfifo(tmp_path / "left-behind")
    with member(tmp_path) as sender:
        sender.send(message(1))
        assert len(os.listdir(tmp_path)) == 1


def test_a_place_that_cannot_be_one_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(can.CanInitializationError, match="file"):
        member(tmp_path / "file")
