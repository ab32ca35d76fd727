"""A tethered run as its regression sees it: what every mount's model says by row, and which rows count.

An engine that is off carries nothing. Its mounts count from when they have carried half of their largest force: what an
earlier load left in the friction is gone by then (a stop forgets after twice its own travel).
"""

from dataclasses import dataclass
from math import hypot

import numpy as np
from scipy.ndimage import uniform_filter1d

from thrustd.commission.tether_models import Rubbing, beyond_n, grown_n, rubbing
from thrustd.core.calibration import Calibration, bowed
from thrustd.core.columns import Flags, Floats
from thrustd.core.config import section
from thrustd.core.errors import RecordingError
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.model.region_error import cells
from thrustd.mounts.start import at_rest, chords
from thrustd.records.recording import Recording

LEAST_RANGE_N = 1000.0
FIRST_S = 60.0  # whose median temperature is that of the zeros
MOVED = 0.5  # of the largest force
NAMES = "gain", "own", "zero", "growth", "bow", "friction", "beyond", "cell", "clock"  # of the numbers, in this order
KNOTS = 5  # of a curve's error over the load
SLIPS_N = 1e-9  # less is no friction
RUNDOWN_S = 20.0  # after shutdown: a turning engine pulls


@dataclass(frozen=True, slots=True)
class Run:
    """By row and mount; `mounts` and `engines` as in the configuration."""

    mounts: list[str]
    engines: list[str]
    engine_of: list[int]
    force_n: Floats  # (n, mounts)
    slope_n_mm: Floats  # (n, mounts)
    runs: Flags  # (n, mounts) with its engine
    stopped: Flags  # (n, mounts) its engine, after it has run
    counts: Flags  # (n,) no mount holds what was before
    model_std_n: list[float]  # by mount, without a load: error and friction
    curve_std_n: list[float]  # by mount: error of its model at slow loads
    grown_n: Floats  # (n, mounts) what its model makes of a transducer that grows by 1 mm per kelvin of its mount
    part: Floats  # (n, mounts) of its range that its transducer reads
    rubbing: list[Rubbing]  # by mount
    beyond_n: Floats  # (n, mounts) of a curve as much steeper again beyond its bench; 0 where the mount rests on it
    begins_mm: list[float]  # reading of every mount where its bench begins
    reference_degc: list[float]
    range_mm: list[float]
    straight: list[bool]  # by engine: gauge blocks have measured a curve
    line_stds: list[tuple[float, float]]  # by mount: scale, bow in mm of its transducer, one sigma
    rate_hz: float

    def asks_slope(self, mount: int) -> bool:
        """Whether it rests beyond its bench, on a curve whose slope nobody has measured there."""
        return bool(np.nanmax(np.abs(self.beyond_n[:, mount])) > 0.0)

    def by_engine(self, columns: Floats) -> Floats:
        """Sums (n, engines) over an engine's mounts."""
        sides = [np.array(self.engine_of) == e for e in range(len(self.engines))]
        return np.column_stack([columns[:, side].sum(axis=1) for side in sides])


def columns(run: Run, rows: Flags) -> dict[str, Floats]:
    """By NAMES up to `beyond`, (n, engines) or (n, mounts), of the mounts that carry in `rows`."""
    force_n, slope = run.force_n * rows, -run.slope_n_mm * rows
    grown, bent = run.by_engine(-run.grown_n * rows), run.by_engine(slope * bowed(run.part))
    rubs_n = np.column_stack([one.friction_n for one in run.rubbing])
    known = run.by_engine(force_n), force_n, slope, grown, bent, run.by_engine(rubs_n * rows)
    return dict(zip(NAMES, (*known, run.beyond_n * rows), strict=False))


def curve_errors_n(run: Run) -> Floats:
    """What the curves of the models may err by, one sigma of each column (n, k), where a slope beyond a bench is asked.

    A slope bends the pull over the load by some 50 N; so does the error of a model, another one at every load.
    """
    asked = {e for i, e in enumerate(run.engine_of) if run.asks_slope(i)}
    found = [np.zeros((len(run.runs), 0))]
    for i in (i for i, e in enumerate(run.engine_of) if e in asked):
        load_n = np.nan_to_num(run.force_n[:, i])
        knots_n = np.linspace(0.0, load_n.max(), KNOTS)
        hats = [np.interp(load_n, knots_n, one) for one in np.eye(KNOTS)[1:]]  # at rest `model_std_n` holds it
        found.append(run.curve_std_n[i] * np.column_stack(hats) * run.runs[:, [i]])
    return np.hstack(found)


def friction_errors_n(run: Run) -> Floats:
    """What one factor for the friction of an engine does not say, one sigma of each column (n, k).

    Every element of it may differ by as much of itself; all of a mount's together by what is known of its friction.
    """
    found = []
    for e in range(len(run.engines)):
        mine = [i for i, engine in enumerate(run.engine_of) if engine == e]
        alone_n = np.hstack([run.rubbing[i].elements_n * run.runs[:, [i]] for i in mine])
        shares = np.concatenate([run.rubbing[i].slips_n for i in mine])
        differ = [np.full(len(one.slips_n), one.std) for one in (run.rubbing[i] for i in mine)]
        common_n = alone_n.sum(axis=1, keepdims=True) * shares / max(shares.sum(), SLIPS_N)
        found.append((alone_n - common_n) * np.concatenate(differ))
    return np.hstack(found)


def places(run: Run) -> dict[str, int]:
    """Where the numbers of every name begin."""
    n_e, n_m = len(run.engines), len(run.mounts)
    ends = np.cumsum([n_e, n_m, n_m, n_e, n_e, n_e, n_m, 1])
    return dict(zip(NAMES, [0, *ends.tolist()], strict=True))


def read_run(flight: Recording, installation: Installation) -> Run:
    """`flight`: columns of `flight_columns`; RecordingError when a mount never carries anything."""
    config, models = installation.config, installation.parts().models
    names, engines = [mount.name for mount in config.mount], list(config.aircraft.engines)
    held = len(installation.aircraft().spring_n_mm)
    for engine in engines:
        if len(config.mounts_of(engine)) < held:
            said = f"{engine}: a mount of {held} has no transducer: what the cell holds past the other one is not known"
            raise RecordingError(f"{flight.name}: {said}")
    owners = [engines.index(mount.engine) for mount in config.mount]
    settings = section(config.fusion, FusionSettings, "fusion")
    ranges = [model.spec.valid.deformation_mm[1] for model in models]
    shown_mm = np.column_stack([flight[f"deformation_mm_{name}"] for name in names])
    force_n = np.column_stack([flight[f"model_N_{name}"] for name in names])
    for name, each_n in zip(names, force_n.T, strict=True):
        if np.nanmax(np.abs(each_n)) < LEAST_RANGE_N:
            raise RecordingError(f"{flight.name}: {name} never carries {LEAST_RANGE_N:g} N, expected a run")
    warm, first = _warm(flight, names)
    stiffness = [chords(model, at_rest(model, {})) for model in models]
    slopes = [np.interp(mm, *each) for mm, each in zip(shown_mm.T, stiffness, strict=True)]
    known = installation.calibration() or Calibration(on="2000-01-01")
    curved = {owner for name, owner in zip(names, owners, strict=True) if known.of(name).read_mm}
    speeds = np.column_stack([flight[f"n1_pct_{engines[owner]}"] for owner in owners])
    runs, stopped, counts = _used(speeds, force_n, settings.engine_off_n1_pct, flight.sample_hz)
    seen = list(zip(config.mount, models, shown_mm.T, (warm - first).T, strict=True))
    rubbed = [rubbing(model.spec, mm, flight.sample_hz, settings.mount_friction_std_n) for _, model, mm, _ in seen]
    beyond = [beyond_n(installation, mount, mm, flight.sample_hz) for mount, _, mm, _ in seen]
    grown = [grown_n(model.spec, mm, warmer_k, flight.sample_hz) for _, model, mm, warmer_k in seen]
    return Run(
        mounts=names, engines=engines, engine_of=owners, force_n=force_n, slope_n_mm=np.column_stack(slopes),
        runs=runs, stopped=stopped, counts=counts,
        model_std_n=[hypot(cells(model.spec.error)[2].item(0), settings.mount_friction_std_n) for model in models],
        curve_std_n=[float(np.median(cells(model.spec.error)[2][:, 0])) for model in models],
        grown_n=np.column_stack(grown), part=shown_mm / ranges, rubbing=rubbed, beyond_n=np.column_stack(beyond),
        begins_mm=[model.spec.valid.deformation_mm[0] for model in models], reference_degc=first, range_mm=ranges,
        straight=[e in curved for e in range(len(engines))],
        line_stds=[known.of(name).line_stds(mm) for name, mm in zip(names, ranges, strict=True)],
        rate_hz=flight.sample_hz,
    )  # fmt: skip


def _warm(flight: Recording, names: list[str]) -> tuple[Floats, list[float]]:
    """Temperature of the mounts (n, mounts), means of FIRST_S, and what it was at first; 0 where no thermometer is."""
    row, found, n = np.arange(len(flight)), [], max(round(FIRST_S * flight.sample_hz), 1)
    first = [0.0] * len(names)
    for i, name in enumerate(names):
        shown = flight.channels.get(f"temperature_degC_{name}", np.full(len(flight), np.nan))
        good = np.isfinite(shown)
        if good.any():
            first[i] = float(np.median(shown[good][:n]))
            shown = uniform_filter1d(np.interp(row, row[good], shown[good]), n, mode="nearest")
        found.append(np.nan_to_num(shown))
    return np.column_stack(found), first


def _used(n1_pct: Floats, force_n: Floats, off_pct: float, rate_hz: float) -> tuple[Flags, Flags, Flags]:
    """`runs`, `stopped` and `counts` of a run, from the speeds of the mounts' engines (n, mounts)."""
    runs, row = n1_pct > off_pct, np.arange(len(n1_pct))[:, None]
    began, largest_n = np.maximum.accumulate(runs), np.maximum.accumulate(np.nan_to_num(force_n))
    moved = largest_n > MOVED * largest_n[-1]
    ran = np.maximum.accumulate(np.where(runs, row, 0))
    stopped = began & moved & (row - ran > RUNDOWN_S * rate_hz)
    return runs, stopped, np.all(np.where(runs, moved, ~began | stopped), axis=1)
