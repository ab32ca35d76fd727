"""Hide an effect: a bench record without it, a measured and a held-out record with it, and the truth in a sealed file.

The mount is quasi-linear viscoelastic with three relaxation times and cubic stiffening, every seed another one; the
LVDT has steps of 5 mm / 2^16, the load cell 12 N of noise; 20 Hz, two hours each. `strength` is the RMS of the
disturbance over the measured record, as force, in units of what a good model of this mount leaves on its bench.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import UsageError
from thrustd.core.measures import rms
from thrustd.records.files import write_recording
from thrustd.records.recording import Recording, make_recording
from thrustd.sinks.whole_file import write_whole
from thrustd.twin.disturbance import DISTURBANCES, UNLISTED, Disturbance, Scene, Shape
from thrustd.twin.environment import Channels, bench_force_n, flight_force_n, moving, quiet
from thrustd.twin.mount import UPPER, MountPhysics
from thrustd.twin.sensors import COARSE_COUNT_MM, Lvdt, load_cell_reading, lvdt_reading

SAMPLE_HZ = 20.0
SECONDS = 7200.0
MODEL_ERROR_N = 15.0  # RMS of a good Hammerstein model on the quiet bench, 12 N of it load cell
TRUTH = "truth.json"
DIGITS = {"n1_pct": 2, "pressure_altitude_m": 1, "dynamic_pressure_Pa": 1, "hydraulic_pressure_bar": 2}
SCALINGS = 6  # at most: secant steps to the wanted size


@dataclass(frozen=True, slots=True)
class Hidden:
    """One effect at its final size."""

    name: str
    kind: Disturbance
    amplitude: float
    shape: Shape


@dataclass(frozen=True, slots=True)
class Case:
    """The records of one seed, and what is in them."""

    bench: Recording
    measured: Recording
    heldout: Recording
    truth: dict[str, Any]


def hide(effects: tuple[str, ...], seed: int, strength: float, out_dir: Path, seconds: float = SECONDS) -> None:
    """Write bench.csv, measured.csv, heldout.csv and truth.json into `out_dir`, made when absent."""
    case = hidden_case(effects, seed, strength, seconds)
    try:
        out_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{out_dir}: cannot be made: {error.strerror}") from None
    for record in (case.bench, case.measured, case.heldout):
        write_recording(record, out_dir / f"{record.name}.csv")
    write_whole(out_dir / TRUTH, json.dumps(case.truth, indent=2) + "\n")


def hidden_case(
    effects: tuple[str, ...], seed: int, strength: float, seconds: float = SECONDS, flight: int = 0
) -> Case:
    """The same in memory. `effects`: names of ICD section 4, or `none`, or `unknown` for one that has no name.

    `flight` numbers further pairs of flights of the same mount after the same bench.
    """
    rng = np.random.default_rng([seed, 6])
    mount = draw_mount(rng)
    kinds = _kinds(effects, rng)
    force_n = bench_force_n(seconds, SAMPLE_HZ, rng)
    bench = _record("bench", force_n, quiet(len(force_n), SAMPLE_HZ), mount, (), rng)
    rng = np.random.default_rng([seed, 6, flight]) if flight else rng
    flights = []
    for _ in range(2):
        force_n = flight_force_n(seconds, SAMPLE_HZ, rng)
        flights.append((force_n, moving(force_n, SAMPLE_HZ, rng)))
    hidden = tuple(_sized(name, kind, mount, *flights[0], strength * MODEL_ERROR_N, rng) for name, kind in kinds)
    measured = _record("measured", *flights[0], mount, hidden, rng)
    heldout = _record("heldout", *flights[1], mount, hidden, rng)
    return Case(bench, measured, heldout, _truth(effects, hidden, mount, flights, seed, strength))


def draw_mount(rng: np.random.Generator) -> MountPhysics:
    """A mount of the upper one's size, without friction, on a rigid bracket, blind to weight and warmth."""
    k1 = float(rng.uniform(4300, 5100))
    return UPPER._replace(
        stiffness_n_mm=k1,
        cubic_n_mm3=k1 * float(rng.uniform(0.1, 0.3)),
        relaxation=tuple(float(g) for g in rng.uniform(0.02, 0.07, 3)),
        relaxation_s=(float(rng.uniform(0.2, 0.6)), float(rng.uniform(8, 30)), float(rng.uniform(200, 900))),
        friction_n=(),
        friction_mm=(),
        bracket_n_mm=1e9,
        softening_per_k=0.0,
        expansion_mm_k=0.0,
        weight_gain_per_g=0.0,
    )


def _kinds(effects: tuple[str, ...], rng: np.random.Generator) -> list[tuple[str, Disturbance]]:
    chosen: list[tuple[str, Disturbance]] = []
    for name in effects:
        if name == "unknown":
            name = str(rng.choice(sorted(UNLISTED)))
        if name == "none" and len(effects) == 1:
            return []
        kind = DISTURBANCES.get(name) or UNLISTED.get(name)
        if kind is None:
            raise UsageError(f"cannot hide {name!r}: expected {', '.join((*DISTURBANCES, *UNLISTED))}, unknown or none")
        chosen.append((name, kind))
    return chosen


def _deformation_mm(force_n: Floats, channels: Channels, mount: MountPhysics, hidden: tuple[Hidden, ...]) -> Floats:
    scene = Scene(force_n, channels, 1 / SAMPLE_HZ, mount)
    for effect in hidden:
        effect.kind.apply(scene, effect.amplitude, effect.shape)
    return scene.deformation_mm()


def _sized(
    name: str,
    kind: Disturbance,
    mount: MountPhysics,
    force_n: Floats,
    channels: Channels,
    wanted_n: float,
    rng: np.random.Generator,
) -> Hidden:
    """Scale the amplitude until the disturbance has the wanted RMS as force."""
    shape = {key: float(rng.uniform(low, high)) for key, low, high in kind.shape}
    amplitude = kind.start * float(rng.choice((-1.0, 1.0)) if kind.signed else 1.0)
    plain_mm = _deformation_mm(force_n, channels, mount, ())
    for _ in range(SCALINGS):
        changed_mm = _deformation_mm(force_n, channels, mount, (Hidden(name, kind, amplitude, shape),))
        factor = wanted_n / force_rms_n(mount, plain_mm, changed_mm)
        amplitude *= factor
        if abs(factor - 1) < 1e-3:
            break
    return Hidden(name, kind, amplitude, shape)


def force_rms_n(mount: MountPhysics, plain_mm: Floats, changed_mm: Floats) -> float:
    """RMS [N] of a change of deformation (n,) times the local stiffness."""
    stiffness_n_mm = mount.stiffness_n_mm + 3 * mount.cubic_n_mm3 * plain_mm**2
    return rms(stiffness_n_mm * (changed_mm - plain_mm))


def _record(
    name: str,
    force_n: Floats,
    channels: Channels,
    mount: MountPhysics,
    hidden: tuple[Hidden, ...],
    rng: np.random.Generator,
) -> Recording:
    lvdt = Lvdt(noise_mm=2e-5, count_mm=COARSE_COUNT_MM)
    read_mm = lvdt_reading(lvdt, _deformation_mm(force_n, channels, mount, hidden), rng)
    columns = {
        "time_s": np.arange(len(force_n)) / SAMPLE_HZ,
        "deformation_mm": np.round(read_mm, 7),
        "force_N": np.round(load_cell_reading(force_n, rng), 2),
    }
    columns |= {channel: np.round(values, DIGITS.get(channel, 4)) for channel, values in channels.items()}
    return make_recording(name, columns, {"source": "twin"})


def _truth(
    effects: tuple[str, ...],
    hidden: tuple[Hidden, ...],
    mount: MountPhysics,
    flights: list[tuple[Floats, Channels]],
    seed: int,
    strength: float,
) -> dict[str, Any]:
    plain_mm = [_deformation_mm(*flight, mount, ()) for flight in flights]
    sizes = {
        effect.name: [
            round(force_rms_n(mount, plain, _deformation_mm(*flight, mount, (effect,))), 2)
            for plain, flight in zip(plain_mm, flights, strict=True)
        ]
        for effect in hidden
    }
    listed = [effect.name for effect in hidden if effect.name in DISTURBANCES]
    strangers = [effect for effect in hidden if effect.name in UNLISTED]
    return {
        "effects": [effect.name for effect in hidden],
        "verdict": [*listed, *(["unknown"] if strangers else [])] or ["none"],
        "depends_on": [channel for effect in strangers for channel in effect.kind.depends_on],
        "parameters": {effect.name: {effect.kind.parameter: effect.amplitude, **effect.shape} for effect in hidden},
        "force_rms_n": sizes,  # measured, held out
        "asked": list(effects),
        "seed": seed,
        "strength": strength,
        "model_error_n": MODEL_ERROR_N,
        "mount": mount._asdict(),
    }
