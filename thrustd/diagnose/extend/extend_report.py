"""What `extend` made of a model and what that gained; its entry in the model's ledger."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.search.told import ParameterEstimate, sentences
from thrustd.model.artifact import LedgerEntry, ModelSpec, write_model


@dataclass(frozen=True, slots=True)
class ExtendReport:
    """The extended model and what it gained on held-back blocks."""

    spec: ModelSpec
    effects: tuple[str, ...]
    rmse_before_n: float
    rmse_after_n: float
    parameters: tuple[ParameterEstimate, ...]
    left_out: tuple[str, ...] = ()  # asked for, and explained by the others
    unit: str = "N"
    judged: str = "on held-back blocks"
    remarks: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        return {
            "model": self.spec.name,
            "effects": list(self.effects),
            "names": [effect.name for effect in self.spec.effects],
            "left_out": list(self.left_out),
            "remarks": list(self.remarks),
            "rmse_before_n": self.rmse_before_n,
            "rmse_after_n": self.rmse_after_n,
            "parameters": {self._key(p): p.to_json() | {"effect": p.effect} for p in self.parameters},
            "rest_moved": True,
        }

    def _key(self, parameter: ParameterEstimate) -> str:
        """Its name, with its effect where two effects call one of theirs the same."""
        same = sum(p.name == parameter.name for p in self.parameters)
        return parameter.name if same == 1 else f"{parameter.effect}.{parameter.name}"

    def print(self, console: Console) -> None:
        names = " and ".join(self.effects)
        console.print(
            f"{names} added: {newtons(self.rmse_before_n)} -> {newtons(self.rmse_after_n)} {self.unit} {self.judged}",
        )
        for line in sentences(self.parameters):
            console.print(f"  {line}")
        for word in self.left_out:
            console.print(f"  {word} left out: the others explain as much without it")
        for line in self.remarks:
            console.print(f"  - {line}")


def ledger_of(
    parent: ModelSpec, words: Sequence[str], before_n: float, after_n: float, names: Sequence[str]
) -> LedgerEntry:
    """What was added to which model, on what, for which gain."""
    sha256 = hashlib.sha256(write_model(parent).encode()).hexdigest()
    return LedgerEntry(
        added=", ".join(words),
        rmse_before_n=before_n,
        rmse_after_n=after_n,
        data=", ".join(names),
        parent_sha256=sha256,
    )
