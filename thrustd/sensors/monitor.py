"""Names the sensor that lies: per-sensor checks and cross-checks, before anything is fused.

The pipeline calls it once per fused step, with the latest readings as they came, and leaves out what the verdict
excludes:

    raw = [deck.estimate(inputs_of(readings, e), e) for e in engines]
    verdict = monitor.step(MonitorInputs(readings, ...))
    clean = [deck.estimate(inputs_of(readings without verdict.excluded, e), e) for e in engines]
    mounts = verdict.mounts[e]                       # engine e's mount force without the excluded ones

The everyday part of a look is compiled (`monitor_step`); here is what is done when somebody is in doubt.

Five kinds per sensor: `<kind>` in stuck, noisy, offset, drift, dead; `Fault.where` is the mount's name or
"signal[index]"; not active when it is believed again.
"""

from collections.abc import Sequence
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.types import Fault, Status
from thrustd.sensors.common_mode import guilty
from thrustd.sensors.engine_force import MountCombiner
from thrustd.sensors.monitor_inputs import AIRCRAFT_SIGNALS, ENGINE_SIGNALS, Layout, MonitorInputs, Sensor
from thrustd.sensors.monitor_step import ACCUSE, ACQUIT, DONE, DOUBT, LOOK, look_on
from thrustd.sensors.opinions import AGREE_S, N_OPINIONS, Opinions
from thrustd.sensors.signal_watch import STEP_S
from thrustd.sensors.watches import Watches

WATCH_EVERY_NS = 99_000_000  # 10 Hz on a 50 Hz or 100 Hz grid
MOVED_PCT, MOVED_STEPS = 3.0, 10  # spools that moved this far within a second: the throttle was moved
TOGETHER_MM = 0.05  # both mounts of an engine moved this far in one step: the engine pushed them
RESTING_S = 2.0
AGREE_WITHIN = 0.04
NOBODY: frozenset[Sensor] = frozenset()
MOUNT_SIGNALS = ("deformation_mm", "temperature_degC")
SHARED_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC", "accel_x_g")  # those that move several thrusts at once


class MonitorVerdict(NamedTuple):
    excluded: frozenset[Sensor]
    mounts: Any  # ENGINE_MOUNTS by engine, good until the next step
    faults: Sequence[Fault]  # changes at this step
    status: Sequence[int]  # Status bits by engine (SENSOR_DOUBTED, STUCK, MOUNTS_DISAGREE)


class Monitor:
    """Watches every sensor of the aircraft at 10 Hz. Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout, shares: Sequence[float] = ()) -> None:
        """`shares`: see `MountCombiner`."""
        self._layout = layout
        self._combiner = MountCombiner(layout.mounts_of_engine, shares)
        self._opinions_of: tuple[tuple[Sensor, ...], ...] = tuple(
            (*(("deformation_mm", i) for i in mounts), *((name, engine) for name in ENGINE_SIGNALS))
            for engine, mounts in enumerate(layout.mounts_of_engine)
        )
        self._all_mounts = np.ones(len(layout.mount_names), np.bool_)
        self._watches = Watches(layout)
        self._shared = {name: self._watches[name, 0] for name in SHARED_SIGNALS}
        place = self._watches.sensors.index
        engines = range(len(layout.mounts_of_engine))
        spools = np.array([(place(("n1_pct", engine)), place(("n2_pct", engine))) for engine in engines])
        self._opinions = Opinions(self._combiner.mounts, spools)
        self._memory = np.zeros(1, LOOK)
        self._memory["altitude"], self._memory["sat"] = place(("pressure_altitude_m", 0)), place(("sat_degC", 0))
        self._memory["sat_since_m"] = nan
        watches, opinions = self._watches.work, self._opinions.work
        self._work = self._memory, *watches, *opinions, self._combiner.rows, self._opinions.believed
        self._suspect = False  # some sensor's own watch has a fault or a jump in doubt
        self._no_status = [0 for _ in engines]
        self._kinds: dict[Sensor, str] = {}  # sensor -> the fault that was reported
        self._judged: dict[Sensor, str] = {}  # by cross-checks
        self._calm_s: dict[Sensor, float] = {}
        self._excluded = NOBODY
        self._t_ns = self._watched_ns = -1

    def step(self, inputs: MonitorInputs) -> MonitorVerdict:
        """Call once per fused step; the tests run every 0.1 s, the mounts are combined every time."""
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        faults: Sequence[Fault] = ()
        if self._watched_ns < 0 or inputs.t_ns - self._watched_ns >= WATCH_EVERY_NS:
            self._watched_ns = inputs.t_ns
            self._look(inputs)
            faults = self._changes(inputs.t_ns)
        else:
            self._excluded |= self._leapt(inputs.readings)
        mounts = self._combiner.step(inputs.mounts, self._believed_mounts(), dt_s)
        status = list(map(self._status, range(len(mounts)))) if self._kinds else self._no_status
        return MonitorVerdict(self._excluded, mounts, faults, status)

    @property
    def excluded(self) -> frozenset[Sensor]:
        """The sensors that are not believed now."""
        return self._excluded

    def snapshot(self) -> dict[str, Any]:
        """Everything a warm restart needs, JSON-able."""
        return {
            "t_ns": [self._t_ns, self._watched_ns],
            "combiners": self._combiner.snapshot(),
            "engines": self._opinions.snapshot(),
            "common": self._memory["outside_s"].item(),
            "watches": self._watches.snapshot(),
            "kinds": _rows(self._kinds),
            "judged": _rows(self._judged),
            "excluded": sorted(map(list, self._excluded)),
            "sat_since_m": since_m if isfinite(since_m := self._memory["sat_since_m"].item()) else None,
        }

    def restore(self, state: dict[str, Any], shift_ns: int = 0) -> bool:
        """Take over a snapshot, its times moved by `shift_ns`. False when it is none: throw this monitor away then."""
        try:
            self._t_ns, self._watched_ns = (t_ns + shift_ns for t_ns in map(int, state["t_ns"]))
            self._combiner.restore(state["combiners"])
            restored = self._watches.restore(state["watches"]) and self._opinions.restore(state["engines"])
            self._memory["outside_s"] = float(state["common"])
            self._kinds = {(str(name), int(i)): str(kind) for name, i, kind in state["kinds"]}
            self._judged = {(str(name), int(i)): str(kind) for name, i, kind in state["judged"]}
            self._excluded = frozenset((str(name), int(i)) for name, i in state["excluded"])
            self._memory["sat_since_m"] = nan if state["sat_since_m"] is None else float(state["sat_since_m"])
        except (KeyError, OverflowError, TypeError, ValueError):
            return False
        restored &= set(self._watches.sensors) >= {*self._kinds, *self._judged, *self._excluded}
        self._watches.forget_last_values()
        return restored

    def _believed_mounts(self) -> Flags:
        if not self._excluded:
            return self._all_mounts
        return np.array([("deformation_mm", i) not in self._excluded for i in range(len(self._all_mounts))])

    def _status(self, engine: int) -> int:
        mine = {(name, i) for name in MOUNT_SIGNALS for i in self._layout.mounts_of_engine[engine]}
        mine |= {(name, engine) for name in ENGINE_SIGNALS} | {(name, 0) for name in AIRCRAFT_SIGNALS}
        doubted = {sensor: kind for sensor, kind in self._kinds.items() if sensor in mine}
        status = Status.SENSOR_DOUBTED if doubted else Status(0)
        if "stuck" in doubted.values():
            status |= Status.STUCK
        if any(name == "deformation_mm" for name, _ in doubted):
            status |= Status.MOUNTS_DISAGREE
        return int(status)

    def _look(self, inputs: MonitorInputs) -> None:
        work = *self._work, inputs.readings, inputs.mounts, inputs.routes_n
        self._memory["accused"], self._suspect = bool(self._judged), False
        while (stop := look_on(*work)) != DONE:
            if stop == DOUBT:
                self._doubt()
            elif stop == ACQUIT:
                for name in SHARED_SIGNALS:
                    self._acquit_shared((name, 0))
            elif stop == ACCUSE:
                self._accuse(inputs)
            else:
                self._judge_all(inputs.readings)
        self._excluded = self._all_out()

    def _doubt(self) -> None:
        """Some sensor's own watch has found something, or somebody is judged already."""
        self._suspect = self._memory["suspect"].item()
        if self._suspect:
            self._acquit_jumps()
        self._judge_temperature()
        self._memory["accused"] = bool(self._judged)
        self._memory["frozen"] = any([name in SHARED_SIGNALS for name, _ in self._all_out()])
        if self._suspect:
            for row, sensors in zip(self._opinions.believed, self._opinions_of, strict=True):
                row[: len(sensors)] = [self._watches.trusts(sensor) for sensor in sensors[:N_OPINIONS]]

    def _leapt(self, readings: Floats) -> frozenset[Sensor]:
        """Between two looks: what jumped is out until the next one, before anything follows it.

        An engine that is pushed moves both of its mounts; its own signals are judged at the next look.
        """
        leapt = self._watches.leapt(readings)
        out = {sensor for sensor in leapt if sensor[0] in AIRCRAFT_SIGNALS}
        for mounts in self._layout.mounts_of_engine:
            far = [("deformation_mm", i) for i in mounts if ("deformation_mm", i) in leapt]
            if len(far) == 1 and len(mounts) > 1:
                out.add(far[0])
        return frozenset(out)

    def _all_out(self) -> frozenset[Sensor]:
        if not self._suspect and not self._judged:
            return NOBODY
        return frozenset(sensor for sensor in self._watches.sensors if self._out(sensor))

    def _out(self, sensor: Sensor) -> bool:
        return sensor in self._judged or not self._watches.trusts(sensor)

    def _judge_temperature(self) -> None:
        sensor = ("sat_degC", 0)
        if self._memory["sat_moved"].item():
            if self._judged.get(sensor) == "stuck":
                del self._judged[sensor]
        elif self._memory["sat_climbed"].item() and not self._out(("pressure_altitude_m", 0)):
            self._judged[sensor] = "stuck"

    def _acquit_jumps(self) -> None:
        """A throttle that is cut moves fuel flow, spools and both mounts: what jumps with them did not fail."""
        for engine, mounts in enumerate(self._layout.mounts_of_engine):
            n1, n2 = self._watches["n1_pct", engine], self._watches["n2_pct", engine]
            spools_moved = any(abs(spool.change(MOVED_STEPS)) > MOVED_PCT for spool in (n1, n2) if not spool.doubted)
            last = [self._watches["deformation_mm", i].change(1) for i in mounts]
            together = len(mounts) > 1 and max(last) * min(last) > 0.0 and min(map(abs, last)) > TOGETHER_MM
            for i in mounts:
                if spools_moved or together:
                    self._watches["deformation_mm", i].acquit()
            for name in ENGINE_SIGNALS:
                if self._watches.followed((name, engine)):
                    self._watches[name, engine].acquit()

    def _judge_all(self, readings: Floats) -> None:
        for engine, sensors in enumerate(self._opinions_of):
            if self._opinions.turning(engine, readings):
                self._judge(engine, sensors)

    def _judge(self, engine: int, sensors: Sequence[Sensor]) -> None:
        """What the others say of each sensor of one engine."""
        for i, sensor in enumerate(sensors):
            if self._opinions.faulty(engine, i) and sensor not in self._judged:
                watch = self._watches[sensor]
                resting = "stuck" if watch.resting_s > RESTING_S else "drift"
                self._judged[sensor] = "offset" if watch.jumped_lately else resting
            elif not self._opinions.faulty(engine, i):
                self._judged.pop(sensor, None)

    def _accuse(self, inputs: MonitorInputs) -> None:
        """Every engine's mounts and brochure differ: by the sensor that explains it."""
        thrust_n = sum(inputs.fused_thrust_n) / len(inputs.fused_thrust_n)
        name = guilty(self._opinions.differences, self._shared, thrust_n)
        if name:
            watch = self._shared[name]
            resting = "stuck" if watch.resting_s > RESTING_S else "drift"
            self._judged[name, 0] = "offset" if watch.jumped_lately else resting

    def _acquit_shared(self, sensor: Sensor) -> None:
        """Mounts and brochure agree again with the sensor as it reads now: it is believed again."""
        if self._judged.get(sensor, "") in ("", "stuck"):
            return
        agree = bool((abs(self._opinions.differences[:, 0]) < AGREE_WITHIN).all())
        self._calm_s[sensor] = self._calm_s.get(sensor, 0.0) + STEP_S if agree else 0.0
        if self._calm_s[sensor] > AGREE_S:
            del self._judged[sensor], self._calm_s[sensor]

    def _changes(self, t_ns: int) -> Sequence[Fault]:
        if not (self._suspect or self._judged or self._kinds):
            return ()
        faults: list[Fault] = []
        for sensor in self._watches.sensors:
            kind = self._watches[sensor].kind or self._judged.get(sensor, "")
            before = self._kinds.get(sensor, "")
            # the first name stays until it is over: a dead sensor also rests, a noisy one also jumps
            if kind and not before:
                faults.append(Fault(t_ns, self._where(sensor), kind))
                self._kinds[sensor] = kind
            elif before and not kind:
                faults.append(Fault(t_ns, self._where(sensor), before, active=False))
                del self._kinds[sensor]
        return faults

    def _where(self, sensor: Sensor) -> str:
        name, index = sensor
        return self._layout.mount_names[index] if name == "deformation_mm" else f"{name}[{index}]"


def _rows(words: dict[Sensor, str]) -> list[list[Any]]:
    return [[*sensor, word] for sensor, word in words.items()]
