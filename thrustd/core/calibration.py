"""What was measured of the mounts where they are: zeros, transducers' curves, gains, hours. A dated file.

    reading r -> deformation  d = curve(r) - curve(zero) - a (T - T_0)      curve: gauge blocks, piecewise linear
    force of the model        F -> gain F,  its friction -> friction times as much     tethered static run
    its slope below its bench -> beyond times as much                          the same, where the weight holds it there
    thrust of the engine      F -> F + drag q + m g sin(lean) (f_z - 1)      flight: at idle, pull-ups

`thrustd zero` and `thrustd calibrate` write it; a configuration names it (`calibration = "calibration.toml"`), `run`
and `replay` read it, and it is in every log. What was not measured keeps the defaults of `[fusion]`.
"""

from itertools import pairwise
from typing import Annotated

import msgspec
from msgspec import Meta

from thrustd.core.columns import Floats
from thrustd.core.config import Day, Section, read_toml
from thrustd.core.errors import ConfigError

LARGEST_ZERO_MM = 0.05  # more is no zero: something pushes, or the transducer is broken
DRIFTED_MM = 0.01  # of a zero since it was measured: 50 N on a mount of 5 kN/mm, as far as a band holds it
SCALE_STD, BOW_STD_MM = 0.005, 0.01  # of one transducer's line, relative and a parabola over its travel: one sigma
HELD_STD_MM = LARGEST_ZERO_MM / 3.0  # one sigma of what friction holds of an earlier load, seen at rest
_OF_CURVE = "beyond_std", "told_mm"
Std = Annotated[float, Meta(gt=0, le=10)]


def bowed(part: Floats) -> Floats:
    """Of a bow of one, over the part of the range that is read: none at its ends."""
    return 4.0 * part * (1.0 - part)


class Zero(Section, frozen=True):
    """One look at an unloaded mount."""

    on: Day
    mm: Annotated[float, Meta(ge=-100, le=100)]  # what the transducer showed beyond what the model says of no thrust
    std_mm: Std
    seen_mm: Annotated[float, Meta(ge=-100, le=100)] | None = None  # at rest, where `mm` was found under load
    seen_std_mm: Std | None = None

    @property
    def at_rest_mm(self) -> float:
        return self.mm if self.seen_mm is None else self.seen_mm

    @property
    def at_rest_std_mm(self) -> float:
        return self.std_mm if self.seen_std_mm is None else self.seen_std_mm


class MountCalibration(Section, frozen=True):
    """Of one mount, as it is installed."""

    zeros: tuple[Zero, ...] = ()  # the oldest first
    read_mm: tuple[float, ...] = ()  # gauge blocks: what the transducer shows
    true_mm: tuple[float, ...] = ()  # and what they are
    curve_std_mm: Std | None = None
    gain: Annotated[float, Meta(gt=0.5, lt=2)] = 1.0  # force in the aircraft over force of the model
    gain_std: Std | None = None
    friction: Annotated[float, Meta(gt=0.3, lt=3)] = 1.0  # of its own over that of the model
    beyond: Annotated[float, Meta(gt=0.5, lt=2)] = 1.0  # slope below its bench over that of the other side
    beyond_std: Std | None = None
    told_mm: Annotated[float, Meta(ge=-100, le=100)] | None = None  # reading where its zero is known best
    expansion_mm_k: Annotated[float, Meta(ge=-0.1, le=0.1)] = 0.0  # of the reading, per kelvin of the mount
    expansion_std_mm_k: Std | None = None
    reference_degc: Annotated[float, Meta(ge=-100, le=200)] = 20.0  # where the zero is
    lean_deg: Annotated[float, Meta(ge=-20, le=20)] = 0.0  # of its axis, nose up against the engine's; all of it
    lean_std_deg: Annotated[float, Meta(gt=0, le=20)] | None = None
    service_h: Annotated[float, Meta(ge=0, le=1e6)] = 0.0  # with its engine running, before the next flight

    def line_stds(self, range_mm: float) -> tuple[float, float]:
        """What its transducer's line may be wrong by, one sigma: scale, bow in mm; gauge blocks have measured both."""
        if self.curve_std_mm is None:
            return SCALE_STD, BOW_STD_MM
        return self.curve_std_mm / range_mm, self.curve_std_mm

    @property
    def leans(self) -> bool:
        """Somebody has measured how."""
        return self.lean_std_deg is not None or self.lean_deg != 0.0

    @property
    def zero_mm(self) -> float:
        return self.zeros[-1].mm if self.zeros else 0.0

    @property
    def zero_std_mm(self) -> float | None:
        return self.zeros[-1].std_mm if self.zeros else None


class EngineCalibration(Section, frozen=True):
    """Of all mounts of one engine together: a load cell tells their sum better than each of them."""

    gain_std: Std  # of the sum of their forces in the aircraft over that of the models


class Drag(Section, frozen=True):
    """Of one engine's nacelle, over dynamic pressure."""

    on: Day
    m2: Annotated[float, Meta(ge=-0.5, le=0.5)]
    std_m2: Annotated[float, Meta(gt=0, le=1)]


class Calibration(Section, frozen=True):
    """The file."""

    on: Day  # of the last change
    mount: dict[str, MountCalibration] = msgspec.field(default_factory=dict)  # by name in the configuration
    engine: dict[str, EngineCalibration] = msgspec.field(default_factory=dict)  # the same; older files: none
    runs: tuple[str, ...] = ()  # whose hours are counted
    tethered: Day | None = None
    drag: Drag | None = None
    recalibrate_by: Day | None = None  # when the trend of some zero has moved it by DRIFTED_MM

    def of(self, mount: str) -> MountCalibration:
        return self.mount.get(mount, MountCalibration())


def read_calibration(text: str, where: str) -> Calibration:
    """Parse and check; ConfigError, one line that begins with `where`."""
    found = read_toml(text, Calibration, where)
    for name, mount in found.mount.items():
        _check(mount, f"{where}: mount.{name}")
    return found


def _check(mount: MountCalibration, where: str) -> None:
    if len(mount.read_mm) != len(mount.true_mm) or len(mount.read_mm) == 1:
        raise ConfigError(f"{where}: {len(mount.read_mm)} read_mm and {len(mount.true_mm)} true_mm, expected as many")
    for name, values in (("read_mm", mount.read_mm), ("true_mm", mount.true_mm)):
        if any(later <= earlier for earlier, later in pairwise(values)):
            raise ConfigError(f"{where}.{name}: {values}, expected increasing values")
    if any(later.on <= earlier.on for earlier, later in pairwise(mount.zeros)):
        raise ConfigError(f"{where}.zeros: on {', '.join(zero.on for zero in mount.zeros)}; expected the oldest first")
    most_mm = LARGEST_ZERO_MM + (0.0 if mount.gain_std is None else 3.0 * HELD_STD_MM)  # found under load
    if any(abs(zero.mm) > most_mm for zero in mount.zeros):
        largest = max(mount.zeros, key=lambda zero: abs(zero.mm))
        raise ConfigError(f"{where}.zeros: {largest.mm} mm, expected at most {most_mm:g} mm: more is no zero")


def _row(zero: Zero) -> str:
    seen = "" if zero.seen_mm is None else f", seen_mm = {zero.seen_mm:.6f}, seen_std_mm = {zero.at_rest_std_mm:.6f}"
    return f'{{ on = "{zero.on}", mm = {zero.mm:.6f}, std_mm = {zero.std_mm:.6f}{seen} }}'


def write_calibration(calibration: Calibration) -> str:
    """The text of the file."""
    lines = ["# Written by `thrustd zero` and `thrustd calibrate`.", f'on = "{calibration.on}"']
    lines += [f'{name} = "{value}"' for name in ("tethered", "recalibrate_by") if (value := getattr(calibration, name))]
    if (drag := calibration.drag) is not None:
        lines.append(f'drag = {{ on = "{drag.on}", m2 = {drag.m2:.5f}, std_m2 = {drag.std_m2:.5f} }}')
    lines += [f"runs = {list(calibration.runs)}".replace("'", '"')] if calibration.runs else []
    for name, engine in calibration.engine.items():
        lines += ["", f"[engine.{name}]", f"gain_std = {engine.gain_std!r}"]
    for name, mount in calibration.mount.items():
        lines += ["", f"[mount.{name}]"]
        lines += [f"zeros = [{', '.join(map(_row, mount.zeros))}]"] if mount.zeros else []
        lines += [f"{key} = {list(value)}" for key in ("read_mm", "true_mm") if (value := getattr(mount, key))]
        thermal = ("expansion_mm_k", "expansion_std_mm_k", "reference_degc") if mount.expansion_std_mm_k else ()
        more = [
            key for key, none in (("friction", 1.0), ("beyond", 1.0), ("lean_deg", 0.0)) if getattr(mount, key) != none
        ]
        for key in ("curve_std_mm", "gain", "gain_std", *thermal, *more, *_OF_CURVE, "lean_std_deg", "service_h"):
            value = getattr(mount, key)
            lines += [f"{key} = {value!r}"] if value is not None else []
    return "\n".join(lines) + "\n"
