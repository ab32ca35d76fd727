"""The campaign as rows of docs/evidence.md: `python -m benchmarks.integrity_page [KEY ...]`, of what was kept there.

A row for each kind of fault, the worst of its flights; wires are in the matrix of docs/reliability.md.
"""

import sys

from benchmarks.integrity import Row, kept
from benchmarks.integrity_cases import AIRCRAFT, CASES, HEALTHY
from benchmarks.made_with import way_of

ROLL = "take-off roll"
HEAD = (
    "fault", "flown", "bias N, worst", "sigma N", "longest silent s", "in band or flagged %, least",
    "named s: take-off roll", "elsewhere", "told s",
)  # fmt: skip


def main() -> None:
    rows = [row for key in sys.argv[1:] or [way_of()["code"]] for row in kept(key, (HEALTHY, *CASES, *AIRCRAFT))]
    by_fault: dict[str, list[Row]] = {case.fault: [] for case in (HEALTHY, *CASES, *AIRCRAFT)}
    for row in rows:
        by_fault[row.fault].append(row)
    for line in (HEAD, ("---",) * len(HEAD), *(_line(fault, mine) for fault, mine in by_fault.items() if mine)):
        print(f"| {' | '.join(line)} |")


def _line(fault: str, mine: list[Row]) -> tuple[str, ...]:
    roll, elsewhere = ([row for row in mine if (row.moment == ROLL) == so] for so in (True, False))
    healthy = fault == HEALTHY.fault or fault in {case.fault for case in AIRCRAFT}
    times = ("", "", "") if healthy else (
        _times([row.named_s for row in roll]), _times([row.named_s for row in elsewhere]),
        _times([row.told_s for row in mine]),
    )  # fmt: skip
    return (
        fault, f"{len(mine)}", f"{max((r.bias_n for r in mine), key=abs):.0f}", f"{max(r.std_n for r in mine):.0f}",
        f"{max(r.longest_s for r in mine):.0f}", f"{min(r.in_band_pct for r in mine):.0f}", *times,
    )  # fmt: skip


def _times(all_s: list[float | None]) -> str:
    """First to last; in brackets in how many flights, where not in all. Dash: never."""
    known = [f"{t:.1f}" if t < 9.95 else f"{t:.0f}" for t in all_s if t is not None]
    known.sort(key=float)
    if not known:
        return "-" if all_s else ""
    part = "" if len(known) == len(all_s) else f" ({len(known)}/{len(all_s)})"
    return (known[0] if known[0] == known[-1] else f"{known[0]} to {known[-1]}") + part


if __name__ == "__main__":
    main()
