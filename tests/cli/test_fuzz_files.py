"""Files that may say anything: configurations, models, logs and tables, mutated. One clear error, or a usable value."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.conftest import simple_model, small_aircraft
from thrustd.core.config import read_config
from thrustd.core.errors import ConfigError, LogError, ModelError, RecordingError
from thrustd.installation.installation import CONFIG
from thrustd.model.artifact import read_model, write_model
from thrustd.records.files import read_recording
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

MODEL = write_model(simple_model()).encode()
TEXT = small_aircraft().files[CONFIG]
CSV = b"time_s,deformation_mm,force_N\n" + b"".join(b"%d.5,0.%03d,%d\n" % (i, i, 5 * i) for i in range(40))
WORDS = (b"", b"\0", b"\xff\xfe", b"nan", b"-inf", b"1e999", b"[" * 2000, b"{}", b'"', b",", b"9" * 400, b"null", b"\n")
FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@st.composite
def mutated(draw, content):
    """`content` cut, with bytes changed, or with words put in."""
    out = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(len(out) - 1, 0)))
        match draw(st.integers(0, 3)):
            case 0:
                del out[at:]
            case 1:
                out[at : at + 1] = bytes([draw(st.integers(0, 255))])
            case 2:
                out[at:at] = draw(st.sampled_from(WORDS))
            case _:
                del out[at : at + draw(st.integers(1, 40))]
    return bytes(out)


def clear(error):
    """One line that names the file."""
    text = str(error.value) if hasattr(error, "value") else str(error)
    assert "fuzzed" in text
    assert len(text.splitlines()) == 1


@FUZZ
@given(mutated(TEXT))
def test_configurations(content):
    try:
        read_config(content.decode(errors="replace"), "fuzzed.toml")
    except ConfigError as error:
        clear(error)


@FUZZ
@given(mutated(MODEL))
def test_models(content):
    try:
        read_model(content, "fuzzed.json")
    except ModelError as error:
        clear(error)


@FUZZ
@given(content=mutated(CSV))
def test_tables(content, tmp_path):
    path = tmp_path / "fuzzed.csv"
    path.write_bytes(content)
    try:
        read_recording(path)
    except RecordingError as error:
        clear(error)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("fuzz") / "flight.mcap"
    installation = small_aircraft()
    profile, airframe = scripted_flight(2.0, 1)
    table = installation.can_table(ICD_INPUT_ROWS)
    write_flight(path, profile, airframe, table, installation.log_header(), 1, Rates(accel_hz=10.0))
    return path.read_bytes()


@FUZZ
@given(data=st.data())
def test_logs(log, data, tmp_path):
    path = tmp_path / "fuzzed.mcap"
    path.write_bytes(data.draw(mutated(log)))
    try:
        file = LogFile(path)
        list(file.events())
        list(file.messages())
    except LogError as error:
        clear(error)
