"""Makes the reference flights of this folder and the outputs expected from them: `python -m replay_logs.make`.

    throttle-steps   five minutes from engine start over take-off, throttle steps and turns
    sensor-fails     another aircraft; midway the right upper LVDT goes dead, later the left fuel flow sticks

A change of physics or fusion shows as a changed expectation in the same commit. The models, deck and configuration
that flew are inside the logs.
"""

import json
from collections.abc import Sequence
from functools import reduce
from math import isnan
from operator import or_
from pathlib import Path

import numpy as np

from benchmarks.integrity_edits import Edit, opened, says, together
from benchmarks.integrity_flight import damaged, on_the_wire, whole
from thrustd.core.columns import Floats
from thrustd.core.types import Estimate, Output
from thrustd.installation.installation import read_installation
from thrustd.pipeline.loop import run
from thrustd.sinks.mcap_log import new_log
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, Truth, fly, scripted_flight

FOLDER = Path(__file__).parent
CONFIG = FOLDER.parent / "deploy" / "hil.toml"
SECONDS = 300.0
EVERY_S = 2.0  # of the estimates that are kept as expectation
FAILS_S, STICKS_S = 150.0, 200.0


def _sticks(time_s: Floats, values: Floats) -> Floats:
    late = time_s >= STICKS_S - FAILS_S
    return np.where(late, values[np.argmax(late)], values)


FLIGHTS: dict[str, tuple[int, Edit | None]] = {  # seed; what is wrong from FAILS_S on
    "throttle-steps": (21, None),
    "sensor-fails": (22, together(opened((2,)), says("fuel_flow_kg_s", 0, _sticks))),
}


def make(name: str) -> None:
    seed, edit = FLIGHTS[name]
    installation = read_installation(CONFIG)
    rates = Rates(adc_hz=installation.config.adc.sample_hz)
    profile, airframe = scripted_flight(SECONDS, seed)
    items = list(fly(profile, airframe, installation.parts().can_table, seed, rates))
    if edit is not None:
        flown = on_the_wire(installation, profile, airframe, seed, rates)
        first, end = np.searchsorted(flown.wire.t_ns, items[0].t_ns + round(FAILS_S * 1e9)), len(flown.wire.t_ns)
        events = [*whole(flown, 0, int(first)), *damaged(flown, edit, int(first), end)]
        items = [*(item for item in items if isinstance(item, Truth)), *events]
    with new_log(FOLDER / f"{name}.mcap", installation.log_header()) as log:
        for item in items:
            if isinstance(item, Truth):
                log.write_truth(item.name, item.t_ns, item.value_n)
            else:
                log.write_event(item)
    rows = ",\n".join(json.dumps(row) for row in expected(FOLDER / f"{name}.mcap"))
    (FOLDER / f"{name}.expected.json").write_text(f"[\n{rows}\n]\n")


def expected(path: Path) -> list[list[float | None]]:
    """Per engine and `EVERY_S`: [seconds, engine, thrust_n, thrust_std_n, mount_n, brochure_n, status] of the first
    estimate, then [lowest thrust_n, highest thrust_n, highest thrust_std_n, all status bits] of all; None: no number.
    """
    from thrustd.installation.installation import installation_from_files

    log = LogFile(path)
    files = {name: text.encode() for name, text in log.header.files.items()}
    rows: list[list[float | None]] = []
    windows: dict[int, list[Estimate]] = {}

    def keep(outputs: Sequence[Output]) -> None:
        for e in outputs:
            if isinstance(e, Estimate):
                window = windows.setdefault(e.engine, [])
                if window and e.t_ns >= window[0].t_ns + round(EVERY_S * 1e9):
                    rows.append(row_of(window))
                    window.clear()
                window.append(e)

    run(log.batches(), installation_from_files(files, path.name).pipeline(), lambda batch: None, keep)
    return rows + [row_of(window) for window in windows.values()]


def row_of(window: Sequence[Estimate]) -> list[float | None]:
    first, thrusts_n = window[0], [e.thrust_n for e in window]
    values = first.thrust_n, first.thrust_std_n, first.mount_n, first.brochure_n
    most = min(thrusts_n), max(thrusts_n), max(e.thrust_std_n for e in window)
    bits = reduce(or_, (e.status for e in window))
    return [first.t_ns * 1e-9, first.engine, *map(_number, values), first.status, *map(_number, most), bits]


def _number(value: float) -> float | None:
    return None if isnan(value) else round(value, 6)


if __name__ == "__main__":
    for flight in FLIGHTS:
        make(flight)
