"""The report of `commission`: every model, its error on data not used, what was left out and what it costs."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

from thrustd.commission.mount_models import Made
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effects import effect_named
from thrustd.sinks.html_page import head, section, sentences, table

MOUNT_N = 3000.0  # of a mount in cruise: where a cost is told
WORDS = (
    "Free runs: a model sees deformation and channels, never the force. Errors are RMS on data that nothing was fitted "
    "to, unless they say otherwise."
)
NEXT = (
    "thrustd check {config}: configuration, files, witness rows.",
    "With the engines off: thrustd zero LOG -o {folder}/calibration.toml.",
    "Held by a load cell: thrustd calibrate tether LOG --cell CELL -o {folder}/calibration.toml.",
    'Then put calibration = "calibration.toml" into the configuration.',
)


@dataclass(frozen=True, slots=True)
class Missing:
    """A piece that was not brought."""

    piece: str
    costs: str
    std: float  # of the force, relative, one sigma


@dataclass(frozen=True, slots=True)
class Commissioned:
    """What is in the folder."""

    folder: Path
    config: Path
    mounts: dict[str, Made]
    deck_rows: list[dict[str, object]]
    remarks: tuple[str, ...]
    missing: list[Missing]
    stiffness_std: float
    kept: str = ""  # what came from the base and belongs to its models


def report_page(done: Commissioned) -> str:
    """HTML."""
    parts = [head(f"{done.folder.name}: commissioned", WORDS), _models(done.mounts), _effects(done.mounts)]
    parts += [_deck(done.deck_rows, done.remarks), _missing(done)]
    parts += [
        section(
            "What happened",
            *(sentences(f"{mount}: {line}" for line in one.lines) for mount, one in done.mounts.items()),
        )
    ]
    said = (line.format(config=done.config, folder=done.folder) for line in NEXT)
    parts += [section("What is next", sentences(said))]
    return "".join(parts)


def _models(mounts: dict[str, Made]) -> str:
    rows = [
        (mount, f"{one.unseen_n:.1f}", f"{one.train_n:.1f}", _span(one.spec.valid.force_n), ", ".join(one.benches))
        for mount, one in mounts.items()
    ]
    return section("Models", table(("Mount", "on data not used, N", "on its own, N", "identified, N", "benches"), rows))


def _span(limits: Sequence[float]) -> str:
    return f"{limits[0]:.0f} to {limits[1]:.0f}"


def _effects(mounts: dict[str, Made]) -> str:
    rows = [
        (f"{mount}: {effect_named(effect.name).word}", name, f"{value:.4g}", _sigma(one.spec, effect, name))
        for mount, one in mounts.items()
        for effect in one.spec.effects
        if effect_named(effect.name).word != "hysteresis"
        for name, value in effect.parameters.items()
    ]
    return section("Effects", table(("Mount and effect", "parameter", "value", "one sigma"), rows))


def _sigma(spec: ModelSpec, effect: EffectSpec, name: str) -> str:
    """`given`: no record of this mount told it; a later fit that held it gives it a sigma of nothing."""
    given = spec.provenance.get("given", [])
    assert isinstance(given, list)
    held = any(str(line).startswith(f"{effect.name}.{name} = ") for line in given)
    return "given" if held or name not in effect.std else f"{effect.std[name]:.2g}"


def _deck(rows: Sequence[dict[str, object]], remarks: Sequence[str]) -> str:
    if not rows:
        return section("Deck", sentences(["The base deck, unchanged: fewer than two flights were given."]))
    told = [(f"{row['engine']}", f"{row['flight']}", f"{row['n1_left_out_error_pct']:.2f}") for row in rows]
    return section("Deck", table(("Engine", "flight left out", "error by N1, %"), told), sentences(remarks))


def _missing(done: Commissioned) -> str:
    rows = [(piece.piece, piece.costs, f"{100 * piece.std:.2f}") for piece in done.missing]
    one_n, std = MOUNT_N * done.stiffness_std, f"{100 * done.stiffness_std:.2f} %"
    band = f"Stiffness sigma in the band: {std} of a mount's force, {one_n:.0f} N of {MOUNT_N:.0f} N on a mount,"
    band += f" {sqrt(2.0) * one_n:.0f} N of {2.0 * MOUNT_N:.0f} N on an engine's two."
    kept = [f"Kept: {done.kept}."] if done.kept else []
    none = [] if rows else ["Nothing was left out."]
    shown = table(("Not brought", "costs", "in the band, % of force"), rows) if rows else ""
    return section("Left out", shown, sentences([*none, band, *kept]))
