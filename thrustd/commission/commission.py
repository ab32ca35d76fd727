"""From an aircraft's records to a folder that flies: models, deck, configuration, report. Whole or not at all.

    flights -> deck        bench -> identify -> weight -> temperature -> mass -> compile -> check

What is missing is said with what it costs, and the cost goes into the band: `fusion.mount_stiffness_std` of the
folder's configuration is the root of the sum of squares of the default and of every missing piece.
"""

import re
from collections.abc import Callable, Sequence
from math import hypot
from pathlib import Path

import msgspec

from thrustd.brochure.fit.deck_fit import fit_deck_file, report_lines
from thrustd.commission.mount_models import mount_models
from thrustd.commission.pieces import Pieces
from thrustd.commission.report import MOUNT_N, Commissioned, Missing, report_page
from thrustd.core.config import section
from thrustd.core.errors import ConfigError, UsageError
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import Installation, read_installation
from thrustd.model.artifact import write_model
from thrustd.sinks.whole_file import whole_folder

WEIGHT_STD, THERMAL_STD = 0.005, 0.006  # 1.5 g without the weight's stiffening; 30 K from the bench at 2e-4 1/K
DECK_STD = 0.02


def commission(
    pieces: Pieces, installation: Installation, config: Path, out: Path, told: Callable[[float, str], None]
) -> Commissioned:
    """`config`: the aircraft's configuration that `installation` was read from; `out`: a folder that is not there."""
    if out.is_symlink() or (out.exists() and (not out.is_dir() or any(out.iterdir()))):
        raise UsageError(f"{out}: already exists; expected the name of a new or empty folder")
    missing = _missing(pieces)
    with whole_folder(out) as folder:
        told(0.0, "deck")  # first: a flight that cannot be used shows in seconds, the mounts take minutes
        rows, remarks = _write(folder, pieces, installation)
        settings = section(installation.config.fusion, FusionSettings, str(config))
        std = hypot(settings.mount_stiffness_std, *(piece.std for piece in missing))
        target = folder / config.name
        target.write_text(_configured(config.read_text(), installation, std, config))
        made = mount_models(pieces, installation, lambda share, what: told(0.05 + 0.9 * share, what))
        for mount, one in made.items():
            (folder / "models" / f"{mount}.json").write_text(write_model(one.spec))
        told(0.97, "check")
        read_installation(target).pipeline()
        kept = _kept(installation)
        done = Commissioned(out, out / config.name, made, rows, remarks, missing, std, kept)
        (folder / "report.html").write_text(report_page(done), encoding="utf-8")
    told(1.0, "done")
    return done


def _missing(pieces: Pieces) -> list[Missing]:
    """What was not brought, and what that costs."""
    found = []
    if not pieces.weight:
        cost = f"{WEIGHT_STD * MOUNT_N:.0f} N of {MOUNT_N:.0f} N on a mount at 1.5 g"
        found.append(Missing("weight: what normal load does", cost, WEIGHT_STD))
    if not pieces.chamber:
        cost = f"{THERMAL_STD * MOUNT_N:.0f} N of {MOUNT_N:.0f} N on a mount 30 K from the bench"
        found.append(Missing("chamber: what temperature does", cost, THERMAL_STD))
    if len(pieces.flights) < 2:
        cost = f"the deck of the base, within {100 * DECK_STD:g} % of an engine (its band says so)"
        cost += "; the one given is not used" if pieces.flights else ""
        found.append(Missing("two flights: these engines' own deck", cost, 0.0))
    return found


def _kept(installation: Installation) -> str:
    known = installation.calibration()
    if known is None or all(mount.gain_std is None for mount in known.mount.values()):
        return ""
    name = Path(str(installation.config.calibration)).name
    return f"{name} of {known.on}: its gains, zeros and friction belong to the base's models; calibrate tether again"


def _write(folder: Path, pieces: Pieces, installation: Installation) -> tuple[list[dict[str, object]], tuple[str, ...]]:
    """Every file but the configuration and the models; -> what the deck's fit said."""
    (folder / "models").mkdir(parents=True)
    names = installation.config
    for name in (names.can.dbc, names.aircraft.data):
        if name is not None:
            (folder / Path(name).name).write_bytes(installation.files[name])
    if names.calibration is not None:
        (folder / Path(names.calibration).name).write_bytes(installation.files[names.calibration])
    base, deck = folder / ".base.json", folder / "deck.json"
    base.write_bytes(installation.files[names.deck])
    if len(pieces.flights) < 2:
        base.rename(deck)
        return [], ()
    fit = fit_deck_file(pieces.flights, deck, base, None)
    base.unlink()
    return list(report_lines(fit)), tuple(fit.remarks)


def _configured(text: str, installation: Installation, std: float, where: Path) -> str:
    """The configuration with the folder's own names and sigma in it, its comments kept; ConfigError if that fails."""
    config = installation.config
    own = {"deck": "deck.json", "dbc": Path(config.can.dbc).name}
    own |= {"data": Path(config.aircraft.data).name} if config.aircraft.data is not None else {}
    own |= {"calibration": Path(config.calibration).name} if config.calibration is not None else {}
    for key, name in own.items():
        text = re.sub(rf"(?m)^([ \t]*{key}[ \t]*=[ \t]*)([\"'])[^\"'\n]*\2", rf'\g<1>"{name}"', text)
    models = iter(f"models/{mount.name}.json" for mount in config.mount)
    text = re.sub(r"(?m)^([ \t]*model[ \t]*=[ \t]*)([\"'])[^\"'\n]*\2", lambda m: f'{m[1]}"{next(models)}"', text)
    line = f"mount_stiffness_std = {std:.5f} # with what was not measured, see report.html"
    if re.search(r"(?m)^\[fusion\]", text) is None:
        text = f"{text.rstrip()}\n\n[fusion]\n{line}\n"
    elif re.search(r"(?m)^[ \t]*mount_stiffness_std", text):
        text = re.sub(r"(?m)^[ \t]*mount_stiffness_std.*$", line, text)
    else:
        text = re.sub(r"(?m)^\[fusion\].*$", lambda m: f"{m[0]}\n{line}", text)
    _check(text, installation, where)
    return text


def _check(text: str, installation: Installation, where: Path) -> None:
    """Every name is in place, everything else as it was."""
    from thrustd.core.config import read_config

    new, old = read_config(text, str(where)), installation.config
    wanted = [f"models/{mount}.json" for mount in (each.name for each in old.mount)]
    ours = msgspec.structs.replace(new, deck=old.deck, mount=old.mount, can=old.can, aircraft=old.aircraft)
    same = msgspec.structs.replace(ours, fusion=old.fusion, calibration=old.calibration) == old
    if [mount.model for mount in new.mount] != wanted or new.deck != "deck.json" or not same:
        raise ConfigError(f"{where}: its names cannot be put in; expected deck, dbc and model on lines of their own")


def summary_lines(done: Commissioned) -> Sequence[str]:
    """What a terminal is told."""
    lines = [
        f"{mount}: {one.unseen_n:.1f} N on data not used ({one.train_n:.1f} N on its own)"
        for mount, one in done.mounts.items()
    ]
    lines += [f"{mount}: {line}" for mount, one in done.mounts.items() for line in (*one.taught_nothing, *one.untold)]
    lines += [f"missing: {piece.piece}; costs {piece.costs}" for piece in done.missing]
    lines += [f"kept: {done.kept}"] if done.kept else []
    return lines
