"""What diagnosis looks at: one table of rows for all records, thin enough for linear algebra.

A model is simulated at the full rate over every stretch of data; what the statistics see are means over `width`
samples (at most `ROWS` rows in all), cut into contiguous blocks of time. Blocks are the unit of evidence: neighbouring
samples of a mount's residual are anything but independent, blocks of minutes nearly are.

A model that knows its reading to be late has it put back to its time here: a record allows that, a flight does not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase

import msgspec
import numpy as np
from numpy.typing import NDArray

from thrustd.core.measures import rms
from thrustd.identify.parameters import pack
from thrustd.identify.segments import Segment, bridged, segments_of
from thrustd.identify.sensitivity import jacobian_blocks
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats, Stage
from thrustd.records.recording import Recording

ROWS = 50_000  # rows of the table at most; 250 columns of it are 100 MB
BLOCKS = 48  # of equal length over all records
FOLDS = 6  # blocks held back in turn
BASE_PARAMETERS = ("input_curve.[yc]*", "linear.*", "output_curve.[yc]*")  # knots stay: moving them is hardly new

Ints = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Rows of all segments, one after the other."""

    segments: tuple[Segment, ...]
    width: int  # samples per row
    reference_n: Floats  # (n,), NaN where there is none
    time_s: Floats  # (n,)
    block: Ints  # (n,) number of the block a row belongs to
    segment: Ints  # (n,) number of the segment
    channels: dict[str, Floats]  # every column of the records that all of them have, (n,)
    known: dict[tuple[int, float], list[tuple[bytes, Floats]]] = field(default_factory=dict)  # see `remember`

    def white_n2(self, spec: ModelSpec) -> float:
        """Squared error of a model inside the rows, which their means do not show, N^2."""
        if self.width == 1:
            return 0.0
        total, count = 0.0, 0
        for segment in self.segments:
            m = len(segment) // self.width * self.width
            residual = segment.force_n[:m] - simulate(spec, segment)[:m]
            rows = residual.reshape(-1, self.width)
            inside = (rows - rows.mean(axis=1, keepdims=True)) ** 2
            total += float(np.nansum(inside))
            count += int(np.isfinite(inside).sum())
        return total / max(1, count)

    @property
    def n_blocks(self) -> int:
        return int(self.block[-1]) + 1

    @property
    def row_s(self) -> float:
        return self.width * self.segments[0].dt_s

    def remember(self, spec: ModelSpec) -> None:
        """Keep the signal behind every stage of this model: what shares its first stages starts from there."""
        self.known.clear()
        punctual, late_s = lateness(spec)
        for segment in self.segments:
            inputs = put_back(segment, late_s).inputs
            v, run = inputs["deformation_mm"], []
            for stage in model_stages(punctual, segment.dt_s):
                v = run_stage(stage, inputs, v)
                run.append((stage_key(stage), v))
            self.known[id(segment), late_s] = run

    def output(self, spec: ModelSpec) -> Floats:
        """Model force by row (n,)."""
        return self.rows([self._simulated(spec, segment) for segment in self.segments])

    def _simulated(self, spec: ModelSpec, segment: Segment) -> Floats:
        punctual, late_s = lateness(spec)
        stages, inputs = model_stages(punctual, segment.dt_s), put_back(segment, late_s).inputs
        v, done = inputs["deformation_mm"], 0
        for stage, (key, after) in zip(stages, self.known.get((id(segment), late_s), []), strict=False):
            if stage_key(stage) != key:
                break
            v, done = after, done + 1
        for stage in stages[done:]:
            v = run_stage(stage, inputs, v)
        return v

    def rmse_n(self, spec: ModelSpec) -> float:
        """Error of a free run over all samples, start-up included, N."""
        residual = self.reference_n - self.output(spec)
        return float(np.sqrt(np.nanmean(residual**2) + self.white_n2(spec)))

    def rmse_in_flight_n(self, spec: ModelSpec) -> float:
        """Error of a free run over all samples, each judged when it comes, N."""
        errors = [s.force_n - simulate_in_flight(spec, s) for s in self.segments]
        return rms(np.concatenate(errors))

    def rows(self, columns: Sequence[Floats]) -> Floats:
        """Full-rate columns, one per segment, as row means (n,)."""
        return np.concatenate([_means(column, self.width) for column in columns])

    def jacobian(self, spec: ModelSpec, which: Sequence[str] = BASE_PARAMETERS) -> Floats:
        """d force / d parameter by row (n, p) of the parameters chosen."""
        punctual, late_s = lateness(spec)
        vector = pack(punctual, base_patterns(punctual, which))
        tables = []
        for segment in self.segments:
            sums = np.zeros((len(segment) // self.width, len(vector)))
            for begin, _, columns in jacobian_blocks(punctual, put_back(segment, late_s), vector):
                _add_rows(sums, begin, columns, self.width)
            tables.append(sums / self.width)
        return np.concatenate(tables)


def base_patterns(spec: ModelSpec, which: Sequence[str] = BASE_PARAMETERS) -> list[str]:
    """Those of the patterns that this model has parameters for."""
    names = pack(spec).names
    return [pattern for pattern in which if any(fnmatchcase(name, pattern) for name in names)]


def gather(spec: ModelSpec, records: Sequence[Recording]) -> Evidence:
    """The table for a model and records that carry their reference as force_N."""
    shared = _shared(records)
    needed = [name for stage in model_stages(spec, 1.0) for name in stage.channels]
    segments = segments_of(records, dict.fromkeys([*needed, *shared, "time_s"]))
    total = sum(map(len, segments))
    width = max(1, -(-total // ROWS))
    counts = [len(segment) // width for segment in segments]
    keep = [segment for segment, count in zip(segments, counts, strict=True) if count > 0]
    counts = [count for count in counts if count > 0]
    names = ["deformation_mm", *shared]
    return Evidence(
        tuple(keep),
        width,
        np.concatenate([_means(s.force_n, width) for s in keep]),
        np.concatenate([_means(s.time_s, width) for s in keep]),
        _blocks(counts),
        np.repeat(np.arange(len(keep)), counts),
        {name: np.concatenate([_means(s.inputs[name], width) for s in keep]) for name in dict.fromkeys(names)},
    )


def _shared(records: Sequence[Recording]) -> list[str]:
    """Columns of every record that are complete enough to be used as an input."""
    names = [name for name in records[0].channels if all(name in record for record in records)]
    return [
        name
        for name in names
        if name != "force_N" and all(np.isfinite(bridged(record[name])).mean() > 0.999 for record in records)
    ]


def _blocks(counts: Sequence[int]) -> Ints:
    """Contiguous blocks of nearly equal length which never span two segments."""
    total, blocks, next_block = sum(counts), [], 0
    for count in counts:
        number = max(1, round(BLOCKS * count / total))
        blocks.append(next_block + np.arange(count) * number // count)
        next_block += number
    return np.concatenate(blocks)


def _add_rows(sums: Floats, begin: int, columns: Floats, width: int) -> None:
    """Add a block of full-rate columns that begins at sample `begin` to the sums of its rows."""
    rows = (begin + np.arange(len(columns))) // width
    rows = rows[rows < len(sums)]
    if len(rows):
        firsts = np.flatnonzero(np.diff(rows, prepend=-1))
        sums[rows[firsts]] += np.add.reduceat(columns[: len(rows)], firsts, axis=0)


def lateness(spec: ModelSpec) -> tuple[ModelSpec, float]:
    """The model without the effects that a record can undo by looking ahead in it, and how far ahead, s."""
    late_s, rest = 0.0, []
    for present in spec.effects:
        ahead_s = effect_named(present.name).ahead_s
        this_s = ahead_s(present.parameters) if ahead_s is not None else 0.0
        late_s += this_s
        rest += [present] if this_s == 0.0 else []
    return (spec, 0.0) if late_s == 0.0 else (msgspec.structs.replace(spec, effects=rest), late_s)


def put_back(segment: Segment, late_s: float) -> Segment:
    """The segment with its deformation at the time it belongs to."""
    if late_s == 0.0:
        return segment
    reading, t = segment.inputs["deformation_mm"], np.arange(len(segment)) * segment.dt_s
    return replace(segment, inputs=dict(segment.inputs) | {"deformation_mm": np.interp(t + late_s, t, reading)})


def _means(column: Floats, width: int) -> Floats:
    m = len(column) // width * width
    means: Floats = column[:m].reshape(-1, width).mean(axis=1)
    return means


def simulate(spec: ModelSpec, segment: Segment) -> Floats:
    """Free run over a whole segment from rest (n,), a late reading put back to its time."""
    punctual, late_s = lateness(spec)
    return simulate_in_flight(punctual, put_back(segment, late_s))


def simulate_in_flight(spec: ModelSpec, segment: Segment) -> Floats:
    """The same as every sample comes in (n,): a late reading can only be extrapolated."""
    v = segment.inputs["deformation_mm"]
    for stage in model_stages(spec, segment.dt_s):
        v = run_stage(stage, segment.inputs, v)
    return v


def stage_key(stage: Stage) -> bytes:
    """The same for stages that do the same."""
    return f"{stage.name} {id(stage.step)} {stage.channels} ".encode() + stage.c.tobytes()


def run_stage(stage: Stage, inputs: Mapping[str, Floats], v: Floats) -> Floats:
    """One stage over a whole segment, started at rest on the first sample."""
    return stage.from_rest(inputs, np.ascontiguousarray(v))
