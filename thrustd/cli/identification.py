"""Verbs that make models and decks: identify, plan-test, compile, brochure."""

import argparse
import re
from pathlib import Path
from typing import Any

from thrustd.cli.files import check_outputs, read_models, write_model_file
from thrustd.cli.roles import (
    add_mount,
    add_roles,
    note_other_mounts,
    own_words,
    place_in_aircraft,
    recordings_in_roles,
    roles_of_arguments,
)
from thrustd.cli.verb import Verbs, add_json, add_verb, console, file_type, note, print_json, progress, seed, tell
from thrustd.core.errors import UsageError
from thrustd.installation.shipped import DECK, given_or_shipped
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import read_text


def add_verbs(verbs: Verbs) -> None:
    _add_identify(verbs)
    _add_plan(verbs)
    _add_compile(verbs)
    _add_brochure(verbs)


def _add_identify(verbs: Verbs) -> None:
    identify = add_verb(
        verbs, "identify", identify_verb, "estimate models from bench records, score them on other records",
        "thrustd identify bench.csv --validate other.csv -o mount.json\n"
        "  thrustd identify bench.parquet --validate other.parquet --all -o mount.json\n"
        "  thrustd identify tanks.csv --rate 0.25 --input pump_V --output level_V -o tanks.json",
    )  # fmt: skip
    identify.add_argument("records", type=Path, nargs="+", help="bench records with deformation_mm and force_N")
    identify.add_argument(
        "--validate", type=Path, nargs="+", default=[], help="records to judge the model on; it is not fitted to them"
    )
    identify.add_argument("-o", "--out", type=file_type(".json"), required=True, help="model artifact to write")
    add_roles(identify)
    identify.add_argument(
        "--validate-columns",
        nargs=2,
        metavar=("INPUT", "OUTPUT"),
        help="input and output columns of the --validate records, if named differently",
    )
    identify.add_argument(
        "--structure",
        action="append",
        default=[],
        help="structure to fit (default hw-pwl+prandtl-ishlinskii, others if it fails)",
    )
    identify.add_argument("--all", action="store_true", help="fit every structure of the thesis, side by side")
    identify.add_argument(
        "--order", default="auto", help="poles of the linear block (default auto: as many as the data show)"
    )
    identify.add_argument(
        "--segments", type=int, help="segments of both curves (default: enough to stay within a tenth of the noise)"
    )
    add_json(identify)


def _add_plan(verbs: Verbs) -> None:
    plan = add_verb(
        verbs, "plan-test", plan_verb, "write a bench programme for the rig",
        "thrustd plan-test multisine --hours 2 -o out/programme.csv",
    )  # fmt: skip
    plan.add_argument("programme", choices=("steps", "multisine", "sweep", "weight"))
    plan.add_argument(
        "-o",
        "--out",
        type=file_type(".csv"),
        required=True,
        help="programme to write: time_s, force_N; weight: accel_z_g too",
    )
    plan.add_argument(
        "--hours", type=float, default=8.0, help="length in hours, with a first minute at rest (default 8)"
    )
    plan.add_argument("--low", type=float, default=0.0, metavar="N", help="smallest force (default 0)")
    plan.add_argument("--high", type=float, default=9000.0, metavar="N", help="largest force (default 9000)")
    plan.add_argument("--seed", type=seed, default=0, help="seed of the random levels, times and phases (default 0)")


def _add_compile(verbs: Verbs) -> None:
    compile_ = add_verb(
        verbs, "compile", compile_verb, "prepare a model for a sample rate and prove it against its witness rows",
        "thrustd compile models/left-upper.json --rate 1000\n"
        "  thrustd compile models/left-upper.json --rate 1000 --c mount.c\n"
        "  thrustd compile my/models/left_upper.json --rate 1000 --mount left_upper --config my/hil.toml --c mount.c",
    )  # fmt: skip
    compile_.add_argument("model", type=Path, help="model artifact (.json)")
    compile_.add_argument("--rate", type=float, required=True, metavar="HZ", help="sample rate of the ADC")
    compile_.add_argument("--c", type=file_type(".c"), metavar="FILE", help="also write the model as one C99 file")
    compile_.add_argument(
        "--prefix", default="mount", help="prefix of every name in the C file (default mount: mount_init, mount_step)"
    )
    add_mount(compile_, "fly it as this mount of the configuration, with what was measured of it; e.g. left_upper")
    add_json(compile_)


def _add_brochure(verbs: Verbs) -> None:
    brochure = add_verb(
        verbs, "brochure", brochure_verb, "fit the per-engine curves of a brochure deck to recorded flights",
        "thrustd brochure fit flight1.npz flight2.npz -o models/brochure/my-engines.json",
    )  # fmt: skip
    brochure.add_argument("action", choices=("fit",))
    brochure.add_argument("flights", type=Path, nargs="+", help="recordings with n1_pct_left, fuel_flow_kg_s_left, ...")
    brochure.add_argument("-o", "--out", type=file_type(".json"), required=True, help="deck to write")
    brochure.add_argument("--base", type=Path, help=f"deck to start from (default: the shipped {DECK})")
    brochure.add_argument(
        "--pairs", type=Path, help="pairs of the brochure program (CSV): refit the thrust surface too"
    )
    add_json(brochure)


def identify_verb(arguments: argparse.Namespace) -> int:
    from thrustd.identify.identify import OTHERS, identify
    from thrustd.identify.structures import shelf
    from thrustd.records.roles import Roles

    roles = roles_of_arguments(arguments)
    train = recordings_in_roles(arguments.records, arguments, roles)
    other = Roles(*arguments.validate_columns) if arguments.validate_columns else roles
    validate = recordings_in_roles(arguments.validate, arguments, other)
    names = list(shelf()) if arguments.all else arguments.structure
    wish = _wish(arguments)
    with progress("identify") as advance:
        others = () if roles.own else OTHERS
        with own_words(roles):
            found = identify(train, validate, names, wish, arguments.out.stem, advance, others)
    write_model_file(found.spec, arguments.out)
    tell(arguments, found.to_json(), lambda: found.print(console()))
    best = f", of {len(found.scores)} the best on data not fitted to" if len(found.scores) > 1 else ""
    note(f"written: {arguments.out} ({found.spec.structure}{best})")
    return 0 if found.usable else 1  # the model is there to be looked at; a script stops here


def _wish(arguments: argparse.Namespace) -> Any:
    """Order and segments of the artifact, where they were asked for."""
    from thrustd.identify.regression.general import Asked

    if arguments.segments is not None and not 1 <= arguments.segments <= 100:
        raise UsageError(f"--segments {arguments.segments}: expected 1 to 100")
    if arguments.order == "auto":
        return Asked(segments=arguments.segments)
    if not (arguments.order.isdecimal() and 1 <= int(arguments.order) <= 20):
        raise UsageError(f"--order {arguments.order}: expected 1 to 20, or auto")
    return Asked(order=int(arguments.order), segments=arguments.segments)


def plan_verb(arguments: argparse.Namespace) -> int:
    from thrustd.bench.plan_test import BenchPlan, as_csv, programme

    plan = BenchPlan(hours=arguments.hours, low_n=arguments.low, high_n=arguments.high, seed=arguments.seed)
    columns = programme(arguments.programme, plan)
    write_whole(arguments.out, as_csv(columns))
    print(f"{arguments.out}: {arguments.programme}, {arguments.hours:g} h, {len(columns['time_s'])} rows")
    return 0


def compile_verb(arguments: argparse.Namespace) -> int:
    import numpy as np

    from thrustd.model.c_model import c_source
    from thrustd.model.calibrated import calibrated
    from thrustd.model.compile import compile_model, rate_difference_n

    (spec,) = read_models([arguments.model]).values()
    if not 1 <= arguments.rate <= 100_000:
        raise UsageError(f"--rate {arguments.rate:g}: expected 1 to 100000 Hz")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", arguments.prefix):
        raise UsageError(f"--prefix {arguments.prefix}: expected the beginning of a name in C, such as left_upper")
    witness = spec.witness
    assert witness is not None  # read_models refuses a model without
    if (place := place_in_aircraft(arguments)) is not None:
        note_other_mounts(arguments, [spec])
        spec = calibrated(spec, place, str(arguments.model))
    own, other = compile_model(spec, witness.rate_hz), compile_model(spec, arguments.rate)
    difference_n = rate_difference_n(own, other)
    report = {
        "model": str(arguments.model),
        "rate_hz": arguments.rate,
        "witness_rows": len(witness.force_n),
        "states": int(other.start(np.zeros(len(other.channels))).size),
        "channels": list(dict.fromkeys(other.channels)),
        "worst_difference_between_rates_n": difference_n,
    }
    if arguments.c is not None:
        write_whole(arguments.c, c_source(other, arguments.prefix))
        note(f"written: {arguments.c} ({arguments.prefix}_init, {arguments.prefix}_step)")
    if arguments.json:
        print_json(report)
    else:
        print(f"{arguments.model}: {len(witness.force_n)} witness rows reproduced")
        print(f"reads {', '.join(report['channels'])}")
        print(f"at {arguments.rate:g} Hz within {difference_n:.2g} N of the same model at {witness.rate_hz:g} Hz")
    return 0


def brochure_verb(arguments: argparse.Namespace) -> int:
    from thrustd.brochure.fit.deck_fit import fit_deck_file, report_lines, rms_left_out_pct

    arguments.base = given_or_shipped(arguments.base, DECK, "--base")
    check_outputs(vars(arguments))
    read_text(arguments.base)
    with progress("brochure fit"):
        fit = fit_deck_file(arguments.flights, arguments.out, arguments.base, arguments.pairs)
    rows, rms = report_lines(fit), rms_left_out_pct(fit)
    for line in fit.remarks:
        note(line)
    if arguments.json:
        said = {"leave_one_flight_out": rows, "leave_one_flight_out_rms_pct": rms, "remarks": fit.remarks}
        print_json({"deck": str(arguments.out)} | said)
        return 0
    from rich.table import Table

    table = Table("engine", "flight left out", "error of N1 source, %", "N2, %", title="leave one flight out")
    for row in rows:
        n2 = row["n2_left_out_error_pct"]
        table.add_row(
            row["engine"], row["flight"], f"{row['n1_left_out_error_pct']:.2f}", "-" if n2 is None else f"{n2:.2f}"
        )
    for engine, rms_pct in rms.items():
        shown = [f"{rms_pct[spool]:.2f}" if spool in rms_pct else "-" for spool in ("n1", "n2")]
        table.add_row(engine, "all (RMS)", *shown)
    console().print(table)
    note(f"written: {arguments.out}")
    return 0
