"""What was decoded, put on the step grid in its order: readings held, the ADC's clock on ours, samples for the models.

The instants of the ADC are the grid. `Grid.align` walks through a batch up to the next thing that is not everyday;
what it does does not depend on how the events were batched.
"""

from math import nan
from typing import Any, Final

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
from thrustd.core.jit import compiled, entry
from thrustd.sync.memory import CLOCK, GRID, HELD, MOUNT

CRYSTAL_TOLERANCE = 100e-6  # two crystals drift apart by less than this, s/s
SILENT_AFTER_STEPS = 2.5  # no ADC sample for so many fused steps: ticks take over
EARLY_STEP = 0.75  # of a fused step: ticks jitter

# why `align` stopped
DONE, OTHER_EVENT, CAN_FAULT, ADC_FAULT, READING_OUTSIDE, SAMPLE_OUTSIDE, CATCH_UP, FULL, RESUME, FUSE = range(10)
# where it stopped: event, row of readings, row of samples; what is next of that sample: its time, then mount by mount
PLACE_EVENT, PLACE_READING, PLACE_SAMPLE, PLACE_MOUNT = range(4)
TIME_FIRST: Final = -1


def _map_clock(memory: Any, arrival_ns: int, device_time_us: int) -> int:
    clock = memory[0]
    device_ns = device_time_us * 1000
    delay_ns = arrival_ns - device_ns
    if not clock.known or device_ns < clock.device_ns:
        clock.known, clock.offset_ns = 1, delay_ns
    else:
        drift_ns = int((device_ns - clock.device_ns) * CRYSTAL_TOLERANCE)
        clock.offset_ns = min(clock.offset_ns + drift_ns, delay_ns)
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


@compiled
def _take_reading(held: Any, heard: Integers, place: int, t_ns: int, value: float, grid: Any) -> bool:
    """Hold it and tell the models that it concerns; False when it is outside its range."""
    listeners, channels, unmeasured_s = grid
    if not keep(held, heard, place, t_ns, value):
        return False
    if held[place].believed:
        for i in range(len(listeners)):
            if listeners[i, 0] == place:
                mount, channel = listeners[i, 1], listeners[i, 2]
                channels[mount, channel], unmeasured_s[mount, channel] = value, nan
    return True


@compiled
def _take_deformation(
    state: Any, mount: Any, sequence: int, deformation_mm: float, channels: Floats, own: Any, u: Floats, mm: Floats
) -> int:
    """One mount's part of a sample; -> a reason to stop, or DONE."""
    if not mount.low_mm <= deformation_mm <= mount.high_mm:
        mount.beyond = 1
        return SAMPLE_OUTSIDE
    if mount.waiting == len(mm):
        return FULL
    if mount.watchful or sequence != mount.sequence + 1:
        state.offered_mm = deformation_mm
        return CATCH_UP
    for i in range(len(channels)):
        u[mount.waiting, i] = deformation_mm if own[i] else channels[i]
    mm[mount.waiting] = deformation_mm
    mount.waiting += 1
    mount.sequence, mount.deformation_mm = sequence, deformation_mm
    return DONE


@compiled
def _take_sample(
    state: Any, clock: Any, t_ns: int, sample: Integers, place: Integers, mounts: Any, channels: Floats, own: Any,
    waiting_u: Floats, waiting_mm: Floats,
) -> int:  # fmt: skip
    """The rest of one sample, from place[PLACE_MOUNT] on; -> a reason to stop, or DONE when it was all."""
    sequence = sample[SEQUENCE]
    if place[PLACE_MOUNT] == TIME_FIRST:
        state.t_ns, state.sequence = to_ns(clock, t_ns, sample[DEVICE_US]), sequence
        place[PLACE_MOUNT] = 0
        if state.resuming:
            state.resuming = 0
            return RESUME
    while place[PLACE_MOUNT] < len(mounts):
        m = place[PLACE_MOUNT]
        counts, stop = sample[COUNTS + mounts[m].channel], DONE
        if counts != CHANNEL_FAULT:
            deformation_mm = counts * mounts[m].scale_mm + mounts[m].offset_mm
            stop = _take_deformation(
                state, mounts[m], sequence, deformation_mm, channels[m], own[m], waiting_u[m], waiting_mm[m]
            )
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
    silent = t_ns - state.t_ns >= SILENT_AFTER_STEPS * state.step_ns
    if state.fused_ns < 0 or (silent and t_ns - state.fused_ns >= EARLY_STEP * state.step_ns):
        state.due_ns = t_ns
        return FUSE
    return DONE


def _align_batch(
    t_ns: Integers, kind: Bytes, readings: Integers, values: Floats, samples: Integers, place: Integers, grid: Any,
    clock: Any, held: Any, heard: Integers, listeners: Integers, mounts: Any, channels: Floats, unmeasured_s: Floats,
    own: Any, waiting_u: Floats, waiting_mm: Floats,
) -> int:  # fmt: skip
    state = grid[0]
    while place[PLACE_EVENT] < len(kind):
        event, stop = place[PLACE_EVENT], DONE
        row, sample = place[PLACE_READING], place[PLACE_SAMPLE]
        if row < len(readings) and readings[row, EVENT] == event:
            place[PLACE_READING] += 1
            if readings[row, KIND] != GOOD:
                stop = CAN_FAULT
            elif not _take_reading(
                held, heard, readings[row, SLOT], t_ns[event], values[row], (listeners, channels, unmeasured_s)
            ):
                stop = READING_OUTSIDE
        elif sample < len(samples) and samples[sample, EVENT] == event:
            if samples[sample, KIND] != GOOD:
                place[PLACE_SAMPLE] += 1
                stop = ADC_FAULT
            else:
                stop = _take_sample(
                    state, clock, t_ns[event], samples[sample], place, mounts, channels, own, waiting_u, waiting_mm
                )
        else:
            place[PLACE_EVENT] += 1
            if kind[event] >= FAULT:
                stop = _take_event(state, t_ns[event], kind[event])
        if stop != DONE:
            return stop
    return DONE


_SIGNATURE = numba.int64(
    _I, numba.uint8[::1], _TABLE, _F, _TABLE, _I, _GRID, _CLOCK, _HELD, _I, _TABLE, _MOUNT, numba.float64[:, ::1],
    numba.float64[:, ::1], numba.boolean[:, ::1], numba.float64[:, :, ::1], numba.float64[:, ::1],
)  # fmt: skip
align: Any = entry(compiled(_align_batch, _SIGNATURE))
