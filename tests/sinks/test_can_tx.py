"""Estimates on the bus: identifiers, rate, and failures that are counted instead of raised."""

import struct
from math import nan
from pathlib import Path

from thrustd.core.types import Estimate, Fault, Reading
from thrustd.sinks.can_tx import CanTx
from thrustd.wire.can_frames import ICD_OUTPUT_ROWS
from thrustd.wire.can_table import CanTable, CanUnits

DBC_TEXT = (Path(__file__).parents[2] / "deploy" / "canaerospace.dbc").read_text()
TABLE = CanTable.from_dbc(DBC_TEXT, ICD_OUTPUT_ROWS, CanUnits())


def estimate(t_ns: int, engine: int, thrust_n: float = 5000.0) -> Estimate:
    return Estimate(t_ns, engine, thrust_n, 42.0, *[0.0] * 11, status=0)


def test_thrust_and_its_deviation_go_out_at_the_rate() -> None:
    sent: list[tuple[int, bytes]] = []
    tx = CanTx(TABLE, 42, 10.0, lambda *message: sent.append(message), list[Fault]().append)
    for step in range(100):
        for engine in (0, 1):
            tx.write_output(estimate(step * 20_000_000, engine, 5000.0 + engine))
    tx.write_output(Reading(0, "mach", 0, 0.3))
    assert [ident for ident, _ in sent[:4]] == [1850, 1852, 1851, 1853]
    assert len(sent) == 4 * 20
    assert struct.unpack(">BBBBf", sent[0][1]) == (42, 2, 0, 0, 5000.0)
    assert struct.unpack(">BBBBf", sent[6][1]) == (42, 2, 0, 1, 5001.0)


def test_failures_are_counted_and_told_in_bunches() -> None:
    faults: list[Fault] = []

    def refuse(ident: int, data: bytes) -> None:
        raise OSError("bus off")

    tx = CanTx(TABLE, 42, 10.0, refuse, faults.append)
    for step in range(25):
        tx.write_output(estimate(step * 100_000_000, 0))
    assert tx.failed_messages == 50
    assert {(fault.where, fault.kind) for fault in faults} == {("can_out", "not_sent")}
    assert len(faults) == 3
    assert sum(fault.count for fault in faults) <= 50


def test_what_is_no_number_is_not_sent() -> None:
    sent: list[tuple[int, bytes]] = []
    tx = CanTx(TABLE, 42, 10.0, lambda *message: sent.append(message), list[Fault]().append)
    tx.write_output(estimate(0, 0, nan))
    tx.write_output(estimate(10**9, 0, 1e300))
    tx.write_output(estimate(2 * 10**9, 7))
    assert [ident for ident, _ in sent] == [1852, 1852]
    assert tx.failed_messages == 4
