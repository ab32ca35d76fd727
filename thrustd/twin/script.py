"""What the scripted pilot does: phases with throttles, path, load factor and bank, drawn from a seed."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.twin.engine import IDLE_N1_PCT, TAKE_OFF_N1_PCT

FREE = float("nan")  # load factor: whatever the path needs


class Phase(NamedTuple):
    seconds: float
    n1_left: float
    n1_right: float
    gamma_deg: float = 0.0
    load_g: float = FREE
    bank_deg: float = 0.0
    brake: float = 0.0


class Commands(NamedTuple):
    """The phases sample by sample, each (n,)."""

    n1_left: Floats
    n1_right: Floats
    gamma_rad: Floats
    load_g: Floats
    bank_rad: Floats
    brake: Floats


def draw_commands(seconds: float, sample_hz: float, rng: np.random.Generator) -> Commands:
    """Departure, then random manoeuvres until `seconds` are full; cut to that length."""
    phases: list[Phase] = []
    for phase in _flight(rng):
        phases.append(phase)
        if sum(p.seconds for p in phases) >= seconds:
            break
    counts = [round(p.seconds * sample_hz) for p in phases]
    table = np.repeat(np.array(phases)[:, 1:], counts, axis=0)[: round(seconds * sample_hz)]
    left, right, gamma, load, bank, brake = (np.ascontiguousarray(column) for column in table.T)
    return Commands(left, right, np.radians(gamma), load, np.radians(bank), brake)


def _flight(rng: np.random.Generator) -> Iterator[Phase]:
    idle, full = IDLE_N1_PCT, TAKE_OFF_N1_PCT
    yield Phase(float(rng.uniform(15, 25)), 0.0, 0.0, brake=1.0)
    yield Phase(12.0, idle, 0.0, brake=1.0)
    yield Phase(float(rng.uniform(35, 45)), idle, idle, brake=1.0)
    yield Phase(float(rng.uniform(40, 60)), full, full, gamma_deg=8.0)
    climb = float(rng.uniform(88, 95))
    yield Phase(float(rng.uniform(60, 150)), climb, climb, gamma_deg=5.0)
    draws = (_steps, _steps, _split, _turn, _pull_up, _parabola, _descent)
    while True:
        order = rng.permutation(len(draws))
        for number in order:
            yield from draws[number](rng)


def _steps(rng: np.random.Generator) -> Iterator[Phase]:
    for _ in range(int(rng.integers(2, 5))):
        n1 = float(rng.uniform(50, TAKE_OFF_N1_PCT))
        yield Phase(float(rng.uniform(12, 45)), n1, n1, gamma_deg=0.2 * (n1 - 74))


def _split(rng: np.random.Generator) -> Iterator[Phase]:
    one, other = (float(x) for x in rng.uniform(50, 95, 2))
    yield Phase(float(rng.uniform(15, 30)), one, other)


def _turn(rng: np.random.Generator) -> Iterator[Phase]:
    n1 = float(rng.uniform(75, 90))
    bank = float(rng.uniform(25, 50) * rng.choice((-1, 1)))
    yield Phase(float(rng.uniform(20, 40)), n1, n1, bank_deg=bank)


def _pull_up(rng: np.random.Generator) -> Iterator[Phase]:
    n1 = float(rng.uniform(70, 95))
    load = float(rng.uniform(1.4, 2.0))
    yield Phase(8.0, n1, n1, gamma_deg=-6.0)
    yield Phase(5.0, n1, n1, load_g=load)
    yield Phase(4.0, n1, n1, load_g=float(rng.uniform(0.3, 0.7)))
    yield Phase(15.0, n1, n1)


def _parabola(rng: np.random.Generator) -> Iterator[Phase]:
    """Dive for speed, pull up at 1.8 g, 10 s of weightlessness at reduced thrust, recover."""
    part = float(rng.uniform(50, 65))
    yield Phase(12.0, 92.0, 92.0, gamma_deg=-10.0)
    yield Phase(9.0, 92.0, 92.0, load_g=1.8)
    yield Phase(10.0, part, part, load_g=0.02)
    yield Phase(8.0, part, part, load_g=1.8)
    yield Phase(20.0, 85.0, 85.0)


def _descent(rng: np.random.Generator) -> Iterator[Phase]:
    yield Phase(float(rng.uniform(20, 45)), IDLE_N1_PCT, IDLE_N1_PCT, gamma_deg=-5.0)
    yield Phase(float(rng.uniform(15, 30)), 90.0, 90.0, gamma_deg=4.0)
