"""Compare an estimate log with itself: what the filter expected of each source, and what it got.

    report = innovations([Path("out/flight.mcap")])
    report.to_json();  report.print(console)

NIS and whiteness are explained in `fusion.consistency`, what to do about them in docs/fusion.md.
"""

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.core.errors import LogError
from thrustd.fusion.consistency import Consistency, Innovations, consistency
from thrustd.sources.mcap_log import LogFile

TOPIC = "/estimate/"
MISSING = float("nan")


class _Row(msgspec.Struct):
    """What is read of an estimate; null = not measured."""

    nis: float | None
    brochure_nis: float | None
    innovation_n: float | None
    brochure_innovation_n: float | None
    status: int


@dataclass(frozen=True, slots=True)
class InnovationReport:
    """log -> engine -> source -> figures."""

    logs: dict[str, dict[str, dict[str, Consistency]]]

    def to_json(self) -> dict[str, Any]:
        return {
            "innovations": {
                log: {
                    engine: {source: figures._asdict() for source, figures in sources.items()}
                    for engine, sources in engines.items()
                }
                for log, engines in self.logs.items()
            }
        }

    def print(self, console: Console) -> None:
        """One row per engine and source."""
        table = Table(title="Innovations in steady flight")
        for heading in ("log", "engine", "source"):
            table.add_column(heading)
        for heading in ("measurements", "NIS (1: noises right)", "whiteness (0: nothing left)"):
            table.add_column(heading, justify="right")
        for log, engines in self.logs.items():
            for engine, sources in engines.items():
                for source, c in sources.items():
                    table.add_row(log, engine, source, str(c.measurements), f"{c.nis:.3f}", f"{c.whiteness:.2f}")
        console.print(table)


def innovations(paths: Sequence[Path]) -> InnovationReport:
    """Figures of every engine in each estimate log; LogError when one holds no estimates."""
    return InnovationReport({path.name: _engines(path) for path in paths})


def _engines(path: Path) -> dict[str, dict[str, Consistency]]:
    decode = msgspec.json.Decoder(_Row).decode
    rows: dict[str, array[float]] = {}
    for message in LogFile(path).messages():
        if message.topic.startswith(TOPIC):
            row = _decoded(decode, message.data, path)
            measured = (row.nis, row.brochure_nis, row.innovation_n, row.brochure_innovation_n)
            engine = rows.setdefault(message.topic.removeprefix(TOPIC), array("d"))
            engine.extend((*(MISSING if value is None else value for value in measured), row.status))
    if not rows:
        raise LogError(f"{path}: no estimates in it; expected an estimate log (thrustd replay {path.name} -o OUT.mcap)")
    return {name: consistency(_innovations(engine)) for name, engine in sorted(rows.items())}


def _decoded(decode: Callable[[bytes], _Row], data: bytes, path: Path) -> _Row:
    try:
        return decode(data)
    except msgspec.DecodeError as problem:
        raise LogError(
            f"{path}: {problem}: estimates of another version; expected a log replayed by this one"
        ) from None


def _innovations(rows: "array[float]") -> Innovations:
    nis, brochure_nis, mount_n, brochure_n, status = np.array(rows).reshape(-1, 5).T
    return Innovations(nis, brochure_nis, mount_n, brochure_n, status.astype(np.int64))
