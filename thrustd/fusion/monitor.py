"""Names the sensor that lies: per-sensor checks and cross-checks, before anything is fused.

The pipeline calls it once per fused step, with the latest readings as they came, and leaves out what the verdict
excludes:

    raw = [deck.estimate(inputs_of(readings, e), e) for e in engines]
    verdict = monitor.step(MonitorInputs(readings, ...))
    clean = [deck.estimate(inputs_of(readings without verdict.excluded, e), e) for e in engines]
    mounts = verdict.mounts[e]                       # engine e's mount force without the excluded ones

Five kinds per sensor: `<kind>` in stuck, noisy, offset, drift, dead; `Fault.where` is the mount's name or
"signal[index]"; "<kind>_over" when it is believed again.
"""

from collections.abc import Sequence
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.fusion.common_mode import CommonMode
from thrustd.fusion.limits import SAT_CLIMB_M
from thrustd.fusion.memory import recall, remember
from thrustd.fusion.monitor_inputs import AIRCRAFT_SIGNALS, ENGINE_SIGNALS, Layout, MonitorInputs, Sensor
from thrustd.fusion.mounts import FORCE_N, MEASURED_MM, SHARE, EngineMounts, MountCombiner
from thrustd.fusion.opinions import AGREE_S, N_OPINIONS, Opinions
from thrustd.fusion.signal_watch import STEP_S
from thrustd.fusion.watches import Watches
from thrustd.types import Fault, Status

WATCH_EVERY_NS = 99_000_000  # 10 Hz on a 50 Hz or 100 Hz grid
MOVED_PCT, MOVED_STEPS = 3.0, 10  # spools that moved this far within a second: the throttle was moved
TOGETHER_MM = 0.05  # both mounts of an engine moved this far in one step: the engine pushed them
RESTING_S = 2.0
AGREE_WITHIN = 0.04
Flags = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
NOBODY: frozenset[Sensor] = frozenset()
MOUNT_SIGNALS = ("deformation_mm", "temperature_degC")
SHARED_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC", "accel_x_g")  # those that move several thrusts at once


class MonitorVerdict(NamedTuple):
    excluded: frozenset[Sensor]
    mounts: list[EngineMounts]  # by engine
    faults: list[Fault]  # changes at this step: "stuck", "stuck_over", ...
    status: list[int]  # Status bits by engine (SENSOR_DOUBTED, STUCK, MOUNTS_DISAGREE)


class Monitor:
    """Watches every sensor of the aircraft at 10 Hz. Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._combiner = MountCombiner(layout.mounts_of_engine)
        self._opinions_of: tuple[tuple[Sensor, ...], ...] = tuple(
            (*(("deformation_mm", i) for i in mounts), *((name, engine) for name in ENGINE_SIGNALS))
            for engine, mounts in enumerate(layout.mounts_of_engine)
        )
        self._all_mounts = np.ones(len(layout.mount_names), np.bool_)
        self._all_opinions = np.ones((len(self._opinions_of), N_OPINIONS), np.bool_)
        self._common = CommonMode()
        self._watches = Watches(layout)
        self._shared = {name: self._watches[name, 0] for name in SHARED_SIGNALS}
        place = self._watches.sensors.index
        engines = range(len(layout.mounts_of_engine))
        spools = np.array([(place(("n1_pct", engine)), place(("n2_pct", engine))) for engine in engines])
        self._opinions = Opinions(self._combiner.mounts, spools)
        self._altitude = place(("pressure_altitude_m", 0))
        self._kinds: dict[Sensor, str] = {}  # sensor -> the fault that was reported
        self._judged: dict[Sensor, str] = {}  # by cross-checks
        self._calm_s: dict[Sensor, float] = {}
        self._excluded = NOBODY
        self._sat_since_m = nan  # altitude where SAT last moved
        self._t_ns = self._watched_ns = -1

    def step(self, inputs: MonitorInputs) -> MonitorVerdict:
        """Call once per fused step; the tests run every 0.1 s, the mounts are combined every time."""
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        faults: list[Fault] = []
        mounts_n = np.array((inputs.mount_force_n, inputs.mount_std_n, inputs.mount_common_n, inputs.mount_std_n))
        mounts_n[MEASURED_MM] = inputs.readings[: len(self._all_mounts)]
        if self._watched_ns < 0 or inputs.t_ns - self._watched_ns >= WATCH_EVERY_NS:
            self._watched_ns = inputs.t_ns
            self._watch(inputs, mounts_n)
            faults = self._changes(inputs.t_ns)
        else:
            self._excluded |= self._leapt(inputs.readings)
        mounts = self._combiner.step(mounts_n, self._believed_mounts(), dt_s)
        return MonitorVerdict(self._excluded, mounts, faults, list(map(self._status, range(len(mounts)))))

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
            "common": remember(self._common),
            "watches": self._watches.snapshot(),
            "kinds": _rows(self._kinds),
            "judged": _rows(self._judged),
            "excluded": sorted(map(list, self._excluded)),
            "sat_since_m": self._sat_since_m if isfinite(self._sat_since_m) else None,
        }

    def restore(self, state: dict[str, Any], shift_ns: int = 0) -> bool:
        """Take over a snapshot, its times moved by `shift_ns`. False when it is none: throw this monitor away then."""
        try:
            self._t_ns, self._watched_ns = (t_ns + shift_ns for t_ns in map(int, state["t_ns"]))
            self._combiner.restore(state["combiners"])
            restored = self._watches.restore(state["watches"]) and recall(self._common, state["common"])
            restored &= self._opinions.restore(state["engines"])
            self._kinds = {(str(name), int(i)): str(kind) for name, i, kind in state["kinds"]}
            self._judged = {(str(name), int(i)): str(kind) for name, i, kind in state["judged"]}
            self._excluded = frozenset((str(name), int(i)) for name, i in state["excluded"])
            self._sat_since_m = nan if state["sat_since_m"] is None else float(state["sat_since_m"])
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
        if not self._kinds:
            return 0
        mine = {(name, i) for name in MOUNT_SIGNALS for i in self._layout.mounts_of_engine[engine]}
        mine |= {(name, engine) for name in ENGINE_SIGNALS} | {(name, 0) for name in AIRCRAFT_SIGNALS}
        doubted = {sensor: kind for sensor, kind in self._kinds.items() if sensor in mine}
        status = Status.SENSOR_DOUBTED if doubted else Status(0)
        if "stuck" in doubted.values():
            status |= Status.STUCK
        if any(name == "deformation_mm" for name, _ in doubted):
            status |= Status.MOUNTS_DISAGREE
        return int(status)

    def _watch(self, inputs: MonitorInputs, mounts_n: Floats) -> None:
        self._watches.step(inputs.readings)
        if self._watches.suspect:
            self._acquit_jumps()
        self._watch_temperature(inputs.readings[self._altitude])
        shared_doubt = any([name in SHARED_SIGNALS for name, _ in self._all_out()])
        self._cross_check(mounts_n[FORCE_N], np.array(inputs.routes_n), shared_doubt)
        self._check_shared(inputs, shared_doubt)
        self._excluded = self._all_out()

    def _leapt(self, readings: Sequence[float]) -> frozenset[Sensor]:
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
        if not self._watches.suspect and not self._judged:
            return NOBODY
        return frozenset(sensor for sensor in self._watches.sensors if self._out(sensor))

    def _out(self, sensor: Sensor) -> bool:
        return sensor in self._judged or not self._watches.trusts(sensor)

    def _watch_temperature(self, altitude_m: float) -> None:
        """SAT holds one value for minutes when level: it is stuck when it does so in a climb."""
        sensor = ("sat_degC", 0)
        watch = self._watches[sensor]
        if watch.resting_s == 0.0 or not isfinite(self._sat_since_m):
            self._sat_since_m = altitude_m
            if self._judged.get(sensor) == "stuck":
                del self._judged[sensor]
        elif abs(altitude_m - self._sat_since_m) > SAT_CLIMB_M and not self._altitude_out():
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

    def _altitude_out(self) -> bool:
        return self._out(("pressure_altitude_m", 0))

    def _cross_check(self, forces_n: Floats, routes_n: Floats, frozen: bool) -> None:
        believed = self._all_opinions
        if self._watches.suspect:
            believed = believed.copy()
            for row, sensors in zip(believed, self._opinions_of, strict=True):
                row[: len(sensors)] = [self._watches.trusts(sensor) for sensor in sensors[:N_OPINIONS]]
        readings, shares = self._watches.values, self._combiner.rows[:, SHARE]
        if not self._opinions.step(readings, forces_n, shares, routes_n, believed, frozen) and not self._judged:
            return
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

    def _check_shared(self, inputs: MonitorInputs, shared_doubt: bool) -> None:
        thrust_n = sum(inputs.fused_thrust_n) / len(inputs.fused_thrust_n)
        if not shared_doubt:
            guilty = self._common.step(self._opinions.group_differences(), self._shared, thrust_n)
            if guilty:
                watch = self._shared[guilty]
                resting = "stuck" if watch.resting_s > RESTING_S else "drift"
                self._judged[guilty, 0] = "offset" if watch.jumped_lately else resting
            return
        for name in SHARED_SIGNALS:
            self._acquit_shared((name, 0))

    def _acquit_shared(self, sensor: Sensor) -> None:
        """Mounts and brochure agree again with the sensor as it reads now: it is believed again."""
        if self._judged.get(sensor, "") in ("", "stuck"):
            return
        agree = all(abs(d) < AGREE_WITHIN for d, _ in self._opinions.group_differences())
        self._calm_s[sensor] = self._calm_s.get(sensor, 0.0) + STEP_S if agree else 0.0
        if self._calm_s[sensor] > AGREE_S:
            del self._judged[sensor], self._calm_s[sensor]

    def _changes(self, t_ns: int) -> list[Fault]:
        faults: list[Fault] = []
        if not (self._watches.suspect or self._judged or self._kinds):
            return faults
        for sensor in self._watches.sensors:
            kind = self._watches[sensor].kind or self._judged.get(sensor, "")
            before = self._kinds.get(sensor, "")
            # the first name stays until it is over: a dead sensor also rests, a noisy one also jumps
            if kind and not before:
                faults.append(Fault(t_ns, self._where(sensor), kind))
                self._kinds[sensor] = kind
            elif before and not kind:
                faults.append(Fault(t_ns, self._where(sensor), f"{before}_over"))
                del self._kinds[sensor]
        return faults

    def _where(self, sensor: Sensor) -> str:
        name, index = sensor
        return self._layout.mount_names[index] if name == "deformation_mm" else f"{name}[{index}]"


def _rows(words: dict[Sensor, str]) -> list[list[Any]]:
    return [[*sensor, word] for sensor, word in words.items()]
