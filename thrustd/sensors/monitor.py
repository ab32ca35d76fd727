"""Names the sensor that lies: per-sensor checks and cross-checks, before anything is fused.

The pipeline calls it once per fused step, with the latest readings as they came, and leaves out what the verdict
excludes:

    verdict = monitor.step(MonitorInputs(readings, ...))
    mounts = verdict.mounts[e]                       # engine e's mount force without the excluded ones

Every sensor is watched by itself (`watches`); then what all sensors of an engine say is weighed under each hypothesis
of who is at fault (`bank`).

Five kinds per sensor: `<kind>` in stuck, noisy, offset, drift, dead; `Fault.where` is the mount's name or
"signal[index]"; not active when it is trusted again.
"""

from collections.abc import Sequence
from math import hypot, inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.aircraft import AircraftData
from thrustd.core.columns import Flags
from thrustd.core.types import Fault, Status
from thrustd.sensors.bank import SOURCES_OFF, UNCORRECTED_N, Bank
from thrustd.sensors.engine_force import MountCombiner
from thrustd.sensors.kinematics import ACCELERATION, LEAVES, MACH, Accelerometer
from thrustd.sensors.limits import SAT_CLIMB_M
from thrustd.sensors.monitor_inputs import AIRCRAFT_SIGNALS, ENGINE_SIGNALS, Layout, MonitorInputs, Sensor
from thrustd.sensors.onsets import ACCELERATION_OFF, AIR_OFF, BROCHURE_OFF, BUT_SPOOLS_OFF, MOUNTS_OFF, SCALE_OFF
from thrustd.sensors.past import FUEL_FLOW, N_SOURCES
from thrustd.sensors.suspects import Suspects
from thrustd.sensors.watches import Watches

WATCH_EVERY_NS = 99_000_000  # 10 Hz on a 50 Hz or 100 Hz grid
NOBODY: frozenset[Sensor] = frozenset()
MOUNT_SIGNALS = ("deformation_mm", "temperature_degC")
AIR: tuple[Sensor, ...] = (("mach", 0), ("pressure_altitude_m", 0), ("sat_degC", 0))
WHOLE_OFF = {  # faults of a whole thrust source
    MOUNTS_OFF: "mount", SCALE_OFF: "mount", BUT_SPOOLS_OFF: "mount", BROCHURE_OFF: "brochure", AIR_OFF: "brochure",
}  # fmt: skip


class MonitorVerdict(NamedTuple):
    excluded: frozenset[Sensor]
    mounts: Any  # ENGINE_MOUNTS by engine, good until the next step
    faults: Sequence[Fault]  # changes at this step: "stuck", "drift", ..., begun or over
    status: Sequence[int]  # Status bits by engine (SENSOR_EXCLUDED, STUCK, MOUNTS_DISAGREE, ...)
    changed: int  # the engine of which another hypothesis leads from this step on; -1: none
    again: Sequence[int]  # mounts whose transducer says something from this step on, and did not


class Monitor:
    """Watches every sensor of the aircraft at 10 Hz. Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout, aircraft: AircraftData, shares: Sequence[float] = ()) -> None:
        """`shares`: see `MountCombiner`."""
        self._layout = layout
        one_sided = aircraft.installed().share, aircraft.couple_n_g()
        self.combiner = MountCombiner(layout.places, aircraft.spring_n_mm, shares, *one_sided)
        self._sources = layout.sources()
        self._mine = [  # whatever matters to an engine
            {(name, i) for name in MOUNT_SIGNALS for i in mounts}
            | {(name, engine) for name in ENGINE_SIGNALS}
            | {(name, 0) for name in AIRCRAFT_SIGNALS}
            for engine, mounts in enumerate(layout.mounts_of_engine)
        ]
        self._all_mounts = np.ones(len(layout.mount_names), np.bool_)
        self._watches = Watches(layout, aircraft.limits)
        place = self._watches.sensors.index
        engines = range(len(layout.mounts_of_engine))
        spools = np.array([(place(("n1_pct", engine)), place(("n2_pct", engine))) for engine in engines])
        leaves = np.array([place(sensor) for sensor in LEAVES])
        self._accelerometer = Accelerometer(place, aircraft.engine_mass_kg)
        self.bank = Bank(self.combiner, spools, leaves, aircraft, self._accelerometer.bias)
        self._trusted = np.ones((len(engines), N_SOURCES + 1), np.bool_)  # the accelerometer last
        self._altitude, self._load = place(("pressure_altitude_m", 0)), place(("accel_z_g", 0))
        self._sat = self._watches["sat_degC", 0]
        self._sat_since_m = nan  # where SAT last moved
        self._suspect = self._sat_stuck = False  # some sensor's own watch has a fault or a jump in doubt; SAT
        self._mute: dict[Sensor, float] = {}  # who says nothing, and for how long, s
        self._untold = False  # what a process before this one reported
        self._statuses, self._uncorrected_n = [0 for _ in engines], [0.0 for _ in engines]  # as of the last look
        self._kinds: dict[Sensor, str] = {}  # sensor -> the fault that was reported
        self._failed = [""] * len(layout.mounts_of_engine)  # faults of thrust sources that were reported
        self._suspects = Suspects(self.bank.found)
        self._excluded, self._judged, self._t_ns, self._watched_ns = NOBODY, list[Sensor](), -1, -1

    def step(self, inputs: MonitorInputs) -> MonitorVerdict:
        """Call once per fused step; the tests run every 0.1 s, the mounts are combined every time."""
        dt_s, self._t_ns = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0), inputs.t_ns
        faults, changed, mute = list[Fault](), -1, self._mute
        self.bank.follow(inputs.mounts, dt_s, inputs.readings)
        if self._watched_ns < 0 or inputs.t_ns - self._watched_ns >= WATCH_EVERY_NS:
            looked_s = 0.0 if self._watched_ns < 0 else (inputs.t_ns - self._watched_ns) * 1e-9
            self._watched_ns = inputs.t_ns
            changed = self._look(inputs, looked_s)
            faults = self._changes(inputs.t_ns)
            self._statuses = list(map(self._status, range(len(self._sources))))
        else:
            self._excluded |= self._watches.leapt_alone(inputs.readings)
        mounts = self.combiner.step(inputs.mounts, self._trusted_mounts(), dt_s, inputs.readings.item(self._load))
        again = [i for name, i in mute if name == "deformation_mm" and (name, i) not in self._mute]
        return MonitorVerdict(self._excluded, mounts, faults, self._statuses, changed, again)

    @property
    def excluded(self) -> frozenset[Sensor]:
        """The sensors that are excluded now."""
        return self._excluded

    def uncorrected_n(self, engine: int) -> float:
        """What the engine's thrust may be wrong by beside its hypotheses, one sigma: installation and accelerometer."""
        return self._uncorrected_n[engine]

    def snapshot(self) -> dict[str, Any]:
        """Everything a warm restart needs, JSON-able."""
        return {
            "t_ns": [self._t_ns, self._watched_ns],
            "combiners": self.combiner.snapshot(),
            "bank": self.bank.snapshot(),
            "watches": self._watches.snapshot(),
            "kinds": [[*sensor, kind] for sensor, kind in self._kinds.items()],
            "failed": self._failed,
            "excluded": sorted(map(list, self._excluded)),
            "balance": self._accelerometer.snapshot(),
            "sat": [self._sat_since_m if isfinite(self._sat_since_m) else None, self._sat_stuck],
        }

    def restore(self, state: dict[str, Any], shift_ns: int = 0) -> bool:
        """Take over a snapshot, its times moved by `shift_ns`. False when it is none: throw this monitor away then."""
        try:
            self._t_ns, self._watched_ns = (t_ns + shift_ns for t_ns in map(int, state["t_ns"]))
            self.combiner.restore(state["combiners"])
            restored = self._watches.restore(state["watches"]) and self.bank.restore(state["bank"], shift_ns)
            self._kinds = {(str(name), int(i)): str(kind) for name, i, kind in state["kinds"]}
            self._failed = [str(kind) for kind in state["failed"]]
            self._excluded = frozenset((str(name), int(i)) for name, i in state["excluded"])
            self._accelerometer.restore(state["balance"])
            since_m, self._sat_stuck = state["sat"][0], bool(state["sat"][1])
            self._sat_since_m = nan if since_m is None else float(since_m)
        except (KeyError, IndexError, OverflowError, TypeError, ValueError):
            return False
        restored &= set(self._watches.sensors) >= {*self._kinds, *self._excluded}
        restored &= len(self._failed) == len(self._sources) and set(self._failed) <= {"", *WHOLE_OFF.values()}
        self._watches.forget_last_values()
        self._mute = self._watches.mute()
        self._suspects, self._untold = Suspects(self.bank.found), True
        self._judged = self._judge()
        self._say_uncorrected()
        self._statuses = list(map(self._status, range(len(self._sources))))
        return restored

    def _trusted_mounts(self) -> Flags:
        if not self._excluded:
            return self._all_mounts
        return np.array([("deformation_mm", i) not in self._excluded for i in range(len(self._all_mounts))])

    def _status(self, engine: int) -> int:
        mine = self._mine[engine]
        doubted = dict.fromkeys(mine.intersection(self._judged), "") if self._judged else {}
        doubted |= {sensor: kind for sensor, kind in self._kinds.items() if sensor in mine}
        status = int(Status.SENSOR_EXCLUDED) if doubted else 0
        if "stuck" in doubted.values():
            status |= Status.STUCK
        if any(name == "deformation_mm" for name, _ in doubted):
            status |= Status.MOUNTS_DISAGREE
        if self.bank.disagree(engine):
            status |= Status.DISAGREE
        found = self.bank.found.item(engine)
        if found in (MOUNTS_OFF, SCALE_OFF, BUT_SPOOLS_OFF, ACCELERATION_OFF):
            status |= Status.MOUNT_FAILED
        elif found in WHOLE_OFF:
            status |= Status.BROCHURE_FAILED
        return int(status)

    def _look(self, inputs: MonitorInputs, dt_s: float) -> int:
        """-> the engine of which another hypothesis leads now, or -1."""
        self._suspect, was_mute = self._watches.step(inputs.readings), self._mute
        self._mute = self._watches.mute() if self._suspect else {}
        if self._suspect:
            self._watches.acquit_jumps()
        self._judge_temperature(inputs.readings.item(self._altitude))
        before, trusts = self._accelerometer.blamed, self._watches.trusts if self._suspect else None
        self._accelerometer.look(inputs.readings, trusts, dt_s, self.bank.apart_n)
        self._trusted[:] = True
        if self._suspect or was_mute:
            for row, sensors in zip(self._trusted, self._sources, strict=True):
                row[:N_SOURCES] = [  # one that says something again: when its mount has begun anew
                    each is not None and self._watches.trusts(each) and each not in was_mute for each in sensors
                ]
            along = self._watches.trusts(ACCELERATION)
            self._trusted[:, :FUEL_FLOW] &= along
            self._trusted[:, N_SOURCES] = along  # its drag is that of the air data
            self._trusted[:, FUEL_FLOW:] &= all([self._watches.trusts(sensor) for sensor in AIR])
            for sensor, mute_s in self._mute.items():
                self._disbelieve(sensor, inputs.t_ns * 1e-9 - mute_s)
        if self._accelerometer.blamed == MACH:
            self._trusted[:, FUEL_FLOW:] = False
            if before != MACH:  # nobody knows since when
                self._disbelieve(MACH, -inf)
        changed = self.bank.look(inputs.t_ns, inputs.readings, inputs.mounts, inputs.deck_n, self._trusted)
        self._suspects.look(inputs.t_ns, self.bank.found, self.bank.rows)
        self._judged = self._judge()
        self._excluded = self._all_out()
        self._say_uncorrected()
        return changed

    def _disbelieve(self, sensor: Sensor, since_s: float) -> None:
        """What all sources that it speaks for have said since then."""
        shared = {ACCELERATION: range(FUEL_FLOW), **dict.fromkeys(AIR, range(FUEL_FLOW, N_SOURCES))}
        for engine, sensors in enumerate(self._sources):
            mine = [i for i, other in enumerate(sensors) if other == sensor]
            self.bank.disbelieve(engine, shared.get(sensor, mine), since_s)

    def _say_uncorrected(self) -> None:
        error_n = self._accelerometer.error_n
        self._uncorrected_n = [hypot(each, error_n) for each in self.bank.leading[:, UNCORRECTED_N].tolist()]

    def _all_out(self) -> frozenset[Sensor]:
        out = set(self._judged)
        if self._suspect:
            out |= {sensor for sensor in self._watches.sensors if not self._watches.trusts(sensor)}
        return frozenset(out) if out else NOBODY

    def _judge(self) -> list[Sensor]:
        """Who is at fault by the bank and by what the aircraft does."""
        blamed = self._accelerometer.blamed
        if not (self._sat_stuck or blamed or any(self.bank.found.tolist())):
            return []  # all is well
        judged: list[Sensor] = [("sat_degC", 0)] if self._sat_stuck else []
        for engine, found in enumerate(self.bank.found.tolist()):
            if found not in (BROCHURE_OFF, AIR_OFF):  # its sensors are well: it is the engine or the air data
                judged += self._sensors_off(engine, found)
        if blamed is None and self.bank.accelerometer():
            blamed = ACCELERATION
        return judged if blamed is None else [*judged, blamed]

    def _sensors_off(self, engine: int, found: int) -> list[Sensor]:
        """Of this hypothesis, those that there are."""
        return [sensor for i in SOURCES_OFF[found] if (sensor := self._sources[engine][i]) is not None]

    def _judge_temperature(self, altitude_m: float) -> None:
        """SAT holds one value for minutes when level: it is stuck when it does so in a climb."""
        if self._sat.resting_s == 0.0 or not isfinite(self._sat_since_m):
            self._sat_since_m, self._sat_stuck = altitude_m, False
        elif abs(altitude_m - self._sat_since_m) > SAT_CLIMB_M and self._watches.trusts(("pressure_altitude_m", 0)):
            self._sat_stuck = True

    def _changes(self, t_ns: int) -> list[Fault]:
        faults, judged = self._whole_changes(t_ns), self._judged
        if not (self._suspect or judged or self._kinds):
            return faults
        nameable = set(judged) & {self._accelerometer.blamed, ("sat_degC", 0)}
        for engine, found in enumerate(self._suspects.nameable(t_ns, self.bank.found)):
            if found == ACCELERATION_OFF:
                nameable |= {ACCELERATION} & set(judged)
            else:
                nameable |= set(self._sensors_off(engine, found)) & set(judged)
            if found in WHOLE_OFF:  # two transducers at once are their mounts
                nameable -= {("deformation_mm", i) for i in self._layout.mounts_of_engine[engine]}
        for sensor in self._watches.sensors:
            kind, before = self._watches[sensor].kind, self._kinds.get(sensor, "")
            if not kind and (sensor in nameable or (before and sensor in judged)):
                kind = self._watches.kind_of_others(sensor)
            # the first name stays until it is over: a dead sensor also rests, a noisy one also jumps
            if kind and not before:
                faults.append(Fault(t_ns, self._where(sensor), kind))
                self._kinds[sensor] = kind
            elif before and not kind:
                faults.append(Fault(t_ns, self._where(sensor), before, active=False))
                del self._kinds[sensor]
        return faults

    def _whole_changes(self, t_ns: int) -> list[Fault]:
        faults, self._untold = self._standing(t_ns) if self._untold else [], False
        for engine, found in enumerate(self._suspects.nameable(t_ns, self.bank.found)):
            transducers = found == ACCELERATION_OFF and ACCELERATION not in self._judged
            whole, before = "mount" if transducers else WHOLE_OFF.get(found, ""), self._failed[engine]
            if whole == before:
                continue
            shared = ACCELERATION in self._judged or not self._watches.trusts(ACCELERATION)
            if found == MOUNTS_OFF and shared and not before:
                continue  # it is the acceleration, which all mounts share
            name = self._layout.engine_names[engine]
            if before:
                faults.append(Fault(t_ns, f"{before}[{name}]", "failed", active=False))
            if whole:
                faults.append(Fault(t_ns, f"{whole}[{name}]", "failed"))
            self._failed[engine] = whole
        return faults

    def _standing(self, t_ns: int) -> list[Fault]:
        """What was reported and goes on."""
        failed = zip(self._failed, self._layout.engine_names, strict=True)
        wholes = [Fault(t_ns, f"{whole}[{name}]", "failed") for whole, name in failed if whole]
        return [*wholes, *(Fault(t_ns, self._where(sensor), kind) for sensor, kind in self._kinds.items())]

    def _where(self, sensor: Sensor) -> str:
        name, index = sensor
        return self._layout.mount_names[index] if name == "deformation_mm" else f"{name}[{index}]"
