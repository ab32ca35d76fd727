"""The picture of one row of the fault table: what each route said, what was printed, what was true."""

from pathlib import Path
from typing import Protocol

import matplotlib
import numpy as np

from benchmarks.fusion_flights import ENGINES
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Estimate, Fault
from thrustd.records.recording import Recording

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

BLUE, ORANGE, GREEN, RED = "#0072b2", "#e69f00", "#009e73", "#d55e00"  # Okabe & Ito: safe for colour-blind readers


class Flown(Protocol):
    """What the fault table has of one flight."""

    profile: Recording
    estimates: list[Estimate]
    begin_ns: int


def draw(path: Path, title: str, flown: Flown, faults: list[Fault], engine: int) -> None:
    """Thrust above, error against the truth below; seconds from the fault."""
    mine = [e for e in flown.estimates if e.engine == engine]
    columns = [(e.t_ns * 1e-9, e.thrust_n, e.thrust_std_n, e.mount_n, e.brochure_n) for e in mine]
    time_s, thrust, std, mount, brochure = np.array(columns).T
    truth = np.interp(time_s, flown.profile.time_s, flown.profile[f"thrust_N_{ENGINES[engine]}"])
    since_s, band = time_s - flown.begin_ns * 1e-9, SIGMAS_95 * std
    figure, axes = plt.subplots(2, 1, figsize=(11, 7.5), sharex=True, height_ratios=(3, 2), layout="constrained")
    for axis, zero in zip(axes, (0.0, truth), strict=True):
        axis.plot(since_s, brochure - zero, color=ORANGE, lw=0.9, label="brochure route")
        axis.plot(since_s, mount - zero, color=GREEN, lw=0.9, label="mount route")
        axis.fill_between(
            since_s, thrust - zero - band, thrust - zero + band, color=BLUE, alpha=0.25, lw=0, label="95 % band"
        )
        axis.plot(since_s, thrust - zero, color=BLUE, lw=1.2, label="fused")
        axis.plot(since_s, truth - zero, color="black", lw=1.0, ls="--", label="truth")
        axis.axvline(0.0, color=RED, lw=1.2, label="sensor fails")
        axis.grid(alpha=0.3, lw=0.5)
        axis.margins(x=0)
    _mark(axes[0], faults, flown.begin_ns)
    axes[0].set_ylabel("net thrust, N")
    axes[1].set_ylabel("minus truth, N")
    axes[1].set_xlabel("seconds from the fault")
    axes[0].legend(loc="upper left", ncols=3, fontsize=9)
    axes[0].set_title(title, loc="left", fontsize=12)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _mark(axis: Axes, faults: list[Fault], begin_ns: int) -> None:
    """The first report, in words."""
    if faults:
        first_s = (faults[0].t_ns - begin_ns) * 1e-9
        words = f"after {first_s:.1f} s: {faults[0].where} {faults[0].kind}"
        axis.annotate(
            words, (first_s, 0.04), xycoords=("data", "axes fraction"), xytext=(8, 0), textcoords="offset points",
            color=RED, fontsize=9,
        )  # fmt: skip
