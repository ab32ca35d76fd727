"""Makes the reference flights of this folder and the outputs expected from them: `python replay_logs/make.py`.

    throttle-steps   five minutes from engine start over take-off, throttle steps and turns
    sensor-fails     another aircraft; midway the right upper LVDT goes dead, later the left fuel flow sticks

A change of physics or fusion shows as a changed expectation in the same commit. The models, deck and configuration
that flew are inside the logs.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from thrustd.installation import read_installation
from thrustd.loop import run
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.faults import SensorFault
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.types import Estimate, Output
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FOLDER = Path(__file__).parent
CONFIG = FOLDER.parent / "deploy" / "hil.toml"
SECONDS = 300.0
EVERY_S = 2.0  # of the estimates that are kept as expectation
FLIGHTS: dict[str, tuple[int, tuple[SensorFault, ...]]] = {
    "throttle-steps": (21, ()),
    "sensor-fails": (
        22,
        (
            SensorFault("deformation_mm", 2, "dead", 150.0),
            SensorFault("fuel_flow_kg_s", 0, "stuck", 200.0),
        ),
    ),
}


def make(name: str) -> None:
    seed, faults = FLIGHTS[name]
    installation = read_installation(CONFIG)
    profile, airframe = scripted_flight(SECONDS, seed)
    table = installation.can_table(ICD_INPUT_ROWS)
    rates = Rates(adc_hz=installation.config.adc.sample_hz)
    write_flight(FOLDER / f"{name}.mcap", profile, airframe, table, installation.log_header(), seed, rates, faults)
    (FOLDER / f"{name}.expected.json").write_text(json.dumps(expected(FOLDER / f"{name}.mcap"), indent=0) + "\n")


def expected(path: Path) -> list[list[float]]:
    """[seconds, engine, thrust_n, thrust_std_n, mount_n, brochure_n, status] every `EVERY_S`."""
    from thrustd.installation import installation_from_files

    log = LogFile(path)
    files = {name: text.encode() for name, text in log.header.files.items()}
    rows: list[list[float]] = []
    due: dict[int, int] = {}

    def keep(outputs: Sequence[Output]) -> None:
        for e in outputs:
            if isinstance(e, Estimate) and e.t_ns >= due.get(e.engine, 0):
                due[e.engine] = e.t_ns + round(EVERY_S * 1e9)
                values = (e.thrust_n, e.thrust_std_n, e.mount_n, e.brochure_n)
                rows.append([e.t_ns * 1e-9, e.engine, *(round(v, 6) for v in values), e.status])

    run(log.batches(), installation_from_files(files, path.name).pipeline(), lambda batch: None, keep)
    return rows


if __name__ == "__main__":
    for flight in FLIGHTS:
        make(flight)
