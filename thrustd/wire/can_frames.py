"""CAN messages as they are said (ICD section 2: CANaerospace 1.7, or any bus with a DBC); heard by `can_decoder`.

CANaerospace message = node id | data type | service code | message code | 4 bytes data       big-endian
"""

from collections.abc import Sequence
from typing import Final

from thrustd.wire.can_table import FLOAT, CanRow, CanTable

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
ICD_OPTIONAL_ROWS = (  # heard where the DBC has them
    CanRow("BodyPitchRate", "pitch_rate_deg_s"),
    CanRow("BodyRollRate", "roll_rate_deg_s"),
    CanRow("BodyYawRate", "yaw_rate_deg_s"),
    CanRow("TestPointMark", "mark"),
)
# ... and what it says
ICD_OUTPUT_ROWS = (
    *(CanRow(f"Engine{e + 1}_Thrust", "thrust_N", e) for e in range(2)),
    *(CanRow(f"Engine{e + 1}_ThrustStd", "thrust_std_N", e) for e in range(2)),
    *(CanRow(f"Engine{e + 1}_ThrustStatus", "thrust_status", e) for e in range(2)),
)


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

    def says(self, signal: str, index: int) -> bool:
        """Whether some message carries it."""
        return (signal, index) in self._places

    def encode(self, signal: str, index: int, value: float) -> tuple[int, bytes]:
        """(identifier, data) that says `signal[index] = value` in the catalogue's unit.

        Other signals in the same message repeat their last value. OverflowError when the value does not fit.
        """
        ident, (data,) = self.encode_all(signal, index, (value,))
        return ident, data

    def encode_all(self, signal: str, index: int, values: Sequence[float]) -> tuple[int, list[bytes]]:
        """Of values one after another, with nothing of the same message between them."""
        message, number = self._places[signal, index]
        field, ident = message.fields[number], message.ident
        raw, first = self._raw[ident], self._codes[ident] + 1
        exact: list[float] = [(value - field.offset) / field.scale for value in values]
        if field.bits.kind != FLOAT:
            exact = [round(each) for each in exact]
        before, after, pack = raw[:number], raw[number + 1 :], message.pack
        self._codes[ident], raw[number] = (first + len(exact) - 1) & CODE_MASK, exact[-1] if exact else raw[number]
        if not message.header:
            return ident, [pack(*before, each, *after) for each in exact]
        head = self._node_id, min(message.data_types, default=0), 0
        return ident, [pack(*head, code & CODE_MASK, *before, each, *after) for code, each in enumerate(exact, first)]
