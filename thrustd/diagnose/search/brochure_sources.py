"""What mount and brochure say of the same thrust, in rows, and how far each may be wrong: no load cell flies.

    mount       share T + e_0 = model(deformation; effects) + (z + g d + 4 b r (1 - r)) dF/dd + p
    other       the same of the engine's other mount, where the log and its model are there
    brochure    T + e_i       = G_i - s F - l dF/dt - dF/d ln w sum c_jk x^j u^k      i: fuel flow, N1, N2
    x = F / (delta_t largest),   u = M / sqrt(1 + 0.2 M^2) / largest

z, g and b are zero, scale and bow of one transducer, r its reading d over its range. A tethered run does not tell g and
b from those of the engine's other mount. Both bend a force over its load, and an effect of one mount that the load
brings along (vibration) fits a bend as well. T of every row may be anything. e is one Gaussian over all rows of a
stretch, with the covariance that weighs sensors in flight (`sensors.errors`): an engine against its deck, the deck's
shape, lines of N1 and N2, lags of a thrust that moves. It forgets. What a deck is wrong by on every flight alike are s,
l and c, with priors: an engine is 3 % off its deck and half a second late, and it burns another fuel flow w for its
thrust, one that depends on thrust and speed. By how much recorded flights tell, each left out of the fit in turn: 4.8 %
between fuel flow and spools (APPETITE), and nobody knows which of the two the thrust follows. All c are alike and
together as large; j + k <= 2. So a deck is much better known at idle, where dF/d ln w is small, than at cruise, while a
nacelle drags alike: fast flight at idle tells.
What the rubber remembers when a stretch begins, p, is unknown: a log may begin in mid-flight (`identify.first_state`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from thrustd.brochure.deck import Deck, DeckRows
from thrustd.core.aircraft import MountPlace
from thrustd.core.atmosphere import stagnation, total_pressure_ratio
from thrustd.core.calibration import bowed
from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.compare.reference import deck_says
from thrustd.diagnose.search.aboard import Aboard
from thrustd.fusion.settings import FusionSettings
from thrustd.identify.first_state import of_the_past
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.sensors.errors import (
    APPETITE,
    AS_ON_THE_BENCH,
    LEAST_DECK_N,
    REACH_N,
    REST_S,
    WHITE_N,
    covariance,
)
from thrustd.sensors.errors import ENGINE as OF_ENGINE
from thrustd.sensors.past import (
    COUNTS,
    DECK_N,
    FUEL_FLOW,
    FUEL_RATE_N_S,
    LEVEL_N,
    LOG_FLOW,
    MACH,
    MOUNT_RATE_N_S,
    N_SOURCES,
    OWN_N,
    PER_FUEL_N,
    RATE_N_S,
    SAID,
    T_S,
    UPPER,
    WIDTH,
)  # fmt: skip

ROWS = 400  # of a stretch at most
ENGINE, LEAD_S = 0.0316, 0.5  # one sigma of s, l
POWERS = [(i, j) for i in range(3) for j in range(3 - i)]  # of x and u
ZERO_MM = 0.005  # of a transducer after `thrustd zero`: what friction in the mount holds, thesis figure 12.6
NUDGE_MM = 0.01  # for the slope of the force
MODEL_N = 10.0  # one sigma of a model that promises none
FLOWN = FusionSettings()  # a mount in its aircraft against its bench: friction, stiffness


@dataclass(frozen=True, slots=True)
class Sources:
    """One stretch in rows: readings of mount and brochure, one below the other, made white by their covariance."""

    segments: tuple[Segment, ...]  # as the mount that is judged read it, and the other one
    plain_n: tuple[Floats, ...]  # what their models say as they are
    width: int  # samples of a row
    lower: Floats  # Cholesky factor of the covariance of what counts
    counts: Flags  # (rows, N_SOURCES)
    said: Floats  # (rows, N_SOURCES), N, the mount's left at nothing
    unknowns: Floats  # (rows, N_SOURCES, n): columns of the numbers that the reference and the zero have, one sigma
    std_n: float  # of the difference between mount and its share of the fuel flow's thrust
    share: float

    @property
    def segment(self) -> Segment:
        """As the mount that is judged read it."""
        return self.segments[0]

    def white(self, table: Floats) -> Floats:
        """Readings (rows, N_SOURCES, ...) that count, made white."""
        counted = table[self.counts]
        return np.asarray(solve_triangular(self.lower, counted, lower=True)) if len(counted) else counted

    def without(self, rows: Flags) -> "Sources":
        """The same stretch; these rows do not count."""
        kept = ~rows[np.nonzero(self.counts)[0]]
        every = (self.lower @ self.lower.T)[np.ix_(kept, kept)]
        lower = np.asarray(np.linalg.cholesky(every), np.float64)
        return replace(self, counts=self.counts & ~rows[:, None], lower=lower)

    def of_mounts(self, forces_n: Sequence[Floats]) -> Floats:
        """Readings (rows, N_SOURCES) that are the mounts' alone, of their forces (n,)."""
        table = np.zeros(self.said.shape)
        for slot, force_n in enumerate(forces_n):
            table[:, slot] = means(force_n, self.width)
        return table


def means(column: Floats, width: int) -> Floats:
    m = len(column) // width * width
    found: Floats = column[:m].reshape(-1, width).mean(axis=1)
    return found


def sources_of(mounts: Sequence[Aboard], deck: Deck) -> list[Sources]:
    """Of the mount that is judged and the other one of its engine, where it is there."""
    place, stretches = mounts[0].place, list(zip(*(mount.segments for mount in mounts), strict=True))
    plain = [[m.run(m.spec, s) for m, s in zip(mounts, stretch, strict=True)] for stretch in stretches]
    widths = [max(1, -(-len(stretch[0]) // ROWS)) for stretch in stretches]
    own_n = [float(np.median(m.spec.error.std_n)) if m.spec.error is not None else MODEL_N for m in mounts]
    tables = [_table(s[0], p, w, own_n, deck, place) for s, p, w in zip(stretches, plain, widths, strict=True)]
    wrong = _of_deck(stretches, widths, tables)
    unknown = [_of_mount(mount, widths) for mount in mounts]
    ends, found = np.cumsum([len(table) for table in tables]), []
    for stretch, said_n, width, table, end in zip(stretches, plain, widths, tables, ends, strict=True):
        columns = np.zeros((len(table), N_SOURCES, wrong.shape[1]))
        columns[:, FUEL_FLOW:] = -wrong[end - len(table) : end, None, :]
        for slot, every in enumerate(unknown):
            own = np.zeros((len(table), N_SOURCES, every.shape[1]))
            own[:, slot] = every[end - len(table) : end]
            columns = np.concatenate((columns, own), axis=2)
        found.append(_sources(stretch, said_n, width, table, columns, place.share))
    return found


def _of_mount(mount: Aboard, widths: Sequence[int]) -> Floats:
    """Columns of one mount over the rows of all stretches: its transducer's zero, scale and bow, its past in each."""
    range_mm = mount.spec.valid.deformation_mm[1]
    stds_mm = np.array([ZERO_MM, *mount.place.calibration.line_stds(range_mm)])

    def run(segment: Segment) -> Floats:
        return mount.run(mount.spec, segment)

    line, past = [], []
    for segment, width in zip(mount.segments, widths, strict=True):
        mm = segment.inputs[DEFORMATION]
        nudged = {**segment.inputs, DEFORMATION: mm + NUDGE_MM}
        slope = (run(replace(segment, inputs=nudged)) - run(segment)) / NUDGE_MM
        shapes = np.column_stack((np.ones(len(mm)), mm, bowed(mm / range_mm)))
        line.append(_means_of(slope[:, None] * shapes * stds_mm, width))
        past.append(_means_of(of_the_past(run, segment), width))
    return np.column_stack((np.concatenate(line), block_diag(*past)))


def _means_of(columns: Floats, width: int) -> Floats:
    return np.column_stack([means(column, width) for column in columns.T])


def _sources(
    stretch: tuple[Segment, ...], plain_n: Sequence[Floats], width: int, table: Floats, unknowns: Floats, share: float
) -> Sources:
    counts = np.asarray(table[:, COUNTS : COUNTS + N_SOURCES] != 0.0)
    parts = share, 1.0 - share, 1.0, 1.0, 1.0
    lasting = table.copy()
    lasting[:, DECK_N] = 0.0  # a deck's shape over flights is c
    every = covariance(lasting, len(table), parts, AS_ON_THE_BENCH) + _wander(table)
    mount, fuel = np.arange(len(table)) * N_SOURCES + UPPER, np.arange(len(table)) * N_SOURCES + FUEL_FLOW
    apart_n2 = every[mount, mount] - 2 * share * every[mount, fuel] + share**2 * every[fuel, fuel]
    every[np.diag_indices_from(every)] -= np.tile(np.square(WHITE_N), len(table)) * (
        1.0 - 1.0 / width
    )  # rows are means
    kept = np.flatnonzero(counts)
    said = np.where(counts, table[:, SAID : SAID + N_SOURCES], 0.0)
    said[:, :FUEL_FLOW] = 0.0
    lower = np.linalg.cholesky(every[np.ix_(kept, kept)])
    judged = counts[:, FUEL_FLOW]
    std_n = float(np.sqrt(np.mean(apart_n2[judged]))) if judged.any() else 0.0
    return Sources(stretch, tuple(plain_n), width, lower, counts, said, unknowns, std_n, share)


def _wander(table: Floats) -> Floats:
    """Covariance of what all of the brochure is wrong by for minutes: the deck's sigma less that of its engine."""
    time_s, level_n = table[:, T_S], np.abs(table[:, LEVEL_N])
    shape_n = np.sqrt(np.maximum(table[:, DECK_N] ** 2 - (OF_ENGINE * level_n) ** 2, LEAST_DECK_N**2))
    far = np.abs(np.subtract.outer(time_s, time_s)) / REST_S
    far = far + np.abs(np.subtract.outer(level_n, level_n)) / REACH_N
    brochure = np.zeros(N_SOURCES)
    brochure[FUEL_FLOW:] = 1.0
    return np.kron(np.exp(-far) * np.outer(shape_n, shape_n), np.outer(brochure, brochure))


def _table(
    segment: Segment, models_n: Sequence[Floats], width: int, own_n: Sequence[float], deck: Deck, place: MountPlace
) -> Floats:
    """Rows (n, WIDTH) as the bank of sensors keeps them (`sensors.past`), means over `width` samples."""
    asked = deck_says(segment.inputs, segment.time_s, deck, place.number)
    says = DeckRows(*(means(column, width) for column in asked))
    brochure = np.column_stack((says.fuel_flow_n, says.n1_n, says.n2_n))
    of_deck = np.stack((says.std_n, says.middle_per_fuel_n, says.middle_log_flow))
    told = np.all(np.isfinite(of_deck), axis=0, keepdims=True).T
    told &= np.isfinite(means(segment.force_n, width))[:, None]  # inputs are bridged in holes, which say nothing
    mount_n, time_s = means(models_n[0], width), means(segment.time_s, width)
    table = np.zeros((len(mount_n), WIDTH))
    level_n = np.where(
        np.isfinite(says.thrust_n), says.thrust_n, mount_n / place.share
    )  # an effect may be hidden in a mount
    table[:, T_S], table[:, LEVEL_N] = time_s, level_n
    table[:, RATE_N_S] = table[:, MOUNT_RATE_N_S] = means(np.gradient(models_n[0] / place.share, segment.dt_s), width)
    table[:, FUEL_RATE_N_S] = np.nan_to_num(means(np.gradient(asked.fuel_flow_n, segment.dt_s), width))
    table[:, MACH] = means(segment.inputs["mach"], width)
    table[:, DECK_N], table[:, PER_FUEL_N], table[:, LOG_FLOW] = np.nan_to_num(of_deck)
    table[:, SAID + FUEL_FLOW : COUNTS] = np.nan_to_num(brochure)
    for slot, (model_n, one_n) in enumerate(zip(models_n, own_n, strict=True)):
        table[:, SAID + slot], table[:, COUNTS + slot] = means(model_n, width), 1.0
        stiffness_n = FLOWN.mount_stiffness_std * table[:, SAID + slot]
        table[:, OWN_N + slot] = np.hypot(np.hypot(one_n, FLOWN.mount_friction_std_n), stiffness_n)
    table[:, COUNTS + FUEL_FLOW : COUNTS + N_SOURCES] = np.isfinite(brochure) * told
    return table


def _of_deck(stretches: Sequence[tuple[Segment, ...]], widths: Sequence[int], tables: Sequence[Floats]) -> Floats:
    """Columns (rows, n) of s, l and c over the rows of all stretches, one sigma each."""
    airs = [_air(stretch[0], width) for stretch, width in zip(stretches, widths, strict=True)]
    every, (delta, speed) = np.concatenate(tables), np.concatenate(airs, axis=1)
    x, u = (one / np.max(np.abs(one)) for one in (every[:, LEVEL_N] / delta, speed))
    surface = np.column_stack([x**i * u**j for i, j in POWERS])
    surface *= APPETITE / np.sqrt(np.mean(np.sum(surface**2, axis=1)))
    lasting = ENGINE * every[:, LEVEL_N], LEAD_S * every[:, RATE_N_S], surface * every[:, PER_FUEL_N, None]
    return np.column_stack(lasting)


def _air(segment: Segment, width: int) -> Floats:
    """delta_t and u (2, rows)."""
    mach, altitude_m = (means(segment.inputs[name], width) for name in ("mach", "pressure_altitude_m"))
    return np.stack((total_pressure_ratio(mach, altitude_m), mach / np.sqrt(stagnation(mach))))
