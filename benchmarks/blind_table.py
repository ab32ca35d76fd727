"""The table of the blind benchmark: confusion matrix, shares against what issue 5 asks, fall of the error, coverage."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.core.measures import SIGMAS_95

Line = dict[str, Any]
ASKED = {"single 3x": 0.95, "single 2x": 0.95, "single 1x": 0.85, "none": 0.98, "unknown": 0.90, "pair": 0.85}


def print_table(lines: Sequence[Line], console: Console) -> None:
    console.print(_confusion(lines))
    for kind in sorted({_kind(line) for line in lines}):
        _shares(kind, [line for line in lines if _kind(line) == kind], console)
    _falls(lines, console)
    _coverage(lines, console)
    cpu_s = [line["cpu_s"] for line in lines if "cpu_s" in line]
    if cpu_s:
        console.print(f"diagnose: median {np.median(cpu_s):.1f} s of processor, longest {max(cpu_s):.1f} s")


def _kind(line: Line) -> str:
    return f"single {line['strength']:g}x" if line["kind"] == "single" else str(line["kind"])


def _confusion(lines: Sequence[Line]) -> Table:
    count = Counter(("+".join(line["effects"]) or "none", "+".join(sorted(line["said"]))) for line in lines)
    said = sorted({b for _, b in count if "+" not in b})
    table = Table(title="rows hidden, columns said")
    for heading in ("hidden", *(word[:9] for word in said), "several"):
        table.add_column(heading, justify="right")
    for hidden in sorted({a for a, _ in count}):
        several = sum(n for (a, b), n in count.items() if a == hidden and "+" in b)
        table.add_row(hidden, *(str(count[hidden, s] or "") for s in said), str(several or ""))
    return table


def _shares(kind: str, lines: Sequence[Line], console: Console) -> None:
    right = sum(line["right"] for line in lines)
    exact = sum(bool(line.get("exact", line["right"])) for line in lines)
    unfair = sum(not line["right"] and not line.get("excused") for line in lines)
    console.print(
        f"{kind}: {right} of {len(lines)} right ({right / len(lines):.0%}, asked {ASKED.get(kind, 0.95):.0%}),"
        f" {exact} with nothing beside it, {unfair} wrong without its look-alike named",
        highlight=False,
    )


def _falls(lines: Sequence[Line], console: Console) -> None:
    falls = np.array([line["heldout_after_n"] / line["quiet_n"] for line in lines if "heldout_after_n" in line])
    refused = sum("refused" in line for line in lines)
    if falls.size:
        console.print(
            f"held-out error after extend over that where nothing is hidden: median {np.median(falls):.3f},"
            f" 90 % below {np.quantile(falls, 0.9):.3f}; {np.mean(falls <= 1.15):.0%} of {falls.size} at most 1.15;"
            f" {refused} refused",
            highlight=False,
        )


def _coverage(lines: Sequence[Line], console: Console) -> None:
    by_name: dict[str, list[bool]] = {}
    for line in lines:
        for name, truth, value, std in line.get("intervals", []):
            by_name.setdefault(name, []).append(abs(value - truth) <= SIGMAS_95 * std)
    if by_name:
        every = [inside for found in by_name.values() for inside in found]
        console.print(f"true parameter inside its 95 % interval: {np.mean(every):.0%} of {len(every)}", highlight=False)
        missed = {name: f"{sum(found)} of {len(found)}" for name, found in sorted(by_name.items()) if not all(found)}
        for name, share in missed.items():
            console.print(f"  {name}: {share}", highlight=False)
