"""An aircraft with a short flight in a folder, to be left alone or to be damaged."""

import pytest

from tests.conftest import small_aircraft
from thrustd.installation.installation import CONFIG
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A folder with an aircraft and a short flight."""
    folder = tmp_path_factory.mktemp("good")
    aircraft = small_aircraft()
    for name, content in aircraft.files.items():
        (folder / ("aircraft.toml" if name == CONFIG else name)).write_bytes(content)
    profile, airframe = scripted_flight(20.0, 1)
    table = aircraft.can_table(ICD_INPUT_ROWS)
    write_flight(folder / "flight.mcap", profile, airframe, table, aircraft.log_header(), 1, Rates())
    return folder


@pytest.fixture
def broken(good, tmp_path):
    """A copy of `good` to damage."""
    for path in good.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path
