"""What a replay prints: how good the estimates were, or, where nobody knows the truth, what they say of themselves."""

from math import isfinite
from typing import TYPE_CHECKING

from thrustd.core.measures import OPERATING_N

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from thrustd.replay.replay import ReplaySummary


ZERO = " zero"  # kind of an event that goes the way of faults and is none
REFUSED = " zero_refused"


def print_summary(summary: "ReplaySummary", screen: "Console") -> None:
    cut = ", log cut off: read up to the last whole chunk" if summary.cut else ""
    screen.print(
        f"{summary.log}: {summary.length_s / 60:.1f} min, {summary.events} events, "
        f"{summary.estimates} estimates, {summary.missing_events} events missing{cut}"
    )
    screen.print(_scores(summary) if summary.scores else _means(summary))
    for name, engine in summary.engines.items():
        shares = sorted(engine.status_pct.items(), key=lambda row: -row[1])
        words = ", ".join(f"{bit.replace('_', ' ')} {_pct(share)}" for bit, share in shares)
        screen.print(f"{name}, status by share of the time (bits overlap): {words or 'healthy throughout'}")
        if isfinite(engine.residual_pct):
            screen.print(
                f"{name}, steady above {OPERATING_N / 1000:g} kN: mounts minus brochure {engine.residual_pct:+.1f} %, "
                f"upper mount carries {100 * engine.load_share:.1f} %",
            )
    zeros = [what.removesuffix(ZERO) for what in summary.faults if what.endswith(ZERO)]
    if zeros:
        screen.print(f"zeros of the transducers calibrated before the engine start: {', '.join(zeros)}")
    refused = [what.removesuffix(REFUSED) for what in summary.faults if what.endswith(REFUSED)]
    if refused:
        screen.print(f"zeros refused before the engine start, more than a zero can be: {', '.join(refused)}")
    faults = ", ".join(f"{what} x{n}" for what, n in summary.faults.items() if not what.endswith(ZERO)) or "none"
    screen.print(f"faults: {faults}")


def largest_n(summary: "ReplaySummary") -> dict[str, dict[str, float]]:
    """By engine and source: the largest error where a truth is known, else the largest distance from fused."""
    if summary.scores:
        return {name: {source: s.worst_n for source, s in sources.items()} for name, sources in summary.scores.items()}
    return {
        name: {source: mean.farthest_n for source, mean in engine.sources.items() if source != "fused"}
        for name, engine in summary.engines.items()
    }


def _scores(summary: "ReplaySummary") -> "Table":
    from rich.table import Table

    table = Table(title="error: estimate minus truth; % of truth while a mount carries more than 2 kN")
    for heading in ("", "source"):
        table.add_column(heading)
    for heading in ("RMSE N", "bias N", "mean |error| %", "worst |error| N", "in 95 % band"):
        table.add_column(heading, justify="right")
    for name, sources in summary.scores.items():
        for source, s in sources.items():
            table.add_row(
                name, source, f"{s.rmse_n:.1f}", f"{s.bias_n:+.1f}", f"{s.mae_pct_above_2kn:.2f}",
                f"{s.worst_n:.0f}", f"{s.inside_95_pct:.1f} %",
            )  # fmt: skip
    return table


def _means(summary: "ReplaySummary") -> "Table":
    from rich.table import Table

    table = Table(title="no truth is known of this flight")
    for heading in ("", "source"):
        table.add_column(heading)
    for heading in ("there, % of the time", "mean thrust N", "one sigma N (median)", "largest distance from fused N"):
        table.add_column(heading, justify="right")
    for name, engine in summary.engines.items():
        for source, mean in engine.sources.items():
            apart = "-" if source == "fused" else f"{mean.farthest_n:.0f}"
            table.add_row(name, source, f"{mean.known_pct:.1f}", f"{mean.mean_n:.1f}", f"{mean.std_n:.1f}", apart)
    return table


def _pct(share: float) -> str:
    return f"{share:.1f} %" if share >= 0.05 else "< 0.1 %"
