"""What is wrong with a sensor or a wire, as an edit of what came: of LVDT readings [mm], values on the bus, or events.

An edit is given the seconds since the fault began and the values, both (n,), or the four mounts' (n, 4), and gives
other values. Units on the bus are those of the ICD: g, K, l/h, 1/min.
"""

from collections.abc import Callable, Iterator, Mapping
from math import inf
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.types import Event

Changing = Callable[[Floats, Floats, Any], Floats]  # seconds, mm (n, 4) or values (n,), surroundings -> others
Stream = Callable[[list[Event], int, int], Iterator[Event]]  # events from the fault on, its begin and end [ns]
Speaking = Callable[[Floats, Floats], Floats]  # seconds, values (n,) -> values
Channel = tuple[str, int]
LEFT, BOTH_ENGINES = (0, 1), (0, 1, 2, 3)
N_PER_MM = 5079.0 + 5954.0  # of the mounts of an engine, thesis table 4.1
BOW_RANGE_MM = 1.6


class Surroundings(NamedTuple):
    """Along the samples that are edited, (n,) each: what an error may depend on."""

    dynamic_pressure_pa: Floats
    accel_z_g: Floats
    temperature_k: Floats
    mach: Floats


class Edit(NamedTuple):
    """What one fault does to the wire."""

    mounts: Changing | None = None
    bus: Mapping[Channel, Changing] = {}
    swapped: tuple[Channel, Channel] | None = None  # on the bus
    slow: float = 0.0  # the ADC's crystal, relative; its samples come so much later each
    restarts: bool = False  # the ADC does: sequence and device time from 0, for good
    stream: Stream | None = None
    lasts_s: float = inf  # mounts, bus and stream; the others stay


def _on(channels: tuple[int, ...], change: Callable[[Floats, Floats], Floats]) -> Edit:
    """`change` of (seconds, mm) on these ADC channels."""

    def edit(time_s: Floats, mm: Floats, _: Any) -> Floats:
        out = mm.copy()
        for channel in channels:
            out[:, channel] = change(time_s, mm[:, channel])
        return out

    return Edit(mounts=edit)


def step(channels: tuple[int, ...], mm: float) -> Edit:
    return _on(channels, lambda _, read_mm: read_mm + mm)


def drift(channels: tuple[int, ...], mm_min: float) -> Edit:
    return _on(channels, lambda time_s, read_mm: read_mm + mm_min * time_s / 60.0)


def gain(channels: tuple[int, ...], factor: float) -> Edit:
    return _on(channels, lambda _, read_mm: factor * read_mm)


def slow_gain(channels: tuple[int, ...], per_min: float) -> Edit:
    return _on(channels, lambda time_s, read_mm: read_mm * (1.0 + per_min * time_s / 60.0))


def stuck(channels: tuple[int, ...], noise_mm: float) -> Edit:
    rng = np.random.default_rng(7)
    return _on(channels, lambda _, read_mm: read_mm[0] + rng.normal(0.0, noise_mm, len(read_mm)))


def scattered(channels: tuple[int, ...], low_mm: float, high_mm: float) -> Edit:
    """Anything between two readings, as a loose plug gives."""
    rng = np.random.default_rng(7)
    return _on(channels, lambda time_s, _: rng.uniform(low_mm, high_mm, len(time_s)))


def opened(channels: tuple[int, ...]) -> Edit:
    """NaN: the ADC marks the channel."""
    return _on(channels, lambda _, read_mm: np.full_like(read_mm, np.nan))


def order(channels: tuple[int, int, int, int]) -> Edit:
    """Mount i is told what channel channels[i] reads."""
    return Edit(mounts=lambda _, mm, __: mm[:, list(channels)])


def crosstalk(part: float) -> Edit:
    """Every channel also shows this part of what the other engine's does."""
    return Edit(mounts=lambda _, mm, __: mm + part * mm[:, [2, 3, 0, 1]])


def common_ground(channels: tuple[int, ...], part: float) -> Edit:
    """Each of these channels also shows this part of what all of them read together."""
    mine = np.isin(range(4), channels)
    return Edit(mounts=lambda _, mm, __: mm + part * mine * mm[:, mine].sum(axis=1, keepdims=True))


def says(signal: str, number: int, change: Speaking) -> Edit:
    return Edit(bus={(signal, number): lambda time_s, values, _: change(time_s, values)})


def on_the_ground(channel: Channel, factor: float) -> Edit:
    """Wrong until the aircraft flies, sane from then on."""

    def edit(_: Floats, values: Floats, around: Any) -> Floats:
        return np.where(np.maximum.accumulate(around.mach) < 0.2, factor * values, values)

    return Edit(bus={channel: edit})


def swap(first: Channel, second: Channel) -> Edit:
    return Edit(swapped=(first, second))


def clock(slow: float) -> Edit:
    return Edit(slow=slow)


def together(*edits: Edit) -> Edit:
    """All of them at once; one of them moves a channel of the bus."""

    def mounts(time_s: Floats, mm: Floats, around: Any) -> Floats:
        for edit in edits:
            if edit.mounts is not None:
                mm = edit.mounts(time_s, mm, around)
        return mm

    return Edit(mounts=mounts, bus={channel: change for edit in edits for channel, change in edit.bus.items()})


def _everywhere(change: Callable[[Floats, Any], Floats]) -> Edit:
    """(n, 4) added to what all mounts read, of (mm, surroundings)."""
    return Edit(mounts=lambda _, mm, around: mm + change(mm, around))


def nacelle_drag(area_m2: float) -> Edit:
    """Drag of a nacelle takes load off its two mounts."""
    return _everywhere(lambda mm, around: -area_m2 * around.dynamic_pressure_pa[:, None] / N_PER_MM + 0 * mm)


def zero(mm: float) -> Edit:
    return step(BOTH_ENGINES, mm)


def bow(mm: float) -> Edit:
    """A transducer's line is a parabola, furthest off in the middle of the range."""
    return _everywhere(lambda read, _: 4.0 * mm * (read / BOW_RANGE_MM) * (1.0 - read / BOW_RANGE_MM))


def expansion(mm_k: float) -> Edit:
    return _everywhere(lambda read, around: mm_k * (around.temperature_k[:, None] - 293.15) + 0 * read)


def cant(degrees: float) -> Edit:
    """A mount that is not along the engine feels a part of its weight."""
    share_n = 373.0 * 9.80665 * np.sin(np.radians(degrees)) / N_PER_MM
    return _everywhere(lambda read, around: share_n * around.accel_z_g[:, None] + 0 * read)


# drag_m2 of the aircraft's file was set to what flies here: the drag, and "all of them", which has it, prove nothing of
# that prior. No other setting of the project is chosen on any of these
HOSTILE: dict[str, Edit] = {
    "nacelle drag 0.04 m2": nacelle_drag(0.04),
    "zero +0.03 mm": zero(0.03),
    "zero -0.03 mm": zero(-0.03),
    "bow 25 um": bow(0.025),
    "LVDT scale +1 %": gain(BOTH_ENGINES, 1.01),
    "expansion 1 um/K": expansion(0.001),
    "cant 2 deg": cant(2.0),
    "accelerometer +0.01 g": says("accel_x_g", 0, lambda _, g: g + 0.01),
}
HOSTILE["all of them"] = together(*(edit for name, edit in HOSTILE.items() if name != "zero -0.03 mm"))
