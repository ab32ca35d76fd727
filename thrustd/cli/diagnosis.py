"""The loop on the command line: compare, diagnose, extend, and the shelf of effects."""

import argparse
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thrustd.cli.files import read_models, split_models
from thrustd.cli.roles import (
    add_reference,
    note_other_mounts,
    others_of_engine,
    own_words,
    place_in_aircraft,
    recordings_to_judge,
    reference,
    roles_of_arguments,
)
from thrustd.cli.verb import Verbs, add_json, add_verb, console, file_type, note, progress, tell
from thrustd.core.errors import UsageError
from thrustd.sources.plain_file import read_text

if TYPE_CHECKING:
    from thrustd.diagnose.search.question import Given
    from thrustd.model.effect import Effect
    from thrustd.records.recording import Recording


def add_verbs(verbs: Verbs) -> None:
    _add_compare(verbs)
    _add_diagnose(verbs)
    _add_extend(verbs)
    _add_shelf(verbs)


def _add_compare(verbs: Verbs) -> None:
    compare = add_verb(
        verbs, "compare", compare_verb, "compare models with measurements: how wrong, and where",
        "thrustd compare mount.json measured.csv --pictures out/compare",
    )  # fmt: skip
    compare.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="models (.json) and recordings; estimate logs (.mcap) alone: NIS and whiteness of the innovations",
    )
    add_reference(compare)
    compare.add_argument("--load-cell-std", type=float, metavar="N", help="noise of the reference, one sigma, N")
    compare.add_argument("--pictures", type=Path, metavar="FOLDER", help="folder for the pictures")
    add_json(compare)


def _add_diagnose(verbs: Verbs) -> None:
    diagnose = add_verb(
        verbs, "diagnose", diagnose_verb, "find the missing effect that explains what a model leaves unexplained",
        "thrustd diagnose mount.json measured.csv",
    )  # fmt: skip
    _add_model_and_data(diagnose)
    _add_known(diagnose)
    _add_effects(diagnose, "also judge this effect: a name or an expression over channels; may be repeated")
    diagnose.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="folder for pictures of the remaining dependence"
    )
    add_json(diagnose)


def _add_extend(verbs: Verbs) -> None:
    extend = add_verb(
        verbs, "extend", extend_verb, "add an effect and estimate it, if the error on held-back data falls",
        "thrustd extend mount.json measured.csv --effect axial_inertia -o better.json\n"
        "  thrustd extend mount.json --given axial_inertia.mass_kg=171.7 -o better.json",
    )  # fmt: skip
    _add_model_and_data(extend, "*")
    _add_known(extend)
    _add_effects(extend, "effect to add: a name or an expression over channels; may be repeated")
    extend.add_argument(
        "--given", action="append", default=[], metavar="EFFECT.PARAMETER=VALUE",
        help="add an effect of known size without estimating it; may be repeated",
    )  # fmt: skip
    extend.add_argument("-o", "--out", type=file_type(".json"), required=True, help="model to write")
    add_json(extend)


def _add_shelf(verbs: Verbs) -> None:
    effects = add_verb(
        verbs, "effects", effects_verb, "list the physical effects, or explain one", "thrustd effects axial_inertia"
    )
    effects.add_argument("name", nargs="?", help="effect to explain")
    effects.add_argument("--picture", type=Path, metavar="PNG", help="with a name: picture of its signature")
    add_json(effects)


def compare_verb(arguments: argparse.Namespace) -> int:
    from thrustd.diagnose.compare.compare import compare

    if all(path.suffix == ".mcap" for path in arguments.files):
        from thrustd.diagnose.compare.innovations import innovations

        _show(innovations(arguments.files), arguments)
        return 0
    if arguments.load_cell_std is not None and not 0 < arguments.load_cell_std <= 1e6:
        raise UsageError(f"--load-cell-std {arguments.load_cell_std:g}: expected above 0, at most 1e6 N")
    models, data = split_models(arguments.files)
    specs, records = read_models(models), recordings_to_judge(data, arguments)
    note_other_mounts(arguments, specs.values())
    with progress("compare") as advance, own_words(roles_of_arguments(arguments)):
        report = compare(
            specs,
            records,
            load_cell_std_n=arguments.load_cell_std,
            progress=lambda share, what: advance(share),
            **reference(arguments),
        )
    _show(report, arguments)
    if arguments.pictures is not None:
        from thrustd.diagnose.compare.before_after import before_after_pictures
        from thrustd.diagnose.compare.pictures import comparison_pictures  # matplotlib takes a second to import

        for comparison in report.comparisons:
            _say_written(comparison_pictures(comparison, arguments.pictures))
        _say_written(before_after_pictures(report.comparisons, arguments.pictures))
    return 0


def diagnose_verb(arguments: argparse.Namespace) -> int:
    from thrustd.diagnose.compare.reference import rest_remarks
    from thrustd.diagnose.search.diagnose import diagnose

    extra = _effects(arguments)
    records = recordings_to_judge(arguments.data, arguments)
    (spec,) = read_models([arguments.model]).values()
    note_other_mounts(arguments, [spec])
    first = _first_look(records, arguments)
    with progress(f"diagnose {arguments.model.name}") as advance, own_words(roles_of_arguments(arguments)):
        report = diagnose(
            spec,
            records,
            name=arguments.model.stem,
            extra=extra,
            given=_known(arguments),
            progress=lambda share, what: advance(share),
        )
    for line in (*first, *rest_remarks(records, place_in_aircraft(arguments), [spec])):
        note(line)
    _show(report, arguments)
    if arguments.pictures is not None and report.depends_on:
        from thrustd.diagnose.compare.pictures import dependence_picture

        path = arguments.pictures / "depends_on.png"
        _say_written([dependence_picture(report.depends_on, path, roles_of_arguments(arguments))])
    return 0


def extend_verb(arguments: argparse.Namespace) -> int:
    from thrustd.cli.files import write_model_file
    from thrustd.diagnose.compare.reference import rest_remarks
    from thrustd.diagnose.extend.extend import extend

    if arguments.given:
        return _given(arguments)
    if not arguments.data:
        raise UsageError("extend: no recording; expected at least one to estimate an effect from, or --given")
    effects = _effects(arguments)
    if not effects:
        raise UsageError("extend: --effect is missing; expected a name (see thrustd effects) or an expression")
    records = recordings_to_judge(arguments.data, arguments)
    (spec,) = read_models([arguments.model]).values()
    note_other_mounts(arguments, [spec])
    first = _first_look(records, arguments)
    with progress(f"extend {arguments.model.name}") as advance, own_words(roles_of_arguments(arguments)):
        report = extend(
            spec,
            records,
            effects,
            name=arguments.out.stem,
            given=_known(arguments),
            progress=lambda share, what: advance(share),
        )
    for line in (*first, *rest_remarks(records, place_in_aircraft(arguments), [spec])):
        note(line)
    write_model_file(report.spec, arguments.out)
    _show(report, arguments)
    note(f"written: {arguments.out}")
    return 0


def _given(arguments: argparse.Namespace) -> int:
    from thrustd.cli.files import write_model_file
    from thrustd.diagnose.extend.given import read_given, with_given

    if arguments.data or arguments.effect or arguments.effect_file:
        raise UsageError("extend: --given takes no recordings and no --effect; expected one after the other")
    (spec,) = read_models([arguments.model]).values()
    extended = with_given(spec, read_given(arguments.given))
    write_model_file(extended, arguments.out)
    said = f"{arguments.out}: {', '.join(arguments.given)} put in; no error was measured"
    tell(arguments, {"model": str(arguments.out), "given": extended.provenance["given"]}, lambda: print(said))
    return 0


def effects_verb(arguments: argparse.Namespace) -> int:
    from thrustd.diagnose.extend.effect_card import card_json, card_picture, card_text, shelf_text
    from thrustd.model.effects import effect_named, shelf

    if arguments.picture and not arguments.name:
        raise UsageError("effects: --picture draws one effect; expected its name as well")
    chosen = [effect_named(arguments.name)] if arguments.name else list(shelf().values())
    if arguments.name and arguments.picture:
        note(f"picture: {card_picture(chosen[0], arguments.picture)}")
    said = card_text(chosen[0]) if arguments.name else shelf_text()
    tell(arguments, [card_json(effect) for effect in chosen], lambda: print(said))
    return 0


def _known(arguments: argparse.Namespace) -> "Given":
    """What diagnose and extend are told beside model and data."""
    from thrustd.diagnose.search.question import Given
    from thrustd.diagnose.search.rig import read_rig

    rig = read_rig(read_text(arguments.rig), str(arguments.rig)) if arguments.rig else None
    others = others_of_engine(arguments) if arguments.against == "brochure" else ()
    return Given(rig, recordings_to_judge(arguments.bench, arguments), **reference(arguments), others=others)


def _first_look(records: list["Recording"], arguments: argparse.Namespace) -> list[str]:
    """What the recordings cannot tell: said before the answer, and not beside a refusal, which is one line."""
    from thrustd.core.errors import RecordingError
    from thrustd.diagnose.compare.first_look import first_look
    from thrustd.diagnose.compare.reference import BROCHURE, as_mount, with_reference

    place, found = place_in_aircraft(arguments), list[str]()
    with suppress(RecordingError):  # of what they lack the verb itself complains
        for record in records if arguments.against != BROCHURE else ():
            found += first_look([with_reference(as_mount(record, place), arguments.against, place)]).lines
    return found


def _say_written(pictures: list[Path]) -> None:
    for path in pictures:
        note(f"picture: {path}")


def _show(report: Any, arguments: argparse.Namespace) -> None:
    tell(arguments, report.to_json(), lambda: report.print(console()))


def _add_model_and_data(parser: argparse.ArgumentParser, count: str = "+") -> None:
    parser.add_argument("model", type=Path, help="model artifact (.json)")
    parser.add_argument("data", type=Path, nargs=count, help="recordings (CSV, Parquet, MCAP, npz, mat)")
    add_reference(parser)


def _add_known(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rig", type=Path, metavar="FILE", help="what is known of the rig (TOML; default: PH-LAB's)")
    parser.add_argument(
        "--bench", type=Path, action="append", default=[], metavar="RECORD",
        help="bench record of the model, for a model that carries none; may be repeated",
    )  # fmt: skip


def _add_effects(parser: argparse.ArgumentParser, words: str) -> None:
    parser.add_argument("--effect", action="append", default=[], metavar="NAME|EXPRESSION", help=words)
    parser.add_argument("--effect-file", action="append", default=[], type=Path, help="Python file with an EFFECT")


def _effects(arguments: argparse.Namespace) -> list["Effect | str"]:
    """Effects from files, names and expressions; what no recording could mend is refused before one is read."""
    from thrustd.diagnose.extend.effect_file import load_effect_file
    from thrustd.model.effects import effect_named
    from thrustd.model.expression import LacksColumnError

    loaded = [effect for path in arguments.effect_file for effect in load_effect_file(path)]
    for effect in arguments.effect:
        with suppress(LacksColumnError):
            effect_named(effect)
    return [*loaded, *arguments.effect]
