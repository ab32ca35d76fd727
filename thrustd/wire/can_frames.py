"""CAN messages <-> catalogue readings (ICD section 2: CANaerospace 1.7, or any bus with a DBC).

    CANaerospace message = node id | data type | service code | message code | 4 bytes data       big-endian

Judged per message: length, data type, service code 0, one living sender per identifier, message code counting up by
one, finite values. What does not fit becomes a named fault. Whether a value is plausible is not judged here. The
message code has 8 bits, so "lost" counts at least so many.
"""

from math import isfinite
from typing import Final

from thrustd.signals import CATALOGUE
from thrustd.types import Fault, Frame, Reading
from thrustd.wire.can_table import CanMessage, CanRow, CanTable

CODE_MASK: Final = 0xFF
_new: Final = tuple.__new__  # half the time of calling a NamedTuple
N_MOUNTS = 8  # ICD: LVDT channels 0..7

# ICD section 2 over deploy/canaerospace.dbc: what thrustd hears ...
_AIRCRAFT_ROWS = (
    CanRow("BodyLongitudinalAcceleration", "accel_x_g"),
    CanRow("BodyLateralAcceleration", "accel_y_g"),
    CanRow("BodyNormalAcceleration", "accel_z_g"),
    CanRow("BodyPitchAngle", "pitch_deg"),
    CanRow("MachNumber", "mach"),
    CanRow("StandardAltitude", "pressure_altitude_m"),
    CanRow("TotalAirTemperature", "tat_degC"),
    CanRow("StaticAirTemperature", "sat_degC"),
)
_ENGINE_COLUMNS = (("N1", "n1_pct"), ("N2", "n2_pct"), ("FuelFlow", "fuel_flow_kg_s"))
_MOUNT_COLUMNS = (("Temperature", "temperature_degC"), ("Vibration", "vibration_mm_s"))
ICD_INPUT_ROWS = (
    *_AIRCRAFT_ROWS,
    *(CanRow(f"Engine{e + 1}_{dbc}", name, e) for dbc, name in _ENGINE_COLUMNS for e in range(2)),
    *(CanRow(f"Mount{m}_{dbc}", name, m) for dbc, name in _MOUNT_COLUMNS for m in range(N_MOUNTS)),
)
# ... and what it says
ICD_OUTPUT_ROWS = (
    *(CanRow(f"Engine{e + 1}_Thrust", "thrust_N", e) for e in range(2)),
    *(CanRow(f"Engine{e + 1}_ThrustStd", "thrust_std_N", e) for e in range(2)),
)


class _Line:
    """One identifier in the hot path: how to read it, who sends it, and what it said last."""

    __slots__ = (
        "data", "data_type", "fields", "has_header", "message", "n_bytes", "next_code", "node", "silent_after_ns",
        "t_ns", "unpack",
    )  # fmt: skip

    def __init__(self, message: CanMessage) -> None:
        self.message = message
        self.unpack, self.n_bytes, self.has_header = message.unpack, message.n_bytes, message.has_header
        self.fields = [(f.position, f.scale, f.offset, f.signal, f.index, f.where) for f in message.fields]
        self.node = self.data_type = self.next_code = -1  # -1: not heard yet
        self.t_ns, self.data = 0, b""
        stale_s = max(CATALOGUE[field.signal].stale_after_s for field in message.fields)
        self.silent_after_ns = round(stale_s * 1e9)  # after this silence another node may take over


class CanDecoder:
    """Messages in, readings and faults out; identifiers the table does not know give nothing."""

    __slots__ = ("_lines", "_where")

    def __init__(self, table: CanTable, where: str = "can") -> None:
        self._where = where
        self._lines = {ident: _Line(message) for ident, message in table.messages.items()}

    def feed(self, frame: Frame) -> list[Reading | Fault]:
        """What one message says. Never raises."""
        t_ns, _, ident, data = frame
        line = self._lines.get(ident)
        if line is None:
            return []
        if len(data) != line.n_bytes:
            return [self._fault(t_ns, line, "length")]
        values = line.unpack(data)
        out: list[Reading | Fault] = []
        if line.has_header:
            code = values[3]
            regular = code == line.next_code and values[0] == line.node and values[1] == line.data_type
            if (not regular or values[2]) and not self._accept(frame, line, values, out):
                return out
            line.next_code, line.t_ns, line.data = code + 1 & CODE_MASK, t_ns, data
        for position, scale, offset, signal, index, where in line.fields:
            value = values[position] * scale + offset
            if isfinite(value):
                out.append(_new(Reading, (t_ns, signal, index, value)))
            else:
                out.append(Fault(t_ns, where, "not_finite"))
        return out

    def _fault(self, t_ns: int, line: _Line, kind: str, count: int = 1) -> Fault:
        return Fault(t_ns, f"{self._where}[{line.message.name}]", kind, count)

    def _accept(self, frame: Frame, line: _Line, values: tuple[int, ...], out: list[Reading | Fault]) -> bool:
        """Judge a message whose header is not the expected one; False when it is to be dropped."""
        node, data_type, service, code = values[:4]
        legal = line.message.data_types
        if service or (legal and data_type not in legal):
            out.append(self._fault(frame.t_ns, line, "can_service" if service else "can_data_type"))
            return False
        line.data_type = data_type
        if line.node == node:
            return self._count(frame, line, code, out)
        silent = line.node == -1 or frame.t_ns - line.t_ns > line.silent_after_ns
        if silent:
            line.node = node
        else:
            out.append(self._fault(frame.t_ns, line, "can_node"))
        return silent

    def _count(self, frame: Frame, line: _Line, code: int, out: list[Reading | Fault]) -> bool:
        """Judge a message code of the living sender; False for the same message once more."""
        lost = (code - line.next_code) & CODE_MASK
        if lost == CODE_MASK:
            same = frame.data == line.data
            out.append(self._fault(frame.t_ns, line, "duplicate" if same else "can_counter"))
            return not same
        if lost:
            out.append(self._fault(frame.t_ns, line, "lost", lost))
        return True


class CanEncoder:
    """Catalogue values -> messages, counting the message code per identifier. One node sends them all."""

    __slots__ = ("_codes", "_node_id", "_places", "_raw")

    def __init__(self, table: CanTable, node_id: int) -> None:
        self._node_id = node_id
        self._codes = dict.fromkeys(table.messages, CODE_MASK)  # so that the first one is 0
        self._raw: dict[int, list[float]] = {
            ident: [0.0] * len(message.fields) for ident, message in table.messages.items()
        }
        self._places = {
            (field.signal, field.index): (message, number)
            for message in table.messages.values()
            for number, field in enumerate(message.fields)
        }

    def encode(self, signal: str, index: int, value: float) -> tuple[int, bytes]:
        """(identifier, data) that says `signal[index] = value` in the catalogue's unit.

        Other signals in the same message repeat their last value. OverflowError when the value does not fit.
        """
        message, number = self._places[signal, index]
        field = message.fields[number]
        raw = self._raw[message.ident]
        raw[number] = (value - field.offset) / field.scale
        code = self._codes[message.ident] = (self._codes[message.ident] + 1) & CODE_MASK
        header = (self._node_id, min(message.data_types, default=0), 0, code) if message.has_header else ()
        return message.ident, message.pack(*header, *raw)
