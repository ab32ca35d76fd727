"""What was decoded, put on the step grid in its order: readings held, the ADC's clock on ours, samples for the models.

The instants of the ADC are the grid. `Grid.align` walks through a batch up to the next thing that is not everyday;
what it does does not depend on how the events were batched.
"""

from math import nan
from typing import Any, Final, NamedTuple

import numba

from thrustd.core.columns import (
    CHANNEL_FAULT,
    COUNTS,
    DEVICE_US,
    EVENT,
    FAULT,
    GOOD,
    KIND,
    SEQUENCE,
    SLOT,
    Bytes,
    Floats,
    Integers,
)
from thrustd.core.jit import compiled, entry, named
from thrustd.sync.memory import CLOCK, GRID, HELD, MOUNT

CRYSTAL_TOLERANCE = 100e-6  # two crystals drift apart by less than this, s/s
WORST_CRYSTAL = 0.06  # one that is broken and still followed; more is no clock
WORST_RATE = 0.5  # more is a reader that catches up, or the wrong configuration: the decoder says that
RATE_WINDOW_NS = 1_000_000_000  # a reader that stalls is on time once in a window
SAME_RATE = 2e-3  # two windows say so one after the other
SILENT_NS, SILENT_SAMPLES = 50_000_000, 2.5  # no ADC sample for so long, and so many of them: ticks take over
EARLY_STEP = 0.75  # of a fused step: ticks jitter

# why `align` stopped
DONE, OTHER_EVENT, CAN_FAULT, ADC_FAULT, READING_OUTSIDE, SAMPLE_OUTSIDE, CATCH_UP, FULL, RESUME, FUSE = range(10)
# where it stopped: event, row of readings, row of samples; what is next of that sample: its time, then mount by mount
PLACE_EVENT, PLACE_READING, PLACE_SAMPLE, PLACE_MOUNT = range(4)
TIME_FIRST: Final = -1


@compiled
def _rate_clock(clock: Any, device_ns: int, delay_ns: int) -> None:
    """The crystal's rate: how the delay of samples that were least late grows from window to window.

    Crystals that agree as two healthy ones do are left alone.
    """
    expected_ns = int((device_ns - clock.least[0]) * clock.rate)
    if clock.window_ns == 0 or delay_ns - expected_ns <= clock.least[1]:
        clock.least[0], clock.least[1] = device_ns, delay_ns
    if clock.window_ns == 0:
        clock.window_ns = device_ns
    if device_ns - clock.window_ns < RATE_WINDOW_NS:
        return
    clock.window_ns = 0
    base_ns = clock.least[0] - clock.anchor[0]
    if clock.anchor[0] == 0:
        clock.anchor[0], clock.anchor[1] = clock.least[0], clock.least[1]  # no slice: see `_take` of the filter
    elif base_ns > 0:
        rate, before = (clock.least[1] - clock.anchor[1]) / base_ns, clock.last_rate
        clock.anchor[0], clock.anchor[1], clock.last_rate = clock.least[0], clock.least[1], rate
        if abs(rate) < WORST_RATE and abs(rate - before) < SAME_RATE:
            clock.found_rate = rate if abs(rate) > 3.0 * CRYSTAL_TOLERANCE else 0.0
            if abs(rate) < WORST_CRYSTAL:
                clock.rate = clock.found_rate
        if clock.rate != 0.0:
            clock.offset_ns = clock.least[1] + int((device_ns - clock.least[0]) * clock.rate)


def _map_clock(memory: Any, arrival_ns: int, device_time_us: int) -> int:
    clock = memory[0]
    device_ns = device_time_us * 1000
    delay_ns = arrival_ns - device_ns
    if not clock.known or device_ns < clock.device_ns:
        clock.known, clock.offset_ns, clock.rate, clock.window_ns, clock.anchor[0] = 1, delay_ns, 0.0, 0, 0
        clock.last_rate, clock.found_rate = WORST_RATE, 0.0
    else:
        drift_ns = int((device_ns - clock.device_ns) * (CRYSTAL_TOLERANCE + clock.rate))
        clock.offset_ns = min(clock.offset_ns + drift_ns, delay_ns)
        _rate_clock(clock, device_ns, delay_ns)
    clock.device_ns = device_ns
    return device_ns + clock.offset_ns


def _keep_reading(held: Any, heard: Integers, place: int, t_ns: int, value: float) -> bool:
    """False when the value is outside the catalogue's range."""
    slot = held[place]
    if not slot.low <= value <= slot.high:
        return False
    slot.value, slot.t_ns = value, t_ns
    if not slot.known:
        slot.known = 1
        heard[0] += 1
        heard[heard[0]] = place
    return True


def _look_at(held: Any, heard: Integers, t_ns: int, seen: Floats) -> bool:
    """Rows of `seen`: the values that still count, else NaN; their ages in seconds, else 0. -> staleness changed."""
    for i in range(len(held)):
        slot, age_ns = held[i], t_ns - held[i].t_ns
        counts = age_ns <= slot.stale_after_ns
        seen[0, i] = slot.value if counts else nan
        seen[1, i] = age_ns * 1e-9 if counts and slot.known and age_ns > 0 else 0.0
    for i in range(heard[0]):
        slot = held[heard[1 + i]]
        if (t_ns - slot.t_ns > slot.stale_after_ns) != (slot.stale != 0):
            return True
    return False


_I, _F, _TABLE = numba.int64[::1], numba.float64[::1], numba.int64[:, ::1]
_CLOCK, _HELD, _GRID, _MOUNT = (numba.from_dtype(kind)[::1] for kind in (CLOCK, HELD, GRID, MOUNT))
to_ns: Any = compiled(_map_clock, numba.int64(_CLOCK, numba.int64, numba.int64))
keep: Any = compiled(_keep_reading, numba.boolean(_HELD, _I, numba.int64, numba.int64, numba.float64))
look: Any = entry(compiled(_look_at, numba.boolean(_HELD, _I, numba.int64, numba.float64[:, ::1])))


class Decoded(NamedTuple):
    """A batch: its events, and what they say."""

    t_ns: Integers
    kind: Bytes
    readings: Integers  # rows, and their values
    values: Floats
    samples: Integers


class Memory(NamedTuple):
    """What alignment goes on from: the arrays of a `Grid` and a `Hold`, always the same objects."""

    place: Integers
    grid: Any
    clock: Any
    held: Any
    heard: Integers
    listeners: Integers
    mounts: Any
    channels: Floats
    unmeasured_s: Floats
    own: Any
    waiting_u: Floats
    waiting_mm: Floats


@compiled
def _take_reading(memory: Memory, place: int, t_ns: int, value: float) -> bool:
    """Hold it and tell the models that it concerns; False when it is outside its range."""
    if not keep(memory.held, memory.heard, place, t_ns, value):
        return False
    if memory.held[place].trusted:
        for i in range(len(memory.listeners)):
            if memory.listeners[i, 0] == place:
                mount, channel = memory.listeners[i, 1], memory.listeners[i, 2]
                memory.channels[mount, channel], memory.unmeasured_s[mount, channel] = value, nan
    return True


@compiled
def _take_deformation(memory: Memory, m: int, sequence: int, deformation_mm: float) -> int:
    """One mount's part of a sample; -> a reason to stop, or DONE."""
    mount, mm, channels = memory.mounts[m], memory.waiting_mm[m], memory.channels[m]
    if not mount.low_mm <= deformation_mm <= mount.high_mm:
        mount.beyond = 1
        return SAMPLE_OUTSIDE
    if mount.waiting == len(mm):
        return FULL
    if mount.watchful or sequence != mount.sequence + 1:
        memory.grid[0].offered_mm = deformation_mm
        return CATCH_UP
    for i in range(len(channels)):
        memory.waiting_u[m, mount.waiting, i] = deformation_mm if memory.own[m, i] else channels[i]
    mm[mount.waiting] = deformation_mm
    mount.waiting += 1
    mount.sequence, mount.deformation_mm = sequence, deformation_mm
    return DONE


@compiled
def _take_sample(memory: Memory, t_ns: int, sample: Integers) -> int:
    """The rest of one sample, from place[PLACE_MOUNT] on; -> a reason to stop, or DONE when it was all."""
    state, place, mounts, sequence = memory.grid[0], memory.place, memory.mounts, sample[SEQUENCE]
    if place[PLACE_MOUNT] == TIME_FIRST:
        state.t_ns, state.sequence = to_ns(memory.clock, t_ns, sample[DEVICE_US]), sequence
        place[PLACE_MOUNT] = 0
        if state.resuming:
            state.resuming = 0
            return RESUME
    while place[PLACE_MOUNT] < len(mounts):
        m = place[PLACE_MOUNT]
        counts, stop = sample[COUNTS + mounts[m].channel], DONE
        if counts != CHANNEL_FAULT:
            deformation_mm = counts * mounts[m].scale_mm + mounts[m].offset_mm
            stop = _take_deformation(memory, m, sequence, deformation_mm)
        if stop != CATCH_UP and stop != FULL:
            place[PLACE_MOUNT] += 1
        if stop != DONE:
            return stop
    place[PLACE_SAMPLE] += 1
    place[PLACE_MOUNT] = TIME_FIRST
    per_step = state.samples_per_step
    if sequence >= state.next_step or sequence < state.next_step - 2 * per_step:
        state.next_step = sequence - sequence % per_step + per_step
        state.due_ns = state.t_ns
        return FUSE
    return DONE


@compiled
def _take_event(state: Any, t_ns: int, kind: int) -> int:
    """An event that is no frame."""
    if kind == FAULT:
        return OTHER_EVENT
    patience_ns = max(SILENT_NS, SILENT_SAMPLES * state.step_ns / state.samples_per_step)
    silent = t_ns - state.t_ns >= patience_ns
    if state.fused_ns < 0 or (silent and t_ns - state.fused_ns >= EARLY_STEP * state.step_ns):
        state.due_ns = t_ns
        return FUSE
    return DONE


def _align_batch(decoded: Decoded, memory: Memory) -> int:
    state, place, t_ns = memory.grid[0], memory.place, decoded.t_ns
    readings, samples = decoded.readings, decoded.samples
    while place[PLACE_EVENT] < len(decoded.kind):
        event, stop = place[PLACE_EVENT], DONE
        row, sample = place[PLACE_READING], place[PLACE_SAMPLE]
        if row < len(readings) and readings[row, EVENT] == event:
            place[PLACE_READING] += 1
            if readings[row, KIND] != GOOD:
                stop = CAN_FAULT
            elif not _take_reading(memory, readings[row, SLOT], t_ns[event], decoded.values[row]):
                stop = READING_OUTSIDE
        elif sample < len(samples) and samples[sample, EVENT] == event:
            if samples[sample, KIND] != GOOD:
                place[PLACE_SAMPLE] += 1
                stop = ADC_FAULT
            else:
                stop = _take_sample(memory, t_ns[event], samples[sample])
        else:
            place[PLACE_EVENT] += 1
            if decoded.kind[event] >= FAULT:
                stop = _take_event(state, t_ns[event], decoded.kind[event])
        if stop != DONE:
            return stop
    return DONE


_DECODED = named(Decoded, _I, numba.uint8[::1], _TABLE, _F, _TABLE)
_VALUES = numba.float64[:, ::1]
_MEMORY = named(
    Memory, _I, _GRID, _CLOCK, _HELD, _I, _TABLE, _MOUNT, _VALUES, _VALUES, numba.boolean[:, ::1],
    numba.float64[:, :, ::1], _VALUES,
)  # fmt: skip
align: Any = entry(compiled(_align_batch, numba.int64(_DECODED, _MEMORY)))
