"""How early can a drift be told at all? `python -m benchmarks.drift_bound [--aircraft 0 1 2]`.

The campaign's LVDTs that drift, beside the most that any look at the same rows could know: the drift's rate and its
onset are given, and nothing but it or all well is possible. With d what it does to every row and A the inverse of the
covariance of all errors that the bank allows when all is well (see `sensors.errors`)

    ln p(y | this drift) - ln p(y | all well) = d' A y - d' A d / 2

and it is found when that is above ln(odds of FOUND / prior): the bank's own prior and odds. Who finds it earlier has
to know the deck or the share of the load better than the bank does, or to believe in faults more readily.
"""

import argparse
import multiprocessing as mp
from collections.abc import Callable
from math import log
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fusion_flights import EVERY, installation, outputs_of
from benchmarks.integrity import FLOWN, SECONDS
from benchmarks.integrity_cases import CASES, Case
from benchmarks.integrity_flight import Flight, S, damaged, flight, whole
from thrustd.core.aircraft import Installed
from thrustd.core.columns import Floats
from thrustd.pipeline.pipeline import Pipeline
from thrustd.sensors.bank import FOUND
from thrustd.sensors.errors import Parts, covariance
from thrustd.sensors.onsets import LOWER_OFF, MOUNTS_OFF, NEW, UPPER_OFF, WELL
from thrustd.sensors.past import COUNTS, DECK_N, N_SOURCES, SAID, T_S

TOGETHER = 256  # events, some 0.6 s: how finely the times are known
RATE_MM_S = 0.02 / 60.0
MOUNTS = {"both": ((0, 1), MOUNTS_OFF), "+": ((0,), UPPER_OFF), "-": ((1,), LOWER_OFF)}  # who drifts in a case


class Found(NamedTuple):
    """Seconds since the drift began, what it is by then, N, and over the deck's one sigma in the bank's newest row."""

    after_s: float
    drift_n: float
    sigmas: float


class Bound(NamedTuple):
    """One case with one aircraft; None: not within the case."""

    fault: str
    moment: str
    by_bank: Found | None
    at_best: Found | None


def nats(rows: Floats, parts: Parts, installed: Installed, done_n: Floats) -> float:
    """ln p(y | what was done) - ln p(y | all well); `rows` (n, WIDTH), `done_n` (n, N_SOURCES)."""
    n = len(rows)
    bench = Installed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, installed.share, installed.couple_n_g)
    known = rows[:, COUNTS : COUNTS + N_SOURCES] != 0.0
    y, d = (np.where(known, each, 0.0).ravel() for each in (rows[:, SAID : SAID + N_SOURCES], done_n))
    return float(np.linalg.solve(covariance(rows, n, parts, bench), d) @ (y - d / 2.0))


def watched(flown: Flight, case: Case, pipeline: Pipeline, first: int, spring_n_mm: Floats) -> Bound:
    """One case, looked at as it goes on, until the bank and the one who knows have found it."""
    who, which = MOUNTS["both" if case.fault.startswith("both") else "+" if "+" in case.fault else "-"]
    rate_n_s = np.zeros(N_SOURCES)
    rate_n_s[list(who)] = (-1.0 if "-" in case.fault else 1.0) * RATE_MM_S * spring_n_mm[list(who)]
    begin_s = int(flown.wire.t_ns[first]) / S
    last = int(np.searchsorted(flown.wire.t_ns, (begin_s + case.seconds) * S))
    bank, events = pipeline._monitor.bank, damaged(flown, case.edit, first, last)
    share, enough = float(bank._engines.shares[0]), log(FOUND / (1.0 - FOUND) / NEW[which - 1])
    by_bank = at_best = None
    for at in range(0, len(events), TOGETHER):
        outputs_of(pipeline, events[at : at + TOGETHER], every=EVERY)
        past = bank._past[0]
        rows = past["rows"][: past["n"]]
        if len(rows) < 2:
            continue
        after_s = rows[:, T_S] - begin_s
        drift_n = float(after_s[0] * np.abs(rate_n_s).sum())
        now = Found(float(after_s[0]), drift_n, drift_n / float(rows[0, DECK_N]))
        done_n, parts = np.outer(np.maximum(after_s, 0.0), rate_n_s), (share, 1.0 - share, 1.0, 1.0, 1.0)
        if at_best is None and nats(rows, parts, bank._engines.installed, done_n) > enough:
            at_best = now
        if by_bank is None and bank.found[0] != WELL:
            by_bank = now
        if by_bank and at_best:
            break
    return Bound(case.fault, case.moment, by_bank, at_best)


def in_a_copy(work: Callable[[], Bound]) -> Bound:
    """With a copy of all that flies."""
    fork: Any = mp.get_context("fork")
    receive, send = fork.Pipe(duplex=False)
    child = fork.Process(target=lambda: send.send(work()))
    child.start()
    found: Bound = receive.recv()
    child.join()
    return found


def bounds(number: int, seed: int) -> list[Bound]:
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
            work = lambda case=case, first=first: watched(flown, case, pipeline, first, spring_n_mm)  # noqa: E731
            found.append(in_a_copy(work))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", type=int, nargs="+", default=range(len(FLOWN)))
    table = Table("fault", "moment", "aircraft", "found by the bank", "whoever knows rate and onset")
    for number in parser.parse_args().aircraft:
        for bound in bounds(*FLOWN[number]):
            said = [f"{f.after_s:.0f} s, {f.drift_n:.0f} N, {f.sigmas:.1f} sigma" if f else "-" for f in bound[2:]]
            table.add_row(bound.fault, bound.moment, str(FLOWN[number][1]), *said)
    Console().print(table)


if __name__ == "__main__":
    main()
