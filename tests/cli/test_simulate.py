"""The verb simulate: what it costs."""

import gc

from thrustd.__main__ import main


def test_no_collection_walks_what_stays_while_a_flight_is_made(tmp_path, monkeypatch):
    """A fifth of its time. What a flight makes is collected as ever, and behind it everything is."""
    seen = []

    def write_flight(*_):
        seen.append((gc.isenabled(), gc.get_freeze_count() > 10_000))

    monkeypatch.setattr("thrustd.twin.flight.write_flight", write_flight)
    assert main(["simulate", "--minutes", "1", "-o", str(tmp_path / "flight.mcap")]) == 0
    assert seen == [(True, True)] and gc.isenabled() and gc.get_freeze_count() == 0
