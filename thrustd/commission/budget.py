"""The uncertainty budget of a test point: every term of the band, systematic and random apart (SAE AIR1678 practice).

    mounts     sigma_F^2 = sum over mounts and terms of sigma_i^2          what the filter is told of the mounts' source
               a term that both mounts have to the same side: (sigma_upper + sigma_lower)^2
    brochure   sigma^2   = (bias T)^2 + noise^2                            of the deck's source, as the filter takes it
    fused      the filter's own sigma; in it what nobody corrected of the installation ([installation] of the aircraft's
               file), as far as the brochure does not bound it

The terms come from the pipeline itself at every fused step of the window: what is printed is what was used. A
systematic term does not average out over the window; a random one is that of one fused step.
"""

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import UsageError
from thrustd.core.types import Estimate
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.mounts.source import COMMON
from thrustd.pipeline.pipeline import Pipeline
from thrustd.sources.log_run import LogRun

SYSTEMATIC, RANDOM = "systematic", "random"
INSTALLED = "installation (zero, scale, drag, rest)"
UNPROVED = "throttle moved, other hypotheses"
INERTIA = "inertia (noise of the acceleration)"


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
    terms: list[list[list[float]]] = field(default_factory=list)  # steps, mounts, terms
    installed: list[list[float]] = field(default_factory=list)  # steps, engines
    first_ns: int = -1
    last_s: float = 0.0

    def take(self, found: list[Estimate], pipeline: Pipeline, begin_s: float, end_s: float) -> None:
        if not found:
            return
        self.first_ns = found[0].t_ns if self.first_ns < 0 else self.first_ns
        self.last_s = (found[0].t_ns - self.first_ns) * 1e-9
        if begin_s <= self.last_s < end_s:
            self.terms.append([list(each.values()) for each in pipeline.terms_n()])
            self.installed.append(pipeline.uncorrected_n())
            for row, said in zip(self.told, found, strict=True):
                row.append((said.thrust_n, said.thrust_std_n, said.mount_std_n, said.brochure_std_n))


def budgets(log: LogRun, installation: Installation, begin_s: float, end_s: float) -> list[Budget]:
    """One per engine; seconds since the log's first estimate. UsageError when nothing was estimated there."""
    pipeline = installation.pipeline()
    config = installation.config
    seen = _Seen([[] for _ in config.aircraft.engines])
    for batch in log.batches():
        known = seen.first_ns >= 0
        if known and (batch.t_ns.item(-1) - seen.first_ns) * 1e-9 < begin_s:
            pipeline.take(batch)  # all at once: nobody asks for its terms
            continue
        for event in batch.events():
            found = [output for output in pipeline.feed(event) if isinstance(output, Estimate)]
            seen.take(found, pipeline, begin_s, end_s)
        if seen.last_s >= end_s:
            break
    if not seen.terms:
        raise UsageError(f"--at {begin_s:g} {end_s:g}: nothing was estimated there, only until {seen.last_s:.0f} s")
    names, table = list(pipeline.terms_n()[0]), np.array(seen.terms)
    settings = section(config.fusion, FusionSettings, "fusion")
    mine = [list(config.mounts_of(engine)) for engine in config.aircraft.engines]
    installed_n = np.sqrt(np.mean(np.square(seen.installed), axis=0)).tolist()
    return [
        _budget(engine, table[:, mine[e]], names, np.array(seen.told[e]), installed_n[e], settings)
        for e, engine in enumerate(config.aircraft.engines)
    ]


def _budget(
    engine: str, table: Floats, names: list[str], told: Floats, installed_n: float, settings: FusionSettings
) -> Budget:
    """`table` (n, mounts, terms); `told` (n, 4): thrust, its sigma, the mounts', the deck's."""
    squares = np.nansum(table**2, axis=1)
    squares[:, names.index(COMMON)] = np.nansum(table[:, :, names.index(COMMON)], axis=1) ** 2
    each = np.sqrt(np.nanmean(squares, axis=0))
    rows = [Row("mounts", name, SYSTEMATIC, float(value)) for name, value in zip(names, each, strict=True) if value > 0]
    mounts_n = sqrt(sum(row.std_n**2 for row in rows))
    rows.append(Row("mounts", INERTIA, RANDOM, settings.mount_noise_std_n))
    mean = np.nanmean(told, axis=0)
    bias_n = min(settings.brochure_bias_std * abs(float(mean[0])), float(mean[3]))
    rows.append(Row("brochure", "engine against deck", SYSTEMATIC, bias_n))
    rows.append(Row("brochure", "deck's shape and fit", SYSTEMATIC, sqrt(float(mean[3]) ** 2 - bias_n**2)))
    rows.append(Row("brochure", "noise of fuel flow and N1", RANDOM, settings.brochure_noise_std_n))
    brochure_n = sqrt(sum(row.std_n**2 for row in rows if row.source == "brochure"))
    both_n = 1 / sqrt(1 / max(mounts_n, 1e-9) ** 2 + 1 / max(brochure_n, 1e-9) ** 2)
    rest_n = sqrt(max(float(mean[1]) ** 2 - both_n**2 - installed_n**2, 0.0))
    rows += [Row("fused", INSTALLED, SYSTEMATIC, installed_n), Row("fused", UNPROVED, SYSTEMATIC, rest_n)]
    return Budget(engine, float(mean[0]), rows, mounts_n, float(mean[2]), brochure_n, float(mean[1]))
