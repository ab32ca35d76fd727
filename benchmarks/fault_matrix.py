"""Every fault at several moments of a flight: `python -m benchmarks.fault_matrix --minutes 2.5 --moments 3`.

A twin flight is replayed once as it was; at every moment the pipeline is copied, and each fault is flown on from there
with its log damaged:

    goes on      largest pause between two estimates of one engine
    seen         the fault is reported by its name, and its status bit is on
    band honest  share of estimates, fault to end, with the twin's true thrust inside their 95 % band; beside it the
                 same share of the whole sensors, at the same instants
    worst        largest error against the truth in that time
    recovered    largest difference from the good run in the last seconds, newtons, and in standard deviations of both
"""

import argparse
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import hypot
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import track

from benchmarks.damage import CASES, CONTRADICTIONS, Case, whole_frames
from benchmarks.fusion_flights import Said, outputs_of
from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Estimate, Event, Status
from thrustd.installation.installation import Installation, read_installation
from thrustd.pipeline.pipeline import Parts, Pipeline
from thrustd.twin.flight import Truth, fly, scripted_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

S = 1_000_000_000
SETTLE_S = 12.0  # from the end of the fault to the recovered part
TAIL_S = 3.0


class Verdict(NamedTuple):
    """One cell of the matrix."""

    longest_pause_s: float
    reported: bool
    flagged: bool
    inside_95: float  # share of estimates with the truth in their band, 0 to 1
    whole_inside_95: float  # the same without the fault, at the same instants
    further_sigma: float  # by how much the error, in its own sigmas, is at most larger than without the fault
    worst_n: float  # against the truth
    off_n: float
    off_sigma: float
    still_flagged: bool  # installation bits at the end


class Flight(NamedTuple):
    """What the wire said, and the true thrust by engine: rows of time [ns] and thrust [N], (2, n)."""

    events: list[Event]
    truth: tuple[Floats, ...]


def twin_flight(installation: Installation, seconds: float, seed: int, from_s: float = 0.0) -> Flight:
    """`from_s`: nothing before so many seconds is heard."""
    profile, airframe = scripted_flight(seconds, seed)
    table = installation.can_table(ICD_INPUT_ROWS)
    items = [item for item in fly(profile, airframe, table, seed, origin_ns=S) if item.t_ns > S + from_s * S]
    truth = tuple(
        np.array([(t.t_ns, t.value_n) for t in items if isinstance(t, Truth) and t.name == engine], float).T
        for engine in installation.config.aircraft.engines
    )
    return Flight(whole_frames(item for item in items if not isinstance(item, Truth)), truth)


def judge(case: Case, bad: Said, good: Said, truth: Sequence[Floats], begin_ns: int, end_ns: int) -> Verdict:
    """A damaged flight against the truth and the good one."""
    during = [e for engine in case.engines for e in bad.estimates[engine] if begin_ns <= e.t_ns < end_ns + S]
    stop_ns = bad.estimates[0][-1].t_ns
    error_n, std_n = errors(bad, truth, begin_ns, stop_ns)
    whole_n, whole_std_n = errors(at_the_instants_of(bad, good), truth, begin_ns, stop_ns)
    same_n, same_std_n = errors(at_the_instants_of(good, bad), truth, begin_ns, stop_ns)
    off_n, sigma_n = differences(bad, good, stop_ns - round(TAIL_S * S), stop_ns)
    last = [e.status for engine in bad.estimates for e in engine if stop_ns - S <= e.t_ns < stop_ns]
    return Verdict(
        max(pause_s(begin_ns, engine) for engine in bad.estimates),
        any(fault.kind in case.kinds and begin_ns <= fault.t_ns < stop_ns for fault in bad.faults),
        any(e.status & case.status for e in during),
        float(np.mean(error_n < SIGMAS_95 * std_n)),
        float(np.mean(whole_n < SIGMAS_95 * whole_std_n)),
        float((same_n / same_std_n - whole_n / whole_std_n).max()),
        float(error_n.max()),
        float(off_n.max()),
        float((off_n / sigma_n).max()),
        any(status & case.status for status in last),
    )


def at_the_instants_of(other: Said, run: Said) -> Said:
    """A run where the other one has estimates too: what an overrun shed is judged of neither."""
    times = [{e.t_ns for e in engine} for engine in other.estimates]
    pairs = zip(run.estimates, times, strict=True)
    return run._replace(estimates=tuple([e for e in engine if e.t_ns in theirs] for engine, theirs in pairs))


def pause_s(begin_ns: int, estimates: Sequence[Estimate]) -> float:
    return float(np.diff([begin_ns, *(e.t_ns for e in estimates)]).max()) * 1e-9


def errors(run: Said, truth: Sequence[Floats], begin_ns: int, stop_ns: int) -> tuple[Floats, Floats]:
    """|estimate - truth| and the estimate's sigma, both engines one after the other, (n,) each."""
    error_n, std_n = [], []
    for estimates, (times, thrust_n) in zip(run.estimates, truth, strict=True):
        here = np.array([(e.t_ns, e.thrust_n, e.thrust_std_n) for e in within(estimates, begin_ns, stop_ns)]).T
        error_n.append(abs(here[1] - np.interp(here[0], times, thrust_n)))
        std_n.append(here[2])
    return np.concatenate(error_n), np.concatenate(std_n)


def differences(bad: Said, good: Said, begin_ns: int, stop_ns: int) -> tuple[Floats, Floats]:
    """|bad - good| and both runs' sigma, (n,) each."""
    rows = []
    for mine, theirs in zip(bad.estimates, good.estimates, strict=True):
        times = np.array([e.t_ns for e in theirs], float)
        thrust_n, std_n = np.array([(e.thrust_n, e.thrust_std_n) for e in theirs]).T
        here = within(mine, begin_ns, stop_ns)
        at = [e.t_ns for e in here]
        rows += [
            (abs(e.thrust_n - n), hypot(e.thrust_std_n, std))
            for e, n, std in zip(here, np.interp(at, times, thrust_n), np.interp(at, times, std_n), strict=True)
        ]
    off_n, sigma_n = np.array(rows).T
    return off_n, sigma_n


def within(estimates: Sequence[Estimate], begin_ns: int, stop_ns: int) -> list[Estimate]:
    return [e for e in estimates if begin_ns <= e.t_ns < stop_ns]


def cell(flight: Flight, pipeline: Pipeline, index: int, good: Said, case: Case, settle_s: float = SETTLE_S) -> Verdict:
    """One fault on a pipeline that was fed the events before `index`. The flight is cut where the verdict is over."""
    begin_ns = flight.events[index].t_ns
    end_ns = begin_ns + round(case.lasts_s * S)
    stop_ns = end_ns + round((settle_s + TAIL_S) * S)
    part = [event for event in flight.events[index:] if event.t_ns < stop_ns]
    bad = outputs_of(pipeline, case.edit(part, begin_ns, end_ns), len(flight.truth))
    return judge(case, bad, good, flight.truth, begin_ns, end_ns)


def place(flight: Flight, moment_s: float) -> int:
    """The first event after `moment_s` of the flight."""
    return bisect_left(flight.events, flight.events[0].t_ns + round(moment_s * S), key=lambda event: event.t_ns)


def in_a_copy(work: Callable[[], Verdict]) -> Verdict:
    """`work` done by a forked process: what it does to the pipeline stays there."""
    context = get_context("fork")
    mine, its = context.Pipe()
    process = context.Process(target=lambda: its.send(work()))
    process.start()
    its.close()
    verdict: Verdict = mine.recv()
    process.join()
    return verdict


def matrix(
    installation: Installation, parts: Parts, flight: Flight, cases: Sequence[Case], moments_s: Iterable[float]
) -> dict[str, list[Verdict]]:
    """By the fault's name, a verdict for each moment."""
    engines = len(flight.truth)
    good = outputs_of(Pipeline(installation.config, parts), flight.events, engines)
    pipeline, index = Pipeline(installation.config, parts), 0
    verdicts: dict[str, list[Verdict]] = {case.name: [] for case in cases}
    for moment_s in sorted(moments_s):
        there = place(flight, moment_s)
        outputs_of(pipeline, flight.events[index:there], engines)
        index = there
        for case in track(cases, f"at {moment_s:.0f} s", transient=True):
            verdicts[case.name].append(in_a_copy(partial(cell, flight, pipeline, index, good, case)))
    return verdicts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", type=Path, default=Path("deploy/hil.toml"))
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--moments", type=int, default=3)
    parser.add_argument("--first", type=float, default=60.0, help="no fault before so many seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="faults whose name has this in it, e.g. Mach")
    arguments = parser.parse_args()
    cases = [case for case in (*CASES, *CONTRADICTIONS) if arguments.only.lower() in case.name.lower()]
    installation = read_installation(arguments.config)
    parts = installation.parts()
    seconds = arguments.minutes * 60
    flight = twin_flight(installation, seconds, arguments.seed)
    room_s = seconds - SETTLE_S - TAIL_S - max(case.lasts_s for case in cases)
    moments = np.random.default_rng(arguments.seed).uniform(arguments.first, room_s, arguments.moments)
    verdicts = matrix(installation, parts, flight, cases, map(float, moments))
    print("| fault | status bit | longest pause s | seen | inside 95 % | whole | worst N | after 12 s: N, sigma |")
    print("|---|---|---|---|---|---|---|---|")
    for case in cases:
        print(row(case, verdicts[case.name]))


def row(case: Case, verdicts: Sequence[Verdict]) -> str:
    """Worst of all moments."""
    seen = sum(v.reported and v.flagged for v in verdicts)
    bits = ", ".join(str(bit.name) for bit in Status(case.status))
    return (
        f"| {case.name} | {bits} | {max(v.longest_pause_s for v in verdicts):.2f} | {seen} of {len(verdicts)} | "
        f"{min(v.inside_95 for v in verdicts):.1%} | {min(v.whole_inside_95 for v in verdicts):.1%} | "
        f"{max(v.worst_n for v in verdicts):.0f} | {max(v.off_n for v in verdicts):.0f}, "
        f"{max(v.off_sigma for v in verdicts):.2f} |"
    )


if __name__ == "__main__":
    main()
