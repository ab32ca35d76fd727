"""Estimates on the bus: identifiers, rate, and failures that are counted instead of raised."""

import struct
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest

from thrustd.core.types import Estimate, Fault, Reading, Status
from thrustd.sinks.can_tx import CanTx
from thrustd.wire.can_frames import ICD_OUTPUT_ROWS
from thrustd.wire.can_table import CanTable, CanUnits
from thrustd.wire.estimate_status import VALID, status_word

DBC_TEXT = (Path(__file__).parents[2] / "deploy" / "canaerospace.dbc").read_text()
TABLE = CanTable.from_dbc(DBC_TEXT, ICD_OUTPUT_ROWS, CanUnits())


def estimate(t_ns: int, engine: int, thrust_n: float = 5000.0, status: int = 0) -> Estimate:
    return Estimate(t_ns, engine, thrust_n, 42.0, *[0.0] * 11, status=status)


def test_thrust_and_its_deviation_go_out_at_the_rate() -> None:
    sent: list[tuple[int, bytes]] = []
    tx = CanTx(TABLE, 42, 10.0, 50.0, lambda *message: sent.append(message), list[Fault]().append)
    for step in range(100):
        for engine in (0, 1):
            tx.write_output(estimate(step * 20_000_000, engine, 5000.0 + engine))
    tx.write_output(Reading(0, "mach", 0, 0.3))
    assert [ident for ident, _ in sent[:6]] == [1850, 1852, 1854, 1851, 1853, 1855]
    assert len(sent) == 6 * 20
    assert struct.unpack(">BBBBf", sent[0][1]) == (42, 2, 0, 0, 5000.0)
    assert struct.unpack(">BBBBf", sent[9][1]) == (42, 2, 0, 1, 5001.0)
    assert struct.unpack(">BBBBI", sent[2][1]) == (42, 5, 0, 0, 1)


@pytest.mark.parametrize("rate_hz", [6.4, 10.0, 20.0])
def test_the_rate_is_kept_by_steps_that_jitter(rate_hz: float) -> None:
    rng, sent = np.random.default_rng(1), list[tuple[int, bytes]]()
    tx = CanTx(TABLE, 42, rate_hz, 50.0, lambda *message: sent.append(message), list[Fault]().append)
    for step in range(5000):  # 100 s
        tx.write_output(estimate(step * 20_000_000 + int(rng.integers(0, 15_000_000)), 0))
    assert len(sent) / 3 == pytest.approx(100.0 * rate_hz, abs=2)


@pytest.mark.parametrize("crystal", [1.0, 1.0 + 1e-4, 1.0 - 1e-4])
def test_at_the_rate_of_the_estimates_every_estimate_is_sent(crystal: float) -> None:
    rng, sent = np.random.default_rng(1), list[tuple[int, bytes]]()
    tx = CanTx(TABLE, 42, 10.0, 10.0, lambda *message: sent.append(message), list[Fault]().append)
    for step in range(20_000):  # 2000 s: a crystal that is off by 1e-4 leaves the schedule by two periods
        tx.write_output(estimate(round(step * 1e8 * crystal) + int(rng.integers(-400_000, 400_000)), 0))
    assert len(sent) / 3 >= 19_998


def test_nothing_is_sent_before_a_thrust_is_found_and_a_clock_that_goes_back_silences_nobody() -> None:
    sent: list[tuple[int, bytes]] = []
    tx = CanTx(TABLE, 42, 10.0, 50.0, lambda *message: sent.append(message), list[Fault]().append)
    tx.write_output(estimate(0, 0, 0.0, int(Status.CONVERGING)))
    assert not sent
    tx.write_output(estimate(10**9, 0))
    tx.write_output(estimate(2 * 10**9, 0, status=int(Status.CONVERGING)))
    assert len(sent) == 6 and struct.unpack(">I", sent[-1][1][4:]) == (1 << 7,)
    tx.write_output(estimate(10**8, 0))
    assert len(sent) == 9


@pytest.mark.parametrize(("status", "word"), [
    (Status(0), 0b1), (Status.CONVERGING, 0b1000_0000), (Status.MOUNT_LOST, 0b11),
    (Status.MOUNT_LOST | Status.BROCHURE_LOST, 0b10), (Status.ENGINE_OFF, 0b1), (Status.DISAGREE, 0b101),
    (Status.SENSOR_EXCLUDED, 0b1001), (Status.NOT_RECORDING, 0b1_0001), (Status.DECK_EXTRAPOLATING, 0b10_0001),
    (Status.TRANSIENT, 0b100_0001),
])  # fmt: skip
def test_the_bits_of_the_status(status: Status, word: int) -> None:
    assert status_word(int(status)) == word


WORD_OF = {  # by bit of the word: what sets it
    1: ("MOUNT_LOST", "MOUNT_FAILED", "BROCHURE_LOST", "BROCHURE_FAILED", "ONE_MOUNT"),
    2: ("DISAGREE", "MOUNT_REJECTED", "BROCHURE_REJECTED"),
    3: (
        "SENSOR_EXCLUDED", "STUCK", "MOUNTS_DISAGREE", "CHANNEL_OPEN",
        "OUT_OF_RANGE", "SIGNAL_STALE", "LOAD_FACTOR_STALE", "LINK_LOST",
    ),
    4: ("NOT_RECORDING",),
    5: ("MODEL_EXTRAPOLATING", "DECK_EXTRAPOLATING"),
    6: ("TRANSIENT",),
    7: ("CONVERGING",),
}  # fmt: skip


@pytest.mark.parametrize("status", list(Status))
def test_every_bit_of_an_estimate_sets_the_one_that_stands_for_it(status: Status) -> None:
    mine = sum(1 << bit for bit, names in WORD_OF.items() if status.name in names)
    assert status_word(int(status)) & ~VALID == mine
    assert bool(status_word(int(status)) & VALID) == (status != Status.CONVERGING)


def test_failures_are_counted_and_told_in_bunches() -> None:
    faults: list[Fault] = []

    def refuse(ident: int, data: bytes) -> None:
        raise OSError("bus off")

    tx = CanTx(TABLE, 42, 10.0, 10.0, refuse, faults.append)
    for step in range(25):
        tx.write_output(estimate(step * 100_000_000, 0))
    assert {(fault.where, fault.kind) for fault in faults} == {("can_out", "not_sent")}
    assert len(faults) == 3
    assert sum(fault.count for fault in faults) == 21  # estimates; the rest is told with the next


@pytest.mark.parametrize("told", [
    estimate(0, 0, nan), estimate(0, 0, inf), estimate(0, 0, 1e300), estimate(0, 0)._replace(thrust_std_n=nan),
    estimate(0, 7),
])  # fmt: skip
def test_of_what_is_no_number_nothing_is_sent_and_no_status_says_that_it_is_valid(told: Estimate) -> None:
    sent, faults = list[tuple[int, bytes]](), list[Fault]()
    tx = CanTx(TABLE, 42, 10.0, 50.0, lambda *message: sent.append(message), faults.append)
    tx.write_output(told)
    assert not sent and [(fault.kind, fault.count) for fault in faults] == [("not_sent", 1)]
    tx.write_output(estimate(10**9, 0))
    assert [ident for ident, _ in sent] == [1850, 1852, 1854]
