"""The flight log, written and read: order, header, cuts, damage, foreign readers."""

import io
import random
import struct
from pathlib import Path

import msgspec
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from thrustd.core.errors import LogError
from thrustd.core.types import Estimate, Event, Fault, Frame, MountOutput, Output, Reading, Status, Tick
from thrustd.sinks.mcap_log import LogWriter, new_log
from thrustd.sources.mcap_log import LogFile
from thrustd.wire.log_layout import LogHeader

HEADER = LogHeader(
    engines=("left", "right"),
    mounts=("left_upper", "left_lower", "right_upper", "right_lower"),
    files={"config.toml": "[aircraft]\nname = 'test'\n"},
    sha256={"config.toml": "ab" * 32},
    epoch_offset_ns=1_500_000_000 * 10**9,
)
NAN = float("nan")


def events(seconds: float = 3.0) -> list[Event]:
    """A little flight: ADC chunks at 1 kHz, CAN at 100 Hz, ticks at 20 Hz, a fault now and then."""
    out: list[Event] = []
    for i in range(round(seconds * 1000)):
        t_ns = 10**9 + i * 1_000_000
        out.append(Frame(t_ns, "adc", 0, random.Random(i).randbytes(26)))
        if i % 10 == 0:
            out.append(Frame(t_ns + 5, "can", 300, i.to_bytes(8, "big")))
        if i % 50 == 0:
            out.append(Tick(t_ns + 7))
        if i % 700 == 0:
            out.append(Fault(t_ns + 9, "adc", "overrun", count=3))
    return out


def outputs(t_ns: int) -> list[Output]:
    estimate = Estimate(
        t_ns, 1, 5000.5, 40.0, 1.0, 5001.0, 50.0, NAN, NAN, 1.5, NAN, 0.9, 3.0, 0.01, 0.5,
        int(Status.BROCHURE_LOST | Status.CONVERGING),
    )  # fmt: skip
    return [
        estimate,
        MountOutput(t_ns, 2, 0.5, 2500.0, 30.0),
        Reading(t_ns, "n1_pct", 1, 80.25),
        Reading(t_ns, "mach", 0, 0.3),
        Fault(t_ns, "adc", "damaged"),
    ]


def write(path: Path, flight: list[Event], reading_hz: float = 10.0) -> None:
    with new_log(path, HEADER, reading_hz) as log:
        for i, event in enumerate(flight):
            log.write_event(event)
            if i % 20 == 0:
                for output in outputs(event.t_ns):
                    log.write_output(output)
                log.write_truth("right", event.t_ns, 5010.0)
                log.write_truth("left_upper", event.t_ns, 2505.0)


@pytest.fixture(scope="module")
def flight() -> list[Event]:
    return events()


@pytest.fixture(scope="module")
def log_path(tmp_path_factory: pytest.TempPathFactory, flight: list[Event]) -> Path:
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    write(path, flight)
    return path


def test_events_come_back_in_arrival_order(log_path: Path, flight: list[Event]) -> None:
    log = LogFile(log_path)
    assert list(log.events()) == flight
    assert (log.cut, log.missing_events, log.position_bytes) == (False, 0, log.size_bytes)


def test_arrival_order_is_kept_when_time_is_not_ordered(tmp_path: Path, flight: list[Event]) -> None:
    shuffled = random.Random(1).sample(flight, len(flight))
    write(tmp_path / "shuffled.mcap", shuffled)
    assert list(LogFile(tmp_path / "shuffled.mcap").events()) == shuffled


def test_the_header_comes_back(log_path: Path) -> None:
    assert LogFile(log_path).header == HEADER


def test_the_same_writes_give_the_same_bytes(tmp_path: Path, log_path: Path, flight: list[Event]) -> None:
    write(tmp_path / "again.mcap", flight)
    assert (tmp_path / "again.mcap").read_bytes() == log_path.read_bytes()


def test_outputs_are_plottable_json_on_named_topics(log_path: Path) -> None:
    rows = {m.topic: msgspec.json.decode(m.data) for m in LogFile(log_path).messages()}
    assert set(rows) == {
        "/estimate/right", "/mount/right_upper", "/reading/n1_pct/right", "/reading/mach", "/fault",
        "/truth/right", "/truth/left_upper",
    }  # fmt: skip
    estimate = rows["/estimate/right"]
    assert (estimate["thrust_n"], estimate["brochure_n"]) == (5000.5, None)
    assert estimate["status_text"] == ["BROCHURE_LOST", "CONVERGING"]
    assert rows["/truth/right"]["thrust_n"] == 5010.0
    assert rows["/truth/left_upper"]["force_n"] == 2505.0


def test_readings_are_thinned_per_channel(tmp_path: Path) -> None:
    path = tmp_path / "readings.mcap"
    with new_log(path, HEADER, reading_hz=10) as log:
        for i in range(1000):
            log.write_output(Reading(i * 10_000_000 + i % 3 * 100_000, "accel_x_g", 0, 0.1))  # 100 Hz, jitter
        for i in range(100):
            log.write_output(Reading(i * 100_000_000 + i % 3 * 1_000_000, "mach", 0, 0.1))  # 10 Hz, jitter
    topics = [message.topic for message in LogFile(path).messages()]
    assert 100 <= topics.count("/reading/accel_x_g") <= 130
    assert topics.count("/reading/mach") == 100


def test_the_mcap_package_reads_it_with_index_schemas_and_checksums(log_path: Path, flight: list[Event]) -> None:
    with log_path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        by_topic = {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()}
        assert by_topic["/estimate/right"] == -(-len(flight) // 20)
        one_topic = list(reader.iter_messages(topics=["/truth/right"]))
        assert len(one_topic) == by_topic["/truth/right"]
        schema, _, message = one_topic[0]
        assert schema is not None
        assert msgspec.json.decode(schema.data)["properties"]["thrust_n"] == {"type": "number"}
        assert message.log_time == flight[0].t_ns + HEADER.epoch_offset_ns
        assert [entry.name for entry in reader.iter_metadata()] == ["thrustd"]
    with log_path.open("rb") as stream:
        assert sum(1 for _ in StreamReader(stream, validate_crcs=True).records) > 100


def test_a_log_cut_anywhere_gives_a_prefix_and_says_so(tmp_path: Path, log_path: Path, flight: list[Event]) -> None:
    whole, path = log_path.read_bytes(), tmp_path / "cut.mcap"
    first_chunk = 3000  # header, schemas and topics come first
    for size in [*random.Random(2).sample(range(first_chunk, len(whole) - 1), 40), len(whole) - 1]:
        path.write_bytes(whole[:size])
        log = LogFile(path)
        found = list(log.events())
        assert log.cut
        assert found == flight[: len(found)]


def test_a_synced_log_loses_less_than_a_second(flight: list[Event]) -> None:
    stream = io.BytesIO()
    log, kept = LogWriter(stream, HEADER), 0
    for event in flight:
        log.write_event(event)
        if stream.tell() > kept:
            kept = stream.tell()
            synced_ns = event.t_ns
        assert event.t_ns - synced_ns < 600_000_000


def test_four_flipped_bytes_anywhere_are_noticed(tmp_path: Path, log_path: Path) -> None:
    whole, path, dice = log_path.read_bytes(), tmp_path / "flipped.mcap", random.Random(3)
    for _ in range(150):
        at, damaged = dice.randrange(len(whole) - 4), bytearray(whole)
        for i in range(at, at + 4):
            damaged[i] ^= dice.randrange(1, 256)
        path.write_bytes(damaged)
        with pytest.raises(LogError) as caught:
            list(LogFile(path).events())
        assert "flipped.mcap" in str(caught.value)
        assert "\n" not in str(caught.value)


def chunks_of(content: bytes) -> list[int]:
    """Where the chunks begin."""
    found, at = [], 0
    while (at := content.find(b"\x04\0\0\0zstd", at + 1)) > 0:
        found.append(at - 37)
    return found[: content.count(b"\x04\0\0\0zstd")]


@pytest.mark.parametrize("place", ["inside", "length", "longer", "opcode", "index"])
def test_what_is_whole_of_a_damaged_log_is_read(
    tmp_path: Path, log_path: Path, flight: list[Event], place: str
) -> None:
    content, path = bytearray(log_path.read_bytes()), tmp_path / "damaged.mcap"
    at, behind = [begin for begin in chunks_of(content) if content[begin] == 6][1:3]
    if place == "inside":
        content[at + 300 : at + 304] = b"oops"
    elif place == "length":
        content[at + 1 : at + 9] = struct.pack("<Q", 2**50)
    elif place == "longer":  # swallows its neighbour
        content[at + 1 : at + 9] = struct.pack("<Q", behind + 200 - at)
    elif place == "opcode":
        content[at] = 0x86
    else:  # the index behind it: nothing is lost
        index_at = at + 9 + struct.unpack_from("<Q", content, at + 1)[0]
        content[index_at + 20] ^= 1
    path.write_bytes(content)
    with pytest.raises(LogError, match="--salvage"):
        list(LogFile(path).events())
    log = LogFile(path, salvage=True)
    found = list(log.events())
    faults = [event for event in found if isinstance(event, Fault) and event.kind == "damaged"]
    kept = [event for event in found if event not in faults]
    gone = [event for event in flight if event not in set(kept)]
    first = flight.index(gone[0]) if gone else 0
    assert kept == flight[:first] + flight[first + len(gone) :]  # one stretch is missing, the rest is as it was
    assert [(fault.where, fault.count) for fault in faults] == [("log", 1)]
    assert log.missing_events == len(gone)
    assert (len(gone) == 0) == (place == "index")
    if gone:
        lost_s = (flight[first + len(gone)].t_ns - flight[first - 1].t_ns) * 1e-9
        told_s = float(log.damage.split("damaged: ")[1].split(" s from")[0])
        assert told_s == pytest.approx(lost_s, abs=0.1)
        assert f"byte {at}:" in log.damage


def test_damage_in_a_log_that_was_cut_is_no_end(tmp_path: Path, log_path: Path, flight: list[Event]) -> None:
    content, path = bytearray(log_path.read_bytes()), tmp_path / "both.mcap"
    at = [begin for begin in chunks_of(content) if content[begin] == 6][1]
    content[at + 1 : at + 9] = struct.pack("<Q", 2**50)
    path.write_bytes(content[: len(content) * 3 // 4])
    with pytest.raises(LogError, match=f"byte {at}: a record of"):
        list(LogFile(path).events())
    log = LogFile(path, salvage=True)
    found = [event for event in log.events() if event in set(flight)]
    assert log.cut
    assert found[-1].t_ns - flight[0].t_ns > 1.5e9


def test_of_a_log_damaged_anywhere_nothing_is_invented(tmp_path: Path, log_path: Path, flight: list[Event]) -> None:
    whole, path, dice = log_path.read_bytes(), tmp_path / "flipped.mcap", random.Random(5)
    known, read = set(flight), 0
    for _ in range(60):
        at, damaged = dice.randrange(len(whole) - 4), bytearray(whole)
        for i in range(at, at + 4):
            damaged[i] ^= dice.randrange(1, 256)
        path.write_bytes(damaged)
        try:
            log = LogFile(path, salvage=True)
            found = [e for e in log.events() if not (isinstance(e, Fault) and e.kind == "damaged")]
        except LogError:
            assert at < chunks_of(whole)[0]  # header, schemas or channels
            continue
        assert log.damage
        assert set(found) <= known
        assert log.missing_events <= len(flight) - len(found)
        read += len(found)
    assert read > 30 * len(flight)


def test_noise_after_a_good_start_is_refused_not_crashed_on(tmp_path: Path, log_path: Path) -> None:
    whole, path, dice = log_path.read_bytes(), tmp_path / "noise.mcap", random.Random(4)
    for _ in range(100):
        path.write_bytes(whole[: dice.randrange(8, 400)] + dice.randbytes(dice.randrange(0, 3000)))
        try:
            list(LogFile(path).events())
        except LogError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "empty file"), (b"PK\x03\x04 not mcap at all", "expected an MCAP"), (b"\x89MCAP0\r\n", "log header")],
)
def test_files_that_are_no_logs_are_refused(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "wrong.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match=words):
        LogFile(path)
    with pytest.raises(LogError, match="cannot be read"):
        LogFile(tmp_path / "missing.mcap")


def test_a_log_without_events_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "empty.mcap", [])
    with pytest.raises(LogError, match="/raw"):
        list(LogFile(tmp_path / "empty.mcap").events())


def test_dropped_events_show_as_a_jump_in_their_numbers(tmp_path: Path, flight: list[Event]) -> None:
    path = tmp_path / "dropped.mcap"
    with new_log(path, HEADER) as log:
        for number, event in enumerate(flight):
            if not 500 <= number < 600:
                log.write_event(event, number)
    reader = LogFile(path)
    assert list(reader.events()) == flight[:500] + flight[600:]
    assert reader.missing_events == 100


def test_a_failing_write_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), new_log(tmp_path / "x.mcap", HEADER) as log:
        log.write_event(Tick(1 // 0))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(LogError, match="cannot be written"), new_log(tmp_path / "no" / "x.mcap", HEADER):
        pass


def chunk(uncompressed_size: int, squeezed: bytes, compression: bytes = b"zstd") -> bytes:
    """A chunk record that says of itself what it likes."""
    head = struct.pack("<QQQII", 0, 0, uncompressed_size, 0, len(compression)) + compression
    content = head + struct.pack("<Q", len(squeezed)) + squeezed
    return struct.pack("<BQ", 6, len(content)) + content


BOMB = zstandard.compress(bytes(300_000_000))


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (chunk(2**40, b"x"), "chunk of 1099511627776 bytes"),
        (chunk(1000, BOMB), "zstd frame of 300000000 bytes, expected 1000"),
        (chunk(300_000_000, BOMB), "chunk of 300000000 bytes"),
        (chunk(10, b"0123456789", b"lzma"), "expected zstd or none"),
        (chunk(9, struct.pack("<BQ", 5, 1000), b""), "longer than its chunk"),
        (chunk(10, struct.pack("<BQB", 5, 1, 0), b""), "message of 1 bytes"),
        (struct.pack("<BQ", 6, 2**60), "a record of 1152921504606846976 bytes"),
        (struct.pack("<BQ", 12, 4) + struct.pack("<I", 2**31), "text longer"),
    ],
)
def test_a_log_that_lies_about_its_sizes_costs_no_memory(tmp_path: Path, record: bytes, words: str) -> None:
    path = tmp_path / "liar.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + record + b"\x89MCAP0\r\n")
    with pytest.raises(LogError, match=words):
        LogFile(path)


def test_truth_is_copied_as_it_is(log_path: Path, tmp_path: Path) -> None:
    topics = ("/truth/right", "/truth/left_upper")
    source, copy = LogFile(log_path), tmp_path / "copy.mcap"
    with new_log(copy, HEADER) as log:
        log.write_event(Tick(0))
        for messages in source.groups(topics):
            log.copy(messages)
    assert list(LogFile(copy).messages(topics)) == list(source.messages(topics)) != []
    with copy.open("rb") as stream:
        assert {schema.name for schema, *_ in make_reader(stream).iter_messages(topics) if schema} == {
            "thrustd.EngineTruth",
            "thrustd.MountTruth",
        }
