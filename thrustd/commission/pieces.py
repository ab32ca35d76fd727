"""What a team brings to `commission`, read and judged before any work: benches by mount, weight, chamber, flights."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thrustd.commission.places import check_units
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.signals import CATALOGUE
from thrustd.diagnose.compare.checks import check_channel_units
from thrustd.diagnose.search.candidates import moves
from thrustd.installation.installation import Installation
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording

EXTEND_HZ = 4.0  # weight and temperature act slowly: fewer samples say as much of them
BENCH_HZ = 20.0
LEVEL_G = {"accel_x_g": 0.0, "accel_z_g": 1.0}  # a bench stands still
DECK_NEEDS = ("n1_pct", "fuel_flow_kg_s")
LEAST_N = 1000.0  # span of a bench: less is no load of a mount, or another unit
LEAST_HZ = 1.0  # a bench moves a mount within seconds: fewer samples are another unit of time
LIKE = 2.0  # times: a mount of the same kind is as stiff within this, cold or hot
LEAST_K = 5.0  # from the benches: a chamber that is no colder and no hotter tells nothing


@dataclass(frozen=True, slots=True)
class Pieces:
    """Records by what they are of; a key of `bench` is a mount of the configuration."""

    bench: dict[str, list[Recording]]
    weight: list[Recording]
    chamber: list[Recording]
    flights: list[Path]


def read_pieces(
    bench: Sequence[str],
    weight: Sequence[Path],
    chamber: Sequence[Path],
    flights: Sequence[Path],
    installation: Installation,
) -> Pieces:
    """UsageError or RecordingError, one line, when something is not what it is given as."""
    mounts = [mount.name for mount in installation.config.mount]
    paths = _paths(bench, mounts)
    read = {path: _bench(path) for path in dict.fromkeys(path for several in paths.values() for path in several)}
    records = {mount: [read[path] for path in several] for mount, several in paths.items()}
    check_units({mount: list(map(_stiffness, several)) for mount, several in records.items()}, installation)
    for path in flights:
        _check_flight(path)
    slow = [[_bench(path, EXTEND_HZ) for path in several] for several in (weight, chamber)]
    for record in (*read.values(), *slow[0], *slow[1]):
        check_channel_units(record, overruled="")
    for record in (*slow[0], *slow[1]):
        _check_like(record, list(read.values()))
    for record in slow[0]:
        _check_moves(record, "accel_z_g", 0.2, "--weight")
    if slow[1]:
        _check_chamber(slow[1], list(read.values()))
    return Pieces(records, slow[0], slow[1], list(flights))


def _paths(bench: Sequence[str], mounts: Sequence[str]) -> dict[str, list[Path]]:
    """PLACE=FILE, files of one place with commas: by mount; `upper` stands for every mount whose name ends so."""
    found: dict[str, list[Path]] = {}
    for given in bench:
        place, _, names = given.partition("=")
        mine = [mount for mount in mounts if mount == place or mount.endswith(f"_{place}")]
        if not mine or not all(names.split(",")):
            raise UsageError(f"--bench {given}: expected MOUNT=FILE with a mount of {', '.join(mounts)}, or its ending")
        for mount in mine:
            found.setdefault(mount, []).extend(Path(name) for name in names.split(","))
    if missing := [mount for mount in mounts if mount not in found]:
        raise UsageError(f"--bench: nothing for {', '.join(missing)}; expected a bench record of every mount")
    return found


def _bench(path: Path, rate_hz: float = BENCH_HZ) -> Recording:
    record = read_recording(path)
    for name in ("deformation_mm", "force_N"):
        _check_numbers(record, name)
    span_n = float(np.nanmax(record["force_N"]) - np.nanmin(record["force_N"]))
    if not span_n > LEAST_N:
        said = f"force_N spans {span_n:.3g} in {record.duration_s:.0f} s"
        raise RecordingError(f"{record.name}: {said}; expected a mount loaded by {LEAST_N:g} N at least; is it kN?")
    if not record.sample_hz >= LEAST_HZ:
        said = f"a sample every {1.0 / record.sample_hz:.3g} s"
        raise RecordingError(f"{record.name}: {said}; expected {LEAST_HZ:g} Hz at least; is its time in milliseconds?")
    if _stiffness(record) < 0.0:
        said = "force_N falls where deformation_mm grows; expected a mount that resists"
        raise RecordingError(f"{record.name}: {said}; is the sign of force_N or deformation_mm turned?")
    level = {name: g for name, g in LEVEL_G.items() if name not in record}
    record = record.with_channels(**{name: np.full(len(record), g) for name, g in level.items()})
    return record.resample(rate_hz) if record.sample_hz > 1.5 * rate_hz else record


def _check_numbers(record: Recording, channel: str) -> None:
    if not np.isfinite(record[channel]).any():
        raise RecordingError(f"{record.name}: no number in {channel}; expected what the rig has measured")


def _stiffness(record: Recording) -> float:
    """N/mm, by the line through the record."""
    both = np.array([record["deformation_mm"], record["force_N"]])
    spread = np.cov(both[:, np.isfinite(both).all(axis=0)])
    return float(spread[0, 1] / max(spread[0, 0], np.finfo(float).tiny))


def _check_like(record: Recording, benches: Sequence[Recording]) -> None:
    own, others = _stiffness(record), [_stiffness(bench) for bench in benches]
    if not min(others) / LIKE < own < max(others) * LIKE:
        usual = " and ".join(dict.fromkeys(f"{end:.3g}" for end in (min(others), max(others))))
        raise RecordingError(
            f"{record.name}: {own:.3g} N/mm, the benches {usual}; expected a mount of that kind;"
            " is force_N in pounds, or deformation_mm in another unit?"
        )


def _check_moves(record: Recording, channel: str, least: float, option: str) -> None:
    _check_numbers(record, channel)
    if not np.nanstd(record[channel]) > least:
        raise RecordingError(f"{record.name}: {channel} hardly moves; expected a record for {option}")


def _check_chamber(chamber: Sequence[Recording], benches: Sequence[Recording]) -> None:
    name, at_rest = "temperature_degC", CATALOGUE["temperature_degC"].rest
    for record in chamber:
        _check_numbers(record, name)
    rooms = [
        float(np.nanmedian(record[name])) for record in benches if np.isfinite(record.channels.get(name, np.nan)).any()
    ]
    warm = np.concatenate([record[name] for record in chamber])
    off_k = float(np.nanmax(np.abs(warm - (np.mean(rooms) if rooms else at_rest))))
    names = ", ".join(record.name for record in chamber)
    if not moves(warm):
        raise RecordingError(
            f"{names}: {name} is {np.nanmedian(warm):.1f} throughout; expected a cold and a hot record"
        )
    if not off_k > LEAST_K:
        raise RecordingError(f"{names}: {name} stays within {off_k:.1f} K of the benches; expected {LEAST_K:g} K more")


def _check_flight(path: Path) -> None:
    record = read_recording(path)
    for name in DECK_NEEDS:
        if not any(column.startswith(f"{name}_") and np.isfinite(record[column]).any() for column in record.channels):
            raise RecordingError(
                f"{path.name}: no {name}_left or {name}_right; expected a flight with fuel flow and N1"
            )
