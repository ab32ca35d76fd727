"""A mount model that is called on arrays."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.newtons import newtons
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import CompiledModel, compile_model
from thrustd.model.stage import DEFORMATION
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_in
from thrustd.records.shown import Shown, as_frame

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

USUAL_HZ = 100.0  # of arrays whose rate nobody says, and of a model without a witness


@dataclass(frozen=True, repr=False)
class Model(Shown):
    """Deformation of a mount -> the thrust that goes through it, N. Immutable; `spec` is the artifact.

    `model(deformation_mm, rate_hz=100.0, accel_x_g=...)` runs it over arrays; `model(recording)` over columns.
    """

    spec: ModelSpec
    report: Any = field(default=None, compare=False, repr=False)  # of `identify` or `extend`, where it came from one

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def channels(self) -> tuple[str, ...]:
        """What it reads beside deformation_mm, each once."""
        return tuple(name for name in dict.fromkeys(_compiled(self, USUAL_HZ).channels) if name != DEFORMATION)

    @property
    def rate_hz(self) -> float:
        """Of the data it was identified on."""
        return self.spec.witness.rate_hz if self.spec.witness else USUAL_HZ

    def __call__(
        self, deformation_mm: npt.ArrayLike | Recording, *, rate_hz: float | None = None, **channels: npt.ArrayLike
    ) -> Floats:
        """Thrust share of the mount, N, (n,): a free run from rest under the first sample.

        deformation_mm (n,), or a recording with it; rate_hz: samples per second (default: the model's own, or the
        recording's); channels: each (n,) or one number, under the names of `model.channels`.
        """
        if isinstance(deformation_mm, Recording):
            record = deformation_mm
            return self._run(record[DEFORMATION], rate_hz or record.sample_hz, dict(record.channels) | channels)
        unknown = sorted(set(channels) - set(self.channels))
        if unknown:
            raise UsageError(
                f"{self.name}: does not read {unknown[0]!r}; expected of {', '.join(self.channels) or 'none'}"
            )
        return self._run(np.asarray(deformation_mm, dtype=np.float64), rate_hz or self.rate_hz, channels)

    def _run(self, deformation_mm: Floats, rate_hz: float, channels: Mapping[str, npt.ArrayLike]) -> Floats:
        if deformation_mm.ndim != 1 or not len(deformation_mm):
            raise UsageError(f"{self.name}: deformation_mm has shape {deformation_mm.shape}; expected (n,)")
        if not rate_hz > 0:
            raise UsageError(f"{self.name}: rate_hz = {rate_hz}; expected samples per second, above 0")
        compiled = _compiled(self, float(rate_hz))
        given = {DEFORMATION: deformation_mm}
        for name in set(self.channels) & set(channels):
            column = np.asarray(channels[name], dtype=np.float64)
            if column.shape not in ((), deformation_mm.shape):
                raise UsageError(f"{self.name}: {name} has shape {column.shape}; expected {deformation_mm.shape} or ()")
            given[name] = np.broadcast_to(column, deformation_mm.shape)
        return compiled.simulate(compiled.inputs(given))

    def to_pandas(self) -> "pd.DataFrame":
        """A row per number of the model: where it belongs, value, one sigma where it was estimated."""
        return as_frame(self._rows())

    def _rows(self) -> list[dict[str, Any]]:
        modes = [
            {"of": "relaxation", "name": "tau_s", "value": mode.tau_s, "std": np.nan}
            for mode in self.spec.linear.real_modes
        ]
        effects = [
            {"of": effect.name, "name": name, "value": value, "std": effect.std.get(name, np.nan)}
            for effect in self.spec.effects
            for name, value in effect.parameters.items()
        ]
        return [*modes, *effects]

    def show(self, console: "Console") -> None:
        """One table: structure, range, effects, ledger; then what its identification said."""
        from rich import box
        from rich.table import Table

        table = Table(title=f"model {self.name}", box=box.SIMPLE, show_header=False, title_justify="left")
        for heading, words in _lines(self.spec):
            table.add_row(heading, words)
        console.print(table)
        if self.report is not None:
            self.report.print(console)


@lru_cache(maxsize=32)
def _compiled_text(text: bytes, rate_hz: float) -> CompiledModel:
    import msgspec

    return compile_model(msgspec.json.decode(text, type=ModelSpec), rate_hz)


def _compiled(model: Model, rate_hz: float) -> CompiledModel:
    import msgspec

    return _compiled_text(msgspec.json.encode(model.spec), rate_hz)


def _lines(spec: ModelSpec) -> list[tuple[str, str]]:
    low, high = spec.valid.deformation_mm
    least, most = spec.valid.force_n
    roles = roles_in(spec.provenance)
    modes = ", ".join(f"{mode.tau_s:.3g}" for mode in spec.linear.real_modes)
    lines = [
        ("structure", spec.structure),
        (
            "identified over",
            f"{low:.4g} to {high:.4g} {roles.input_unit}, {newtons(least)} to {newtons(most)} {roles.output_unit}",
        ),
        ("time constants, s", modes or "none"),
    ]
    if not roles.own:
        lines.insert(1, ("input, output", ", ".join(roles)))
    for effect in spec.effects:
        numbers = [f"{name} {value:.4g}" for name, value in effect.parameters.items()][:4]
        lines.append((f"effect {effect.name}", ", ".join(numbers) + (" ..." if len(effect.parameters) > 4 else "")))
    for entry in spec.ledger:
        fall = f"{newtons(entry.rmse_before_n)} -> {newtons(entry.rmse_after_n, unit=roles.output_unit)}"
        lines.append((f"ledger + {entry.added}", f"{fall}, {entry.data}"))
    return lines
