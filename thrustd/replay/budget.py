"""The uncertainty budget of a test point: every term of the band, systematic and random apart (SAE AIR1678 practice).

    mounts     sigma_F^2 = sum over mounts and terms of sigma_i^2          what the filter is told of the mounts' source
               a term that both mounts have to the same side: (sigma_upper + sigma_lower)^2
               share: of the one mount that is trusted, where the other one is lost; both together need none
    brochure   sigma^2   = (bias T)^2 + fuel^2 + shape^2 + noise^2         of the deck's source, as the filter takes it
               fuel: density and heating value on board, by dF / d ln w of the deck
               a source that was not used in the window has no terms
    fused      the filter's own sigma; in it what nobody corrected of the installation ([installation] of the aircraft's
               file, or what its calibration left), each term as far as the brochure does not bound all of them

The terms come from the pipeline itself, once a second (`core.types.Terms`, in every log): what is printed is what was
used. A systematic term does not average out over the window; a random one is that of one fused step.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.core.aircraft import AircraftData
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.config import section
from thrustd.core.errors import UsageError
from thrustd.core.types import Estimate, Reading, Status, Terms
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.sources.log_run import LogRun

SYSTEMATIC, RANDOM = "systematic", "random"
TERMS = {  # of `core.types.Terms`, in words
    "calibration_n": "calibration (model on held-out data)",
    "zero_n": "zero",
    "stiffness_n": "stiffness",
    "friction_n": "friction",
    "beyond_n": "beyond the identified range",
    "start_n": "start, unmeasured channels",
    "share_n": "share",
    "installation_n": "installation",
    "fuel_n": "fuel: density, heating value",
}
INSTALLATION, FUEL = "installation_n", "fuel_n"
INSTALLED, CHANGED = "installation, ", "changed since, or sources that differ"
UNPROVED = "throttle moved, other hypotheses"
INERTIA = "inertia (noise of the acceleration)"
AIR, LOAD, ALONG = ("mach", "pressure_altitude_m"), "accel_z_g", "accel_x_g"
WINDMILLS = "windmilling, it burns nothing"
END_S = 2.0  # a window may end so long after the last estimate
ALWAYS = "share_n"  # told though it is nothing


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

    def of(self, source: str) -> list[Row]:
        """Its terms, the largest first."""
        return sorted((row for row in self.rows if row.source == source), key=lambda row: -row.std_n)

    @property
    def sums(self) -> dict[str, float]:
        """By source, all of it together."""
        return {"mounts": self.mounts_n, "brochure": self.brochure_n, "fused": self.fused_n}


class Band(NamedTuple):
    """What a flight's installation says of its band."""

    settings: FusionSettings
    aircraft: AircraftData


class Told(NamedTuple):
    """Of one engine at some fused steps: what estimate and `Terms` said, each (n,)."""

    thrust_n: Floats
    thrust_std_n: Floats
    mount_std_n: Floats
    brochure_std_n: Floats
    off: Floats  # 1 while the engine is off
    pressure_pa: Floats  # dynamic
    more_g: Floats  # load factor beyond 1
    along_g: Floats  # specific force along the engine
    terms_n: Floats  # (n, len(TERMS))


def band_of(installation: Installation) -> Band:
    settings = section(installation.config.fusion, FusionSettings, "fusion")
    return Band(settings, installation.aircraft())


def budgets(log: LogRun, installation: Installation, begin_s: float, end_s: float) -> list[Budget]:
    """One per engine; seconds since the log's first estimate. UsageError when it has not all of them."""
    pipeline, engines = installation.pipeline(), installation.config.aircraft.engines
    told: list[list[tuple[float, ...]]] = [[] for _ in engines]
    said, air, first_ns, last_s = dict[int, Estimate](), {**dict.fromkeys((*AIR, ALONG), 0.0), LOAD: 1.0}, -1, 0.0
    for batch in log.batches():
        for output in pipeline.take(batch):
            if isinstance(output, Reading):
                air[output.signal] = output.value
            elif isinstance(output, Estimate):
                said[output.engine] = output
                first_ns = output.t_ns if first_ns < 0 else first_ns
                last_s = (output.t_ns - first_ns) * 1e-9
            elif isinstance(output, Terms) and begin_s <= last_s < end_s:
                now = said[output.engine]
                stds = now.thrust_n, now.thrust_std_n, now.mount_std_n, now.brochure_std_n
                off = float(bool(now.status & Status.ENGINE_OFF))
                pressure_pa = dynamic_pressure_pa(*(air[name] for name in AIR))
                loads = air[LOAD] - 1.0, air[ALONG]
                told[output.engine].append((*stds, off, pressure_pa, *loads, *output[2:]))
        if last_s >= end_s:
            break
    if not told[0] or last_s < end_s - END_S:
        what = "nothing was estimated there" if not told[0] else "not all of it was estimated"
        raise UsageError(f"--at {begin_s:g} {end_s:g}: {what}, only until {last_s:.0f} s")
    tables, band = map(np.array, told), band_of(installation)
    return [
        budget_of(engine, Told._make((*table[:, :8].T, table[:, 8:])), band)
        for engine, table in zip(engines, tables, strict=True)
    ]


def budget_of(engine: str, told: Told, band: Band) -> Budget:
    """Root mean squares of terms and sigmas; of everything else the mean."""
    thrust_n, off, pressure_pa = _means(np.column_stack((told.thrust_n, told.off, told.pressure_pa)))
    sigmas = told.thrust_std_n, told.mount_std_n, told.brochure_std_n, told.more_g, told.along_g
    *stds, more_g, along_g = np.sqrt(_means(np.column_stack(sigmas) ** 2)).tolist()
    known = dict(zip(TERMS, np.sqrt(_means(told.terms_n**2)).tolist(), strict=True))
    installed_n, fuel_n = known.pop(INSTALLATION), known.pop(FUEL)
    rows = [Row("mounts", TERMS[name], SYSTEMATIC, n) for name, n in known.items() if n > 0 or name == ALWAYS]
    terms = band.aircraft.terms_n(thrust_n, pressure_pa, more_g, along_g)
    return _budget(engine, rows, (thrust_n, *stds, off), fuel_n, _scaled(terms, installed_n), band.settings)


def _scaled(terms: dict[str, float], together_n: float) -> list[Row]:
    """As far as they are not bounded, and what is more than all of them."""
    whole_n = hypot(*terms.values())
    share = min(together_n / whole_n, 1.0) if whole_n else 0.0
    more_n = sqrt(max(together_n**2 - whole_n**2, 0.0))
    rows = {name: share * n for name, n in terms.items()} | ({CHANGED: more_n} if more_n else {})
    return [Row("fused", INSTALLED + name, SYSTEMATIC, n) for name, n in rows.items()]


def _budget(
    engine: str, mounts: list[Row], stds: Sequence[float], fuel_n: float, installed: list[Row], settings: FusionSettings
) -> Budget:
    """`stds`: thrust, its sigma, the mounts', the brochure's; 1 while the engine is off."""
    thrust_n, fused_n, filter_n, brochure_std_n, off = stds
    rows: list[Row] = []
    if filter_n > 0.0:  # else no mount was trusted
        rows += [*mounts, Row("mounts", INERTIA, RANDOM, settings.mount_noise_std_n)]
    mounts_n = hypot(*(row.std_n for row in rows if row.kind == SYSTEMATIC))
    bias_n = min(settings.brochure_bias_std * abs(thrust_n), brochure_std_n)
    if off == 1.0:
        rows.append(Row("brochure", WINDMILLS, SYSTEMATIC, brochure_std_n))
    elif brochure_std_n > 0.0:  # else nobody asked the deck
        rows.append(Row("brochure", "engine against deck", SYSTEMATIC, bias_n))
        fuel_n = min(fuel_n, sqrt(brochure_std_n**2 - bias_n**2))
        shape_n = sqrt(max(brochure_std_n**2 - bias_n**2 - fuel_n**2, 0.0))
        rows.append(Row("brochure", TERMS[FUEL], SYSTEMATIC, fuel_n))
        rows.append(Row("brochure", "deck's shape and fit", SYSTEMATIC, shape_n))
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
