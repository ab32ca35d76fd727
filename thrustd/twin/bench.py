"""The twin's test bench: a mount under a force-controlled cylinder, recorded as the thesis did.

`step_bench(hours, seed)` is the identification experiment (8 h to fit, 37 h to validate, 100 Hz); the other functions
give the sine, the multisine, the weight steps and programmes of `plan-test`. The mount starts at rest, the load cell
adds 12 N of noise, the cylinder's control lets the force wander by a few newtons which the mount does feel.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from thrustd.bench.programme import Levels, multisine, random_steps, sine
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.mount import UPPER, MountPhysics, advance, at_rest
from thrustd.twin.sensors import LOAD_CELL_STD_N, Lvdt, load_cell_reading, lvdt_reading

BLOCK = 1 << 20  # samples simulated at once: memory stays small over 37 h
DAY_S = 86400.0
MOST_HOURS = 1000.0  # of a record


class Rig(NamedTuple):
    """The bench around the mount."""

    sample_hz: float = 100.0
    load_cell_std_n: float = LOAD_CELL_STD_N
    lvdt: Lvdt = Lvdt()
    wander_n: float = 4.0  # the cylinder's control, one sigma of the true force
    wander_s: float = 0.5  # its correlation time
    room_degc: float = 20.0
    room_swing_k: float = 0.3  # day and night


RIG = Rig()


def step_bench(hours: float, seed: int, mount: MountPhysics = UPPER, rig: Rig = RIG) -> Recording:
    """Random force steps from 400 N to 6.5 kN, minutes each."""
    rng = np.random.default_rng(seed)
    return run_bench(f"steps_{hours:g}h_seed{seed}", random_steps(hours * 3600, rig.sample_hz, rng), seed, mount, rig)


def sine_bench(
    hours: float, seed: int, frequency_hz: float = 0.003, mount: MountPhysics = UPPER, rig: Rig = RIG
) -> Recording:
    """A slow sine over the same range (thesis 14.7)."""
    command_n = sine(hours * 3600, rig.sample_hz, frequency_hz)
    return run_bench(f"sine_{frequency_hz:g}Hz_seed{seed}", command_n, seed, mount, rig)


def multisine_bench(hours: float, seed: int, mount: MountPhysics = UPPER, rig: Rig = RIG) -> Recording:
    """Forty lines from 1 mHz to 1 Hz over the same range."""
    command_n = multisine(hours * 3600, rig.sample_hz, np.random.default_rng(seed))
    return run_bench(f"multisine_{hours:g}h_seed{seed}", command_n, seed, mount, rig)


def weight_bench(hours: float, seed: int, mount: MountPhysics = UPPER, rig: Rig = RIG) -> Recording:
    """Force steps while the normal load steps from 0 to 3 g every minute or so (thesis 12.1.2)."""
    rng = np.random.default_rng(seed)
    command_n = random_steps(hours * 3600, rig.sample_hz, rng)
    accel_z_g = random_steps(hours * 3600, rig.sample_hz, rng, Levels(0.0, 3.0, (40.0, 90.0), start=1.0))
    return run_bench(f"weight_{hours:g}h_seed{seed}", command_n, seed, mount, rig, accel_z_g)


def programme_bench(programme: Recording, seed: int, mount: MountPhysics = UPPER, rig: Rig = RIG) -> Recording:
    """A programme for a rig (`plan-test`): its force and, where it has one, its normal load, interpolated."""
    if "force_N" not in programme:
        raise RecordingError(f"{programme.name}: no force_N to command; expected a programme of `thrustd plan-test`")
    programme.at_most(MOST_HOURS * 3600.0)
    at_s = np.arange(round(programme.duration_s * rig.sample_hz) + 1) / rig.sample_hz + programme.time_s[0]
    columns = {
        name: np.interp(at_s, programme.time_s, programme[name])
        for name in ("force_N", "accel_z_g")
        if name in programme
    }
    if not all(np.isfinite(column).all() for column in columns.values()):
        raise RecordingError(f"{programme.name}: a command is missing or not a number; expected one in every row")
    return run_bench(f"{programme.name}_seed{seed}", columns["force_N"], seed, mount, rig, columns.get("accel_z_g"))


def run_bench(
    name: str,
    command_n: Floats,
    seed: int,
    mount: MountPhysics = UPPER,
    rig: Rig = RIG,
    accel_z_g: Floats | None = None,
) -> Recording:
    """Load the mount with `command_n` (n,) at the rig's rate and record it."""
    rng = np.random.default_rng([seed, 1])
    count = len(command_n)
    time_s = np.arange(count) / rig.sample_hz
    columns = {"time_s": time_s, "deformation_mm": np.empty(count), "force_N": np.empty(count)}
    columns["temperature_degC"] = rig.room_degc + rig.room_swing_k * np.sin(2 * np.pi * time_s / DAY_S)
    state = at_rest(mount)
    wander_n = 0.0
    for start in range(0, count, BLOCK):
        part = slice(start, start + BLOCK)
        walk_n, wander_n = _wander(rig, wander_n, len(time_s[part]), rng)
        force_n = command_n[part] + walk_n
        normal_g = 1.0 if accel_z_g is None else accel_z_g[part]
        true_mm = advance(mount, state, force_n, 1 / rig.sample_hz, columns["temperature_degC"][part], normal_g)
        columns["deformation_mm"][part] = lvdt_reading(rig.lvdt, true_mm, rng)
        columns["force_N"][part] = load_cell_reading(force_n, rng, rig.load_cell_std_n)
    if accel_z_g is not None:
        columns["accel_z_g"] = accel_z_g
    return make_recording(name, columns, {"source": "twin bench", "seed": str(seed)})


def _wander(rig: Rig, last_n: float, count: int, rng: np.random.Generator) -> tuple[Floats, float]:
    """First-order Gauss-Markov force error of the cylinder's control, going on from `last_n`."""
    keep = np.exp(-1 / (rig.sample_hz * rig.wander_s))
    kicks = rig.wander_n * np.sqrt(1 - keep**2) * rng.standard_normal(count)
    walk_n, _ = lfilter([1.0], [1.0, -keep], kicks, zi=[keep * last_n])
    return walk_n, float(walk_n[-1])
