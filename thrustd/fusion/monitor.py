"""Names the sensor that lies: per-sensor checks and cross-checks, before anything is fused.

The pipeline calls it once per fused step, with the latest readings as they came, and leaves out what the verdict
excludes:

    raw = [deck.estimate(inputs_of(e), e) for e in engines]
    verdict = monitor.step(MonitorInputs(...))
    clean = [deck.estimate(inputs_of(e, without=verdict.excluded), e) for e in engines]
    mounts = verdict.mounts[e]                       # engine e's mount force without the excluded ones

Five kinds per sensor: `<kind>` in stuck, noisy, offset, drift, dead; `Fault.where` is the mount's name or
"signal[index]"; "<kind>_over" when it is believed again.
"""

from typing import NamedTuple

from thrustd.fusion.mounts import EngineMounts, MountCombiner
from thrustd.types import Fault

Sensor = tuple[str, int]  # (canonical channel name, engine or mount index)


class Layout(NamedTuple):
    """Which mounts carry which engine."""

    mount_names: tuple[str, ...]  # by mount index
    mounts_of_engine: tuple[tuple[int, ...], ...]  # by engine: upper mount first


class MonitorInputs(NamedTuple):
    """Latest readings; NaN = missing or stale. Tuples are by mount or by engine."""

    t_ns: int
    deformation_mm: tuple[float, ...]  # by mount, as measured
    mount_force_n: tuple[float, ...]  # by mount, after load-factor corrections
    mount_std_n: tuple[float, ...]  # by mount
    n1_pct: tuple[float, ...]
    n2_pct: tuple[float, ...]
    fuel_flow_kg_s: tuple[float, ...]
    fuel_flow_thrust_n: tuple[float, ...]  # DeckEstimate's, from unmasked inputs
    n1_thrust_n: tuple[float, ...]
    fused_thrust_n: tuple[float, ...]  # ThrustFilter.thrust_n before this step
    mach: float
    pressure_altitude_m: float
    sat_degc: float
    accel_x_g: float
    accel_y_g: float
    accel_z_g: float


class MonitorVerdict(NamedTuple):
    excluded: frozenset[Sensor]
    mounts: tuple[EngineMounts, ...]  # by engine
    faults: list[Fault]  # changes at this step: "stuck", "stuck_over", ...
    status: tuple[int, ...]  # Status bits by engine (STUCK, MOUNTS_DISAGREE)


class Monitor:
    """Watches every sensor of the aircraft. Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._combiners = tuple(MountCombiner() for _ in layout.mounts_of_engine)
        self._t_ns = -1

    def step(self, inputs: MonitorInputs) -> MonitorVerdict:
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        mounts = tuple(
            combiner.step(
                tuple(inputs.mount_force_n[i] for i in indices),
                tuple(inputs.mount_std_n[i] for i in indices),
                tuple(True for _ in indices),
                dt_s,
            )
            for combiner, indices in zip(self._combiners, self._layout.mounts_of_engine, strict=True)
        )
        return MonitorVerdict(frozenset(), mounts, [], tuple(0 for _ in mounts))
