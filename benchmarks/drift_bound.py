"""How early can a drift be told at all? `python -m benchmarks.drift_bound [--aircraft 0 1 2] [--looks]`.

The campaign's LVDTs that drift, beside the most that any look at the same rows could know: the drift's rate and its
onset are given, and nothing but it or all well is possible. With d what it does to every row and A the inverse of the
covariance of all errors that the bank allows when all is well (see `sensors.errors`)

    ln p(y | this drift) - ln p(y | all well) = d' A y - d' A d / 2

and it is found when that is above ln(odds of FOUND / prior): the bank's own prior and odds. Who finds it earlier has
to know the deck or the share of the load better than the bank does, or to believe in faults more readily. One mount is
named when that is so and it leads by the odds of FOUND the other mount, which drifts to the other side (r: by a newton
a second) at the rate that fits best:

    ln p(y | this one) - ln p(y | the other) = d' A y - d' A d / 2 - max(r' A y, 0)^2 / (2 r' A r)

`--looks`: the same in the mean over all errors, y = d, of looks that the bank does not have (see `drift_looks`).
"""

import argparse
import multiprocessing as mp
from collections.abc import Callable, Iterator
from functools import partial
from math import log
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.drift_looks import LOOKS, Rows, errors_of, heard, own_errors
from benchmarks.fusion_flights import EVERY, installation, outputs_of
from benchmarks.integrity import FLOWN, SECONDS
from benchmarks.integrity_cases import CASES, Case
from benchmarks.integrity_flight import Flight, S, damaged, flight, whole
from thrustd.core.columns import Floats
from thrustd.fusion.mixture import P
from thrustd.pipeline.pipeline import Pipeline
from thrustd.sensors.bank import Bank
from thrustd.sensors.lead import FOUND
from thrustd.sensors.onsets import LOWER_OFF, MOUNTS_OFF, NEW, UPPER_OFF, WELL
from thrustd.sensors.past import DECK_N, N_SOURCES, SAID, T_S

TOGETHER = 256  # events, some 0.6 s: how finely the times are known
RATE_MM_S = 0.02 / 60.0
MOUNTS = {"both": ((0, 1), MOUNTS_OFF), "+": ((0,), UPPER_OFF), "-": ((1,), LOWER_OFF)}  # who drifts in a case
ODDS = log(FOUND / (1.0 - FOUND))
WIDE = 220  # of the table
BANK, EITHER, KNOWS, NAMES = "bank", "bank: one of the two", "knows rate and onset", "and tells which"


class Found(NamedTuple):
    """Seconds since the drift began, what it is by then, N, and over the deck's one sigma in the bank's newest row."""

    after_s: float
    drift_n: float
    sigmas: float


class Bound(NamedTuple):
    """One case with one aircraft; who is not in `found` did not within the case."""

    fault: str
    moment: str
    found: dict[str, Found]


class Drift(NamedTuple):
    """What a case does to an engine's sources."""

    begin_s: float
    rate_n_s: Floats  # (N_SOURCES,)
    rival_n_s: Floats  # of the other mount that it may be taken for; zero: of none
    which: int  # hypothesis

    def done_n(self, rows: Floats) -> Floats:
        """(1 or 2, 5 n): by it, and by a rival of one newton a second."""
        after_s = np.maximum(rows[:, T_S] - self.begin_s, 0.0)
        each = (self.rate_n_s, self.rival_n_s) if self.rival_n_s.any() else (self.rate_n_s,)
        return np.stack([np.outer(after_s, rate_n_s).ravel() for rate_n_s in each])


def nats(errors: Floats, said_n: Floats, done_n: Floats) -> tuple[float, float]:
    """ln p(y | what was done) - ln p(y | all well), and how far it leads its rival.

    `errors` (m, m); `said_n` (m,); `done_n` (1 or 2, m): see `Drift`.
    """
    a = np.linalg.solve(errors, done_n.T)
    to_y, to_each = a.T @ said_n, done_n @ a
    told = float(to_y[0] - to_each[0, 0] / 2.0)
    if len(done_n) == 1:
        return told, np.inf
    return told, told - float(max(to_y[1], 0.0) ** 2 / (2.0 * to_each[1, 1]))


def answers(drift: Drift, bank: Bank, looks: bool) -> Iterator[str]:
    """Who has found it by now."""
    shares = bank._engines.shares.tolist()
    own, other = (
        Rows(past["rows"][: past["n"]], share) for past, share in zip(bank._past[:2], shares[:2], strict=True)
    )
    if len(own.rows) < 2 or len(other.rows) < 2:
        return
    installed, enough = bank._engines.installed, ODDS - log(NEW[drift.which - 1])
    likely = bank.rows[0, :, P]
    if bank.found[0] != WELL:
        yield BANK
    if drift.which != MOUNTS_OFF and likely[UPPER_OFF] + likely[LOWER_OFF] > FOUND:
        yield EITHER
    done_n, counts = drift.done_n(own.rows) * heard(own), heard(own)
    told, leads = nats(own_errors(own, installed), own.rows[:, SAID : SAID + N_SOURCES].ravel() * counts, done_n)
    if told > enough:
        yield KNOWS
        if leads > ODDS and drift.which != MOUNTS_OFF:
            yield NAMES
    for look in LOOKS if looks else ():
        errors = errors_of(look, own, other, installed)
        seen_n = np.zeros((len(done_n), len(errors)))
        seen_n[:, : done_n.shape[1]] = done_n
        told, leads = nats(errors, seen_n[0], seen_n)
        if told > enough and leads > ODDS:
            yield look.name


def watched(flown: Flight, case: Case, pipeline: Pipeline, first: int, drift: Drift, looks: bool) -> Bound:
    """One case, looked at as it goes on."""
    last = int(np.searchsorted(flown.wire.t_ns, (drift.begin_s + case.seconds) * S))
    bank, events = pipeline._monitor.bank, damaged(flown, case.edit, first, last)
    found = dict[str, Found]()
    for at in range(0, len(events), TOGETHER):
        outputs_of(pipeline, events[at : at + TOGETHER], every=EVERY)
        newest = bank._past[0]["rows"][0]
        after_s = float(newest[T_S]) - drift.begin_s
        drift_n = after_s * float(np.abs(drift.rate_n_s).sum())
        for who in answers(drift, bank, looks):
            found.setdefault(who, Found(after_s, drift_n, drift_n / float(newest[DECK_N])))
    return Bound(case.fault, case.moment, found)


def drift_of(case: Case, begin_s: float, spring_n_mm: Floats) -> Drift:
    who, which = MOUNTS["both" if case.fault.startswith("both") else "+" if "+" in case.fault else "-"]
    sign, rate_n_s, rival_n_s = -1.0 if "-" in case.fault else 1.0, np.zeros(N_SOURCES), np.zeros(N_SOURCES)
    rate_n_s[list(who)] = sign * RATE_MM_S * spring_n_mm[list(who)]
    if which != MOUNTS_OFF:
        rival_n_s[1 - who[0]] = -sign
    return Drift(begin_s, rate_n_s, rival_n_s, which)


def in_a_copy(work: Callable[[], Bound]) -> Bound:
    """With a copy of all that flies."""
    fork: Any = mp.get_context("fork")
    receive, send = fork.Pipe(duplex=False)
    child = fork.Process(target=lambda: send.send(work()))
    child.start()
    found: Bound = receive.recv()
    child.join()
    return found


def bounds(number: int, seed: int, looks: bool) -> list[Bound]:
    """All drifts of the left engine's LVDTs with one aircraft."""
    place = installation()
    flown, pipeline, at, found = flight(place, number, seed, SECONDS), place.pipeline(), 0, list[Bound]()
    spring_n_mm = np.array(place.parts().aircraft.spring_n_mm)
    cases = [case for case in CASES if "drift" in case.fault and "LVDT" in case.fault and "all four" not in case.fault]
    for moment, moment_s in sorted(flown.moments_s.items(), key=lambda item: item[1]):
        first = int(np.searchsorted(flown.wire.t_ns, round(moment_s * S)))
        mine = [case for case in cases if case.moment == moment]
        if mine:
            outputs_of(pipeline, whole(flown, at, first), every=EVERY)
            at = first
        for case in mine:
            drift = drift_of(case, int(flown.wire.t_ns[first]) / S, spring_n_mm)
            found.append(in_a_copy(partial(watched, flown, case, pipeline, first, drift, looks)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", type=int, nargs="+", default=range(len(FLOWN)))
    parser.add_argument("--looks", action="store_true")
    arguments = parser.parse_args()
    columns = (BANK, EITHER, KNOWS, NAMES, *(look.name for look in LOOKS if arguments.looks))
    table = Table("fault", "moment", "aircraft", *columns)
    for number in arguments.aircraft:
        for bound in bounds(*FLOWN[number], arguments.looks):
            said = [bound.found.get(who) for who in columns]
            cells = [f"{f.after_s:.0f} s, {f.drift_n:.0f} N, {f.sigmas:.1f} sigma" if f else "-" for f in said]
            table.add_row(bound.fault, bound.moment, str(FLOWN[number][1]), *cells)
    Console(width=WIDE).print(table)


if __name__ == "__main__":
    main()
