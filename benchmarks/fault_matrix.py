"""Every fault at several moments of a flight: `python -m benchmarks.fault_matrix --minutes 5 --moments 3`.

A twin flight is replayed once as it was and once per fault and moment with its log damaged. Compared are the two runs:

    goes on      largest pause between two estimates of one engine
    seen         the fault is reported by its name, and its status bit is on
    band honest  share of estimates, fault to end, whose difference from the good run is inside both runs' 95 % bands
                 (added as independent errors)
    recovered    largest difference from the good run in the last seconds, newtons, and in standard deviations
"""

import argparse
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from math import hypot
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import track

from benchmarks.damage import CASES, CONTRADICTIONS, Case, whole_frames
from thrustd.installation import Installation, read_installation
from thrustd.pipeline import Parts, Pipeline
from thrustd.twin.flight import Truth, fly, scripted_flight
from thrustd.types import Estimate, Event, Fault, Status
from thrustd.wire.can_frames import ICD_INPUT_ROWS

S = 1_000_000_000
Z95 = 1.96
SETTLE_S = 12.0  # from the end of the fault to the recovered part
TAIL_S = 3.0


class Verdict(NamedTuple):
    """One cell of the matrix."""

    longest_pause_s: float
    reported: bool
    flagged: bool
    inside_95: float  # share, 0 to 1
    off_n: float
    off_sigma: float
    still_flagged: bool  # installation bits at the end


def twin_events(installation: Installation, seconds: float, seed: int) -> list[Event]:
    profile, airframe = scripted_flight(seconds, seed)
    table = installation.can_table(ICD_INPUT_ROWS)
    flown = fly(profile, airframe, table, seed, origin_ns=S)
    return whole_frames(item for item in flown if not isinstance(item, Truth))


class Flown(NamedTuple):
    estimates: tuple[list[Estimate], ...]  # by engine
    faults: list[Fault]


def flown(installation: Installation, parts: Parts, events: Iterable[Event]) -> Flown:
    pipeline = Pipeline(installation.config, parts)
    result = Flown(tuple([] for _ in installation.config.aircraft.engines), [])
    for event in events:
        for output in pipeline.feed(event):
            if isinstance(output, Estimate):
                result.estimates[output.engine].append(output)
            elif isinstance(output, Fault):
                result.faults.append(output)
    return result


def judge(case: Case, bad: Flown, good: Flown, begin_ns: int, end_ns: int, stop_ns: int) -> Verdict:
    """Compare a damaged flight with the good one."""
    during = [e for engine in case.engines for e in bad.estimates[engine] if begin_ns <= e.t_ns < end_ns + S]
    off_n, sigma_n, tail = differences(bad, good, begin_ns, stop_ns)
    last = [e.status for engine in bad.estimates for e in engine if stop_ns - S <= e.t_ns < stop_ns]
    return Verdict(
        max(pause_s(engine) for engine in bad.estimates),
        any(fault.kind in case.kinds and begin_ns <= fault.t_ns < stop_ns for fault in bad.faults),
        any(e.status & case.status for e in during),
        float(np.mean(off_n < Z95 * sigma_n)),
        float(off_n[tail].max()),
        float((off_n[tail] / sigma_n[tail]).max()),
        any(status & case.status for status in last),
    )


def pause_s(estimates: Sequence[Estimate]) -> float:
    return float(np.diff([e.t_ns for e in estimates]).max()) * 1e-9


def differences(bad: Flown, good: Flown, begin_ns: int, stop_ns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """|bad - good| (n,), both runs' sigma (n,), and which are of the recovered part (n,)."""
    rows = []
    for mine, theirs in zip(bad.estimates, good.estimates, strict=True):
        times = np.array([e.t_ns for e in theirs], float)
        thrust_n, std_n = np.array([(e.thrust_n, e.thrust_std_n) for e in theirs]).T
        first = bisect_left(mine, begin_ns, key=lambda e: e.t_ns)
        here = [e for e in mine[first:] if e.t_ns < stop_ns]
        at = [e.t_ns for e in here]
        rows += [
            (abs(e.thrust_n - n), hypot(e.thrust_std_n, std), float(e.t_ns >= stop_ns - TAIL_S * S))
            for e, n, std in zip(here, np.interp(at, times, thrust_n), np.interp(at, times, std_n), strict=True)
        ]
    table = np.array(rows)
    return table[:, 0], table[:, 1], table[:, 2] > 0


def cell(
    installation: Installation,
    parts: Parts,
    events: list[Event],
    good: Flown,
    case: Case,
    moment_s: float,
    settle_s: float = SETTLE_S,
) -> Verdict:
    """One fault at one moment. The flight is cut where the verdict is over."""
    begin_ns = events[0].t_ns + round(moment_s * S)
    end_ns = begin_ns + round(case.lasts_s * S)
    stop_ns = end_ns + round((settle_s + TAIL_S) * S)
    part = [event for event in events if event.t_ns < stop_ns]
    return judge(case, flown(installation, parts, case.edit(part, begin_ns, end_ns)), good, begin_ns, end_ns, stop_ns)


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
    events = twin_events(installation, seconds, arguments.seed)
    good = flown(installation, parts, events)
    room_s = seconds - SETTLE_S - TAIL_S - max(case.lasts_s for case in cases)
    moments = np.random.default_rng(arguments.seed).uniform(arguments.first, room_s, arguments.moments)
    print("| fault | status bit | longest pause s | seen | inside 95 % band | after 12 s: N, sigma |")
    print("|---|---|---|---|---|---|")
    for case in track(cases, "flying", transient=True):
        verdicts = [cell(installation, parts, events, good, case, float(moment)) for moment in moments]
        print(row(case, verdicts))


def row(case: Case, verdicts: Sequence[Verdict]) -> str:
    """Worst of all moments."""
    seen = sum(v.reported and v.flagged for v in verdicts)
    bits = ", ".join(str(bit.name) for bit in Status(case.status))
    return (
        f"| {case.name} | {bits} | {max(v.longest_pause_s for v in verdicts):.2f} | {seen} of {len(verdicts)} | "
        f"{min(v.inside_95 for v in verdicts):.1%} | {max(v.off_n for v in verdicts):.0f}, "
        f"{max(v.off_sigma for v in verdicts):.2f} |"
    )


if __name__ == "__main__":
    main()
