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
from thrustd.wire.can_table import CanField, CanMessage, CanRow, CanTable

CODE_MASK: Final = 0xFF
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


class _Sender:
    """Who sends one identifier, and what it said last."""

    __slots__ = ("code", "data", "node", "silent_after_ns", "t_ns")

    def __init__(self, silent_after_ns: int) -> None:
        self.node = self.code = -1  # -1: not heard yet
        self.t_ns = 0
        self.data = b""
        self.silent_after_ns = silent_after_ns  # after this silence another node may take over


class CanDecoder:
    """Messages in, readings and faults out; identifiers the table does not know give nothing."""

    __slots__ = ("_messages", "_where")

    def __init__(self, table: CanTable, where: str = "can") -> None:
        self._where = where
        self._messages = {ident: (message, _Sender(_silence_ns(message))) for ident, message in table.messages.items()}

    def feed(self, frame: Frame) -> list[Reading | Fault]:
        """What one message says. Never raises."""
        entry = self._messages.get(frame.ident)
        if entry is None:
            return []
        message, sender = entry
        data = frame.data
        if len(data) != message.n_bytes:
            return [Fault(frame.t_ns, self._at(message), "length")]
        values = message.unpack(data)
        out: list[Reading | Fault] = []
        if message.has_header:
            node, data_type, service, code = values[:4]
            wrong_type = data_type not in message.data_types and len(message.data_types) > 0
            if wrong_type or service:
                return [Fault(frame.t_ns, self._at(message), "can_data_type" if wrong_type else "can_service")]
            regular = node == sender.node and code == (sender.code + 1) & CODE_MASK
            if not regular and not self._accept(frame, message, sender, node, code, out):
                return out
            sender.node, sender.code, sender.t_ns, sender.data = node, code, frame.t_ns, data
        for field in message.fields:
            out.append(_read(frame.t_ns, field, values[field.position]))
        return out

    def _at(self, message: CanMessage) -> str:
        return f"{self._where}[{message.name}]"

    def _accept(
        self, frame: Frame, message: CanMessage, sender: _Sender, node: int, code: int, out: list[Reading | Fault]
    ) -> bool:
        """Judge a message whose counter or sender is not the expected one; False when it is to be dropped."""
        if sender.node == -1:
            return True
        if node != sender.node:
            silent = frame.t_ns - sender.t_ns > sender.silent_after_ns
            if not silent:
                out.append(Fault(frame.t_ns, self._at(message), "can_node"))
            return silent
        lost = (code - sender.code - 1) & CODE_MASK
        if lost < CODE_MASK:
            out.append(Fault(frame.t_ns, self._at(message), "lost", lost))
            return True
        same = frame.data == sender.data
        out.append(Fault(frame.t_ns, self._at(message), "duplicate" if same else "can_counter"))
        return not same


def _silence_ns(message: CanMessage) -> int:
    return round(max(CATALOGUE[field.signal].stale_after_s for field in message.fields) * 1e9)


def _read(t_ns: int, field: CanField, raw: float) -> Reading | Fault:
    value = raw * field.scale + field.offset
    if isfinite(value):
        return Reading(t_ns, field.signal, field.index, value)
    return Fault(t_ns, field.where, "not_finite")


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
