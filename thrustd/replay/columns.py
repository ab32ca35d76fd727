"""A flight's raw events as columns, without an estimate: what every sensor said, at the fused steps.

deformation_mm_left_upper     mean of a mount's samples since the last step, no zero taken off
n1_pct_left, mach, ...        held readings, NaN where stale
dynamic_pressure_Pa           from Mach and pressure altitude
model_N_left_upper            what the mount's model makes of it; from rest where the log begins with engines off
"""

from collections.abc import Callable

import numpy as np

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.config import section
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Fault
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.pipeline.intake import Intake
from thrustd.records.recording import Recording, make_recording
from thrustd.sources.log_run import LogRun

PRESSURE = "dynamic_pressure_Pa", 0  # from Mach and pressure altitude, as in flight
RESTS_AFTER = 20  # fused steps: by then every signal was heard


def flight_columns(
    log: LogRun, installation: Installation, advance: Callable[[float], None] = lambda fraction: None
) -> Recording:
    """The log's events through the intake alone; ConfigError or LogError when they do not fit the installation."""
    config, parts = installation.config, installation.parts()
    settings = section(config.fusion, FusionSettings, "fusion")
    intake = Intake(config, parts.models, parts.can_table, settings, parts.calibrations)
    slots, last_ns, resting = intake.hold.slots, -1, True
    rows: list[tuple[float, ...]] = []
    speeds = [slots.index(("n1_pct", engine)) for engine in range(len(config.aircraft.engines))]
    air = [slots.index((name, 0)) for name in ("mach", "pressure_altitude_m")]
    for batch in log.batches():
        for due in intake.take(batch):
            if isinstance(due, Fault):
                continue
            intake.hold.look(due)
            values: list[float] = intake.hold.seen[0, : len(slots)].tolist()
            for sensor in [slot for slot in slots if intake.is_wanted(slot)]:
                intake.tell(sensor, intake.hold.value(due, *sensor))
            values.append(dynamic_pressure_pa(*(values[place] for place in air)))
            intake.tell(PRESSURE, values[-1])
            for source in intake.sources:
                source.fuse((due - last_ns) * 1e-9 if last_ns >= 0 else 0.0)
            if resting:  # friction holds nothing before the first engine start
                resting = not any(values[speed] > settings.engine_off_n1_pct for speed in speeds)
                for source in intake.sources if resting and len(rows) == RESTS_AFTER else ():
                    source.rest()
            said = [(state["deformation_mm"], state["force_n"]) for state in intake.states]
            rows.append((due * 1e-9, *values, *(number for pair in said for number in pair)))
            last_ns = intake.fused_ns = due
        advance(log.position_bytes / max(log.size_bytes, 1))
    names = [_column(signal, index, installation) for signal, index in slots]
    names += [
        PRESSURE[0],
        *(f"{what}_{mount.name}" for mount in config.mount for what in ("deformation_mm", "model_N")),
    ]
    table = np.array(rows).T if rows else np.empty((1 + len(names), 0))
    columns = {name: column for name, column in zip(("time_s", *names), table, strict=True) if name}
    return make_recording(log.path.name, columns, {"source": "thrustd flight log", "run": log.header.run})


def _column(signal: str, index: int, installation: Installation) -> str:
    """The name that a recording has for it: engine or mount behind the signal; empty for one that is not there."""
    config = installation.config
    owners = {"engine": config.aircraft.engines, "mount": [mount.name for mount in config.mount]}
    of = owners.get(CATALOGUE[signal].scope)
    if of is None:
        return signal
    return f"{signal}_{of[index]}" if index < len(of) else ""
