"""What mounts show before the first engine start is their zero when it can be one; when it cannot, that is said."""

import pytest

from tests.pipeline.test_pipeline import flight, fly, of
from thrustd.core.types import Fault

AT_REST = {"mach": 0.0, "pressure_altitude_m": 0.0, "n1_pct": 0.0, "n2_pct": 0.0, "fuel_flow_kg_s": 0.0}


@pytest.mark.parametrize(("shown_mm", "refused"), [
    ((0.01, 0.01, 0.01, 0.01), []),
    ((0.3, 0.01, 0.01, 0.01), ["left_upper"]),
    ((0.3, 0.3, 0.3, 0.3), ["left_upper", "left_lower", "right_upper", "right_lower"]),
])  # fmt: skip
def test_a_zero_that_no_bracket_has_is_refused_aloud(aircraft, shown_mm, refused):
    faults = of(fly(aircraft, flight(aircraft, 20, lambda t: shown_mm, **AT_REST)), Fault)
    assert [fault.where for fault in faults if fault.kind == "zero_refused"] == refused
    taken = {mount.engine for mount in aircraft.config.mount if mount.name not in refused}
    assert {fault.where for fault in faults if fault.kind == "zero"} == taken
