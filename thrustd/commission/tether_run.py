"""A tethered run as its regression sees it: what every mount's model says by row, and which rows count.

An engine that is off carries nothing. Its mounts count from when they have carried half of their largest force: what an
earlier load left in the friction is gone by then (a stop forgets after twice its own travel).
"""

from dataclasses import dataclass
from math import hypot

import msgspec
import numpy as np

from thrustd.core.calibration import Calibration, bowed
from thrustd.core.columns import Flags, Floats
from thrustd.core.config import Mount, section
from thrustd.core.errors import RecordingError
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation
from thrustd.model.artifact import ModelSpec
from thrustd.model.calibrated import calibrated, with_friction
from thrustd.model.compile import compile_model, rubs
from thrustd.model.region_error import cells
from thrustd.mounts.start import at_rest, chords, resting_n
from thrustd.records.recording import Recording

LEAST_RANGE_N = 1000.0
FIRST_S = 60.0  # whose median temperature is that of the zeros
MOVED = 0.5  # of the largest force
MORE = 0.1  # of friction, of a slope
NAMES = "gain", "own", "zero", "growth", "bow", "friction", "beyond", "cell", "clock"  # of the numbers, in this order
POINTS = 101  # of a curve at rest
KNOTS = 5  # of its error over the load
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
    warmer_k: Floats  # (n, mounts) than at first; 0 where no thermometer is
    part: Floats  # (n, mounts) of its range that its transducer reads
    friction_n: Floats  # (n, mounts) of its model
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
    grown, bent = (run.by_engine(slope * column) for column in (run.warmer_k, bowed(run.part)))
    known = run.by_engine(force_n), force_n, slope, grown, bent, run.by_engine(run.friction_n * rows)
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
    rubbed = [friction_n(model.spec, mm, flight.sample_hz) for model, mm in zip(models, shown_mm.T, strict=True)]
    beyond = [
        beyond_n(installation, mount, mm, flight.sample_hz) for mount, mm in zip(config.mount, shown_mm.T, strict=True)
    ]
    return Run(
        mounts=names, engines=engines, engine_of=owners, force_n=force_n, slope_n_mm=np.column_stack(slopes),
        runs=runs, stopped=stopped, counts=counts,
        model_std_n=[hypot(cells(model.spec.error)[2].item(0), settings.mount_friction_std_n) for model in models],
        curve_std_n=[float(np.median(cells(model.spec.error)[2][:, 0])) for model in models],
        warmer_k=np.nan_to_num(warm - first), part=shown_mm / ranges,
        friction_n=np.column_stack(rubbed), beyond_n=np.column_stack(beyond),
        begins_mm=[model.spec.valid.deformation_mm[0] for model in models], reference_degc=first, range_mm=ranges,
        straight=[e in curved for e in range(len(engines))],
        line_stds=[known.of(name).line_stds(mm) for name, mm in zip(names, ranges, strict=True)],
        rate_hz=flight.sample_hz,
    )  # fmt: skip


def friction_n(spec: ModelSpec, shown_mm: Floats, rate_hz: float) -> Floats:
    """What a model's friction adds (n,) along readings that begin at rest."""
    good = np.isfinite(shown_mm)
    row = np.arange(len(shown_mm))
    mm = np.interp(row, row[good], shown_mm[good])
    mm -= mm[0]
    own = msgspec.structs.replace(spec, effects=[one for one in spec.effects if rubs(one)])
    runs = []
    for factor in (1.0, 1.0 + MORE):
        model = compile_model(with_friction(own, factor), rate_hz)
        inputs, out = np.tile(mm[:, None], (1, len(model.channels) - 1)), mm.copy()
        model.run(model.start(np.zeros(len(model.channels))), inputs, out)
        runs.append(out)
    more_n = (runs[1] - runs[0]) / MORE
    return np.asarray(more_n - more_n[0])  # what holds the weight is in the zero


def beyond_n(installation: Installation, mount: Mount, shown_mm: Floats, rate_hz: float) -> Floats:
    """Force (n,) per part by which the curve is steeper beyond its bench, where the weight holds the mount out there.

    It rests elsewhere on its curve then, with no more force: nothing at rest, most from where its bench begins.
    """
    place, spec = installation.place(mount.name), installation.bench_model(mount)
    grid_mm, known = np.linspace(np.nanmin(shown_mm), np.nanmax(shown_mm), POINTS), place.calibration
    rests = []
    for factor in (1.0, 1.0 + MORE):
        steeper = msgspec.structs.replace(known, beyond=known.beyond * factor)
        model = compile_model(calibrated(spec, place._replace(calibration=steeper), mount.model), rate_hz)
        if model.spec.valid.deformation_mm[0] <= 0.0:
            return np.zeros(len(shown_mm))
        row = at_rest(model, {})
        rests.append(np.array([resting_n(model, row(mm)) for mm in grid_mm.tolist()]))
    return np.asarray(np.interp(shown_mm, grid_mm, (rests[1] - rests[0]) / MORE))


def _warm(flight: Recording, names: list[str]) -> tuple[Floats, list[float]]:
    """Temperature of the mounts (n, mounts), and what it was at first; 0 where no thermometer is."""
    warm = [flight.channels.get(f"temperature_degC_{name}", np.zeros(len(flight))) for name in names]
    measured = [each[np.isfinite(each)][: max(round(FIRST_S * flight.sample_hz), 1)] for each in warm]
    return np.column_stack(warm), [float(np.median(each)) if len(each) else 0.0 for each in measured]


def _used(n1_pct: Floats, force_n: Floats, off_pct: float, rate_hz: float) -> tuple[Flags, Flags, Flags]:
    """`runs`, `stopped` and `counts` of a run, from the speeds of the mounts' engines (n, mounts)."""
    runs, row = n1_pct > off_pct, np.arange(len(n1_pct))[:, None]
    began, largest_n = np.maximum.accumulate(runs), np.maximum.accumulate(np.nan_to_num(force_n))
    moved = largest_n > MOVED * largest_n[-1]
    ran = np.maximum.accumulate(np.where(runs, row, 0))
    stopped = began & moved & (row - ran > RUNDOWN_S * rate_hz)
    return runs, stopped, np.all(np.where(runs, moved, ~began | stopped), axis=1)
