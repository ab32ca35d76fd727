"""Verbs of files: convert, info."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from thrustd.cli.roles import add_rename, add_time, time_axis
from thrustd.cli.verb import Verbs, add_json, add_verb, note, print_json, tell
from thrustd.core.errors import ThrustdError, UsageError, one_line
from thrustd.sources.plain_file import read_text

MODEL, DECK = '"thrustd-model/', '"thrustd.deck.v'  # beginnings of a schema, near the beginning of the file
EXPECTED = f'a mount model (schema {MODEL}1") or a brochure deck (schema {DECK}1")'
SCHEMA_WITHIN = 4000
SHOWN_KEYS = 5


def add_verbs(verbs: Verbs) -> None:
    convert = add_verb(
        verbs, "convert", convert_verb, "change a recording's file type (CSV, Parquet, MCAP, npz, mat)",
        "thrustd convert ftis_flight.npz -o flight.mcap\n"
        '  thrustd convert rig.csv --time "t [s]" --rename "Load [kN]=force_N*1000" --rename x=deformation_mm -o b.csv',
    )  # fmt: skip
    convert.add_argument("input", type=Path, help="recording or flight log")
    convert.add_argument("-o", "--out", type=Path, required=True, help="file to write; its ending says the type")
    convert.add_argument(
        "--time", metavar="COLUMN", default="time_s", help="column of time in seconds (default time_s)"
    )
    convert.add_argument(
        "--sampled", type=float, metavar="HZ", help="samples per second, for files without a time column"
    )
    add_rename(convert)
    convert.add_argument("--rate", type=float, metavar="HZ", help="resample onto a uniform grid")
    convert.add_argument(
        "--salvage", action="store_true", help="read the intact parts of a damaged MCAP file and report what is lost"
    )
    add_json(convert)

    info = add_verb(
        verbs, "info", info_verb, "describe a file: recording, flight log, model, deck or configuration",
        "thrustd info models/left-upper.json",
    )  # fmt: skip
    info.add_argument("file", type=Path, help="any file that thrustd reads, or the folder of a run")
    add_time(info)
    add_json(info)


def convert_verb(arguments: argparse.Namespace) -> int:
    from thrustd.records.files import write_recording
    from thrustd.records.rename import read_rename
    from thrustd.records.time_axis import TimeAxis, read_timed

    for option, rate_hz in (("--rate", arguments.rate), ("--sampled", arguments.sampled)):
        if rate_hz is not None and not 0 < rate_hz <= 1e6:
            raise UsageError(f"{option} {rate_hz:g}: expected above 0, at most 1e6 Hz")
    renames = [read_rename(text) for text in arguments.rename]
    axis = TimeAxis(arguments.time, arguments.sampled)
    record = read_timed(arguments.input, axis, renames, arguments.salvage)
    if arguments.rate is not None:
        record = _resampled(record, arguments.rate)
    write_recording(record, arguments.out)
    report = _recording_report(record, arguments.out)
    if arguments.json:
        print_json(report)
    else:
        for remark in record.notes:
            note(f"{arguments.input.name}: {remark}")
        print(f"{arguments.out}: {len(record)} samples, {record.duration_s:.1f} s, {len(record.channels)} channels")
    return 0


def _resampled(record: Any, rate_hz: float) -> Any:
    rows = record.duration_s * rate_hz
    if rows < 1:
        raise UsageError(
            f"--rate {rate_hz:g}: {record.name} is {record.duration_s:g} s long, that is {rows:.3g} rows; "
            "expected 1 row and more"
        )
    return record.resample(rate_hz)


def info_verb(arguments: argparse.Namespace) -> int:
    path: Path = arguments.file
    if path.suffix == ".json":
        report = _json_report(path)
    elif path.suffix == ".toml":
        report = _config_report(path)
    elif path.is_dir() or (path.suffix == ".mcap" and _is_flight_log(path)):
        report = _log_report(path)
    else:
        report = _columns_report(path, arguments)
    tell(arguments, report, lambda: _print_report(report))
    if report.get("problem"):  # what it is was said; another verb would refuse it
        note(f"thrustd: {one_line(report['problem'])}")
        return 2
    return 0


def _columns_report(path: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """Of a file whose time nobody has named, its columns, and how to name it."""
    from thrustd.core.errors import RecordingError
    from thrustd.records.files import READERS, load
    from thrustd.records.time_axis import timed
    from thrustd.records.units import unit_said

    if path.suffix.lower() not in READERS:
        raise UsageError(f"{path}: expected a file of type {', '.join((*READERS, '.json, .toml'))}, or a folder")
    axis, loaded = time_axis(arguments), load(path)
    try:
        return _recording_report(timed(path.name, loaded, axis), path)
    except RecordingError as problem:
        if arguments.time in loaded.columns or arguments.rate is not None:  # something else is wrong
            raise
        units = {name: unit_said(name) for name in loaded.columns}
        rows = max(map(len, loaded.columns.values()))
        return {"file": str(path), "kind": "columns without a time", "rows": rows, "problem": str(problem),
                "channels": units}  # fmt: skip


def _recording_report(record: Any, path: Path) -> dict[str, Any]:
    from thrustd.records.files import file_sha256
    from thrustd.records.units import unit_said

    return {
        "file": str(path),
        "kind": "recording",
        "samples": len(record),
        "duration_s": record.duration_s,
        "sample_hz": record.sample_hz,
        "sha256": file_sha256(path),
        "notes": list(record.notes),
        "channels": {name: unit_said(name) for name in record.channels},
    }


def _is_flight_log(path: Path) -> bool:
    from thrustd.core.errors import LogError
    from thrustd.sources.mcap_log import LogFile

    try:
        LogFile(path, salvage=True)
    except LogError:
        return False
    return True


def _log_report(path: Path) -> dict[str, Any]:
    from collections import Counter

    from thrustd.core.errors import LogError
    from thrustd.sources.log_run import LogRun, run_paths

    log = LogRun(run_paths(path), salvage=True)
    topics: Counter[str] = Counter()
    first_ns = last_ns = -1
    for message in log.messages():
        topics[message.topic] += 1
        first_ns = message.log_ns if first_ns < 0 else min(first_ns, message.log_ns)
        last_ns = max(last_ns, message.log_ns)
    try:
        for _ in log.batches():
            pass
    except LogError:
        pass  # an estimate log: outputs only
    return {
        "file": str(path),
        "kind": "flight log",
        "run": log.header.run,
        "parts": len(log.files),
        "engines": list(log.header.engines),
        "mounts": list(log.header.mounts),
        "duration_s": max(last_ns - first_ns, 0) * 1e-9,
        "events": log.read_events,
        "missing_events": log.missing_events,
        "cut": log.cut,
        "problem": log.damage,
        "files": sorted(log.header.files),
        "topics": dict(sorted(topics.items())),
        "notes": dict(log.header.notes),
    }


def _json_report(path: Path) -> dict[str, Any]:
    text = read_text(path)
    if DECK in text[:SCHEMA_WITHIN]:
        return _deck_report(path, text)
    if MODEL not in text[:SCHEMA_WITHIN]:
        raise UsageError(f"{path}: {_json_words(text)}; expected {EXPECTED}")
    from msgspec import to_builtins

    from thrustd.model.artifact import read_model
    from thrustd.model.compile import check_witness
    from thrustd.records.roles import roles_in

    spec = read_model(text, str(path))
    return _with_problem(lambda: check_witness(spec, str(path))) | {
        "file": str(path),
        "kind": "model",
        "name": spec.name,
        "structure": spec.structure,
        "valid": roles_in(spec.provenance).by_column(to_builtins(spec.valid)),
        "effects": {effect.name: effect.parameters for effect in spec.effects},
        "provenance": spec.provenance,
        "ledger": spec.ledger,
        "witness_rows": len(spec.witness.force_n) if spec.witness else 0,
    }


def _with_problem(check: Callable[[], Any]) -> dict[str, str]:
    """What `check` refuses, as a line of the report."""
    try:
        check()
    except ThrustdError as problem:
        return {"problem": str(problem)}
    return {}


def _json_words(text: str) -> str:
    """What a JSON file is that is neither model nor deck."""
    import msgspec

    if not text.strip():
        return "empty"
    try:
        value = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError) as problem:
        return f"not JSON: {problem}"
    if isinstance(value, dict):
        keys = ", ".join(list(value)[:SHOWN_KEYS]) or "none"
        return (
            f"a JSON object without a schema of thrustd, its keys: {keys}{', ...' if len(value) > SHOWN_KEYS else ''}"
        )
    return f"a JSON list of {len(value)}" if isinstance(value, list) else "a single JSON value"


def _deck_report(path: Path, text: str) -> dict[str, Any]:
    from thrustd.brochure.deck import Deck

    deck = Deck.from_json(text, str(path)).data
    spools = {"N1": deck.n1, "N2": deck.n2}
    engines = sorted({curve.engine for curves in spools.values() for curve in curves})
    return {
        "file": str(path),
        "kind": "brochure deck",
        "name": deck.name,
        "engine_type": deck.engine_type,
        "curves of engine": {
            str(engine): [name for name, curves in spools.items() if engine in {curve.engine for curve in curves}]
            for engine in engines
        },
        "provenance": {str(number): line for number, line in enumerate(deck.provenance, 1)},
        "relative errors, from the fit": deck.errors,
    }


def _config_report(path: Path) -> dict[str, Any]:
    from thrustd.core.config import read_config

    config = read_config(read_text(path), str(path))
    return {
        "file": str(path),
        "kind": "configuration",
        "aircraft": config.aircraft.name,
        "engines": config.aircraft.engines,
        "mounts": [mount.name for mount in config.mount],
        "sample_hz": config.adc.sample_hz,
    }


def _print_report(report: dict[str, Any]) -> None:
    import msgspec

    from thrustd.model.effects import effect_said
    from thrustd.records.roles import roles_in

    unit = roles_in(report.get("provenance") or {}).unit
    for key, value in msgspec.to_builtins(report).items():
        if key == "problem" or value in ("", {}, []):
            continue  # said on standard error; or nothing to say
        if isinstance(value, dict):
            print(f"{key}:")
            for name, item in value.items():
                print(f"  {_one_line(effect_said(name) if key == 'effects' else name)}  {_one_line(item)}")
        elif key == "ledger":
            print("error ledger:")
            for entry in value:
                before, after = (f"{entry[f'rmse_{when}_n']:.1f} {unit}" for when in ("before", "after"))
                print(f"  + {_one_line(entry['added'])}: {before} -> {after}")
        else:
            print(f"{key}: {_one_line(value)}")


def _one_line(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} = {_one_line(item)}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_one_line, value)) or "none"
    return f"{value:.6g}" if isinstance(value, float) else one_line(str(value))
