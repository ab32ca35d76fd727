"""The uncertainty budget of a test point: every term of the band, systematic and random apart (SAE AIR1678 practice).

    mounts     sigma_F^2 = sum over mounts and terms of sigma_i^2          what the filter is told of the mounts' source
               a term that both mounts have to the same side: (sigma_upper + sigma_lower)^2
               share: of the one mount that is trusted, where the other one is lost; both together need none
    brochure   sigma^2   = (bias T)^2 + noise^2                            of the deck's source, as the filter takes it
    fused      the filter's own sigma; in it what nobody corrected of the installation ([installation] of the aircraft's
               file, or what its calibration left), each term as far as the brochure does not bound all of them

The terms come from the pipeline itself at every fused step of the window: what is printed is what was used. A
systematic term does not average out over the window; a random one is that of one fused step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot, sqrt

import numpy as np

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import UsageError
from thrustd.core.types import Estimate, Output, Reading, Status
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.pipeline.pipeline import Pipeline
from thrustd.sensors.engine_force import SHARE_TERM
from thrustd.sources.log_run import LogRun

SYSTEMATIC, RANDOM = "systematic", "random"
INSTALLED = "installation, "
UNPROVED = "throttle moved, other hypotheses"
INERTIA = "inertia (noise of the acceleration)"
AIR = "mach", "pressure_altitude_m"
WINDMILLS = "windmilling, it burns nothing"
ALWAYS = "creep", SHARE_TERM  # told though they are nothing


@dataclass(frozen=True, slots=True)
class Row:
    """One term of one thrust source, N, one sigma of the engine's thrust."""

    source: str
    term: str
    kind: str
    std_n: float


@dataclass(frozen=True, slots=True)
class Budget:
    """Of one engine in one window."""

    engine: str
    thrust_n: float
    rows: list[Row]
    mounts_n: float  # root of the sum of squares of its systematic terms
    filter_n: float  # what the filter was told of the mounts' source
    brochure_n: float
    fused_n: float  # the filter's own sigma


@dataclass(slots=True)
class _Seen:
    """What was collected in the window."""

    told: list[list[tuple[float, ...]]]  # by engine
    terms: list[list[list[float]]] = field(default_factory=list)  # steps, engines, terms
    installed: list[list[float]] = field(default_factory=list)  # steps, engines
    air: dict[str, float] = field(default_factory=dict)  # as read last
    pressure_pa: list[float] = field(default_factory=list)
    first_ns: int = -1
    last_s: float = 0.0

    def take(self, outputs: Sequence[Output], pipeline: Pipeline, begin_s: float, end_s: float) -> None:
        self.air |= {one.signal: one.value for one in outputs if isinstance(one, Reading)}
        found = [one for one in outputs if isinstance(one, Estimate)]
        if not found:
            return
        self.first_ns = found[0].t_ns if self.first_ns < 0 else self.first_ns
        self.last_s = (found[0].t_ns - self.first_ns) * 1e-9
        if begin_s <= self.last_s < end_s:
            self.terms.append([list(each.values()) for each in pipeline.terms_n()])
            self.installed.append(pipeline.uncorrected_n())
            self.pressure_pa.append(dynamic_pressure_pa(*(self.air.get(name, 0.0) for name in AIR)))
            for row, said in zip(self.told, found, strict=True):
                off = float(bool(said.status & Status.ENGINE_OFF))
                row.append((said.thrust_n, said.thrust_std_n, said.mount_std_n, said.brochure_std_n, off))


def budgets(log: LogRun, installation: Installation, begin_s: float, end_s: float) -> list[Budget]:
    """One per engine; seconds since the log's first estimate. UsageError when nothing was estimated there."""
    pipeline = installation.pipeline()
    config = installation.config
    seen = _Seen([[] for _ in config.aircraft.engines])
    for batch in log.batches():
        known = seen.first_ns >= 0
        if known and (batch.t_ns.item(-1) - seen.first_ns) * 1e-9 < begin_s:
            pipeline.take(batch)  # all at once: nobody asks for its terms
            seen.last_s = (batch.t_ns.item(-1) - seen.first_ns) * 1e-9
            continue
        for event in batch.events():
            seen.take(pipeline.feed(event), pipeline, begin_s, end_s)
        if seen.last_s >= end_s:
            break
    if not seen.terms:
        raise UsageError(f"--at {begin_s:g} {end_s:g}: nothing was estimated there, only until {seen.last_s:.0f} s")
    names, table = list(pipeline.terms_n()[0]), np.array(seen.terms)
    settings = section(config.fusion, FusionSettings, "fusion")
    installed_n = np.sqrt(np.mean(np.square(seen.installed), axis=0)).tolist()
    pressure_pa = float(np.mean(np.nan_to_num(seen.pressure_pa)))
    found = []
    for e, engine in enumerate(config.aircraft.engines):
        told = np.array(seen.told[e])
        each = np.sqrt(_means(table[:, e] ** 2)).tolist()
        mounts = [
            Row("mounts", name, SYSTEMATIC, n) for name, n in zip(names, each, strict=True) if n > 0 or name in ALWAYS
        ]
        terms = installation.aircraft().installation.terms_n(_means(told)[0], pressure_pa)
        found.append(_budget(engine, mounts, told, _scaled(terms, installed_n[e]), settings))
    return found


def _scaled(terms: dict[str, float], together_n: float) -> list[Row]:
    """As far as they are not bounded."""
    whole_n = hypot(*terms.values())
    return [
        Row("fused", INSTALLED + name, SYSTEMATIC, n * together_n / whole_n if whole_n else 0.0)
        for name, n in terms.items()
    ]


def _budget(engine: str, mounts: list[Row], told: Floats, installed: list[Row], settings: FusionSettings) -> Budget:
    """`told` (n, 5): thrust, its sigma, the mounts', the brochure's; 1 while the engine is off."""
    thrust_n, fused_n, filter_n, brochure_std_n, off = _means(told)
    rows, mounts_n = list(mounts), hypot(*(row.std_n for row in mounts))
    rows.append(Row("mounts", INERTIA, RANDOM, settings.mount_noise_std_n))
    bias_n = min(settings.brochure_bias_std * abs(thrust_n), brochure_std_n)
    if off == 1.0:
        rows.append(Row("brochure", WINDMILLS, SYSTEMATIC, brochure_std_n))
    else:
        rows.append(Row("brochure", "engine against deck", SYSTEMATIC, bias_n))
        rows.append(Row("brochure", "deck's shape and fit", SYSTEMATIC, sqrt(brochure_std_n**2 - bias_n**2)))
        rows.append(Row("brochure", "noise of fuel flow and N1", RANDOM, settings.brochure_noise_std_n))
    brochure_n = hypot(*(row.std_n for row in rows if row.source == "brochure"))
    parts = [n for n in (mounts_n, brochure_n) if n > 0.0]
    both_n = brochure_n if off == 1.0 or not parts else sum(n**-2 for n in parts) ** -0.5
    rest_n = sqrt(max(fused_n**2 - both_n**2 - sum(row.std_n**2 for row in installed), 0.0))
    rows += [*installed, Row("fused", UNPROVED, SYSTEMATIC, rest_n)]
    return Budget(engine, thrust_n, rows, mounts_n, filter_n, brochure_n, fused_n)


def _means(told: Floats) -> list[float]:
    """Of each column what is known; 0 of one that nobody knows."""
    known = np.isfinite(told)
    return (np.where(known, told, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)).tolist()
