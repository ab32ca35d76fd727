"""What a comparison is worth as a check of a model: one rule for terminal, Python and page.

A model was fitted to the files that its provenance names, and its last effect promised an error on blocks held back
from them. Another recording of the same mount is a check: it keeps the promise, or contradicts it.
"""

from dataclasses import dataclass

from thrustd.diagnose.compare.newtons import newtons
from thrustd.identify.artifact import data_sha256
from thrustd.model.artifact import ModelSpec
from thrustd.records.recording import Recording

CONTRADICTED = 2.0  # times the promised error; flights of one mount differ by less (held out at most 1.25 x)
FITTED_TO = "train", "extended_on"  # of the provenance: "name sha256"


@dataclass(frozen=True, slots=True)
class Check:
    """fitted: no check at all; contradicted: much more is left than was promised; sentence: either, for people."""

    fitted: bool = False
    contradicted: bool = False
    sentence: str = ""


def check_of(name: str, spec: ModelSpec, record: Recording, rmse_n: float, unit: str) -> Check:
    """Of a model on a recording, where it left `rmse_n`."""
    if data_sha256(record) in learnt_from(spec):
        return Check(True, False, f"{record.name}: {name} was fitted to this recording: its error here is no check")
    if not spec.ledger or rmse_n <= CONTRADICTED * spec.ledger[-1].rmse_after_n:
        return Check()
    last = spec.ledger[-1]
    more, promised = newtons(rmse_n, unit=unit), newtons(last.rmse_after_n, unit=unit)
    times = f"{newtons(rmse_n / last.rmse_after_n)} times as much"
    said = f"{more} is left, {promised} was promised when {last.added} was added ({times})"
    return Check(False, True, f"{record.name} contradicts {name}: {said}")


def learnt_from(spec: ModelSpec) -> set[str]:
    """Hashes of the records that a model was fitted to."""
    lines = [line for key in FITTED_TO if isinstance(said := spec.provenance.get(key), list) for line in said]
    return {str(line).split()[-1] for line in lines if str(line).split()}
