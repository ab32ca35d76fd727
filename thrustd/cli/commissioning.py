"""Verbs of an aircraft's first days: commission, zero, calibrate."""

import argparse
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thrustd.cli.verb import Verbs, add_json, add_verb, console, day, file_type, note, print_json, progress, tell
from thrustd.core.errors import UsageError
from thrustd.core.measures import SIGMAS_95
from thrustd.installation.folder import configuration_of
from thrustd.installation.shipped import CONFIGURATION, given_or_shipped
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import read_text

if TYPE_CHECKING:
    from thrustd.commission.drag import DragFit, FlightDrag
    from thrustd.core.calibration import Calibration
    from thrustd.installation.installation import Installation
    from thrustd.records.recording import Recording

WEEK_DAYS = 7
DAYS = datetime(2000, 1, 1, tzinfo=UTC).timestamp()  # a clock before that was never set


def add_verbs(verbs: Verbs) -> None:
    for add in (_add_commission, _add_zero, _add_calibrate):
        add(verbs)


def _add_commission(verbs: Verbs) -> None:
    new = add_verb(
        verbs, "commission", commission_verb, "make an aircraft's folder that can fly from bench records and flights",
        "thrustd commission --bench upper=b1.parquet lower=b2.parquet --weight w.parquet \\\n"
        "    --chamber cold.parquet hot.parquet --flights f1.npz f2.npz --aircraft ph-lab.toml -o aircraft/",
    )  # fmt: skip
    new.add_argument(
        "--bench",
        nargs="+",
        required=True,
        metavar="MOUNT=FILE",
        help="bench record of every mount; upper= is the upper mount of both engines",
    )
    new.add_argument("--weight", type=Path, nargs="+", default=[], help="record of one mount under changing accel_z_g")
    new.add_argument("--chamber", type=Path, nargs="+", default=[], help="records of one mount, cold and hot")
    new.add_argument(
        "--flights", type=Path, nargs="+", default=[], help="flights with fuel flow, N1 and air data, to fit the deck"
    )
    new.add_argument(
        "--aircraft",
        type=configuration_of,
        help=f"configuration to start from, not the data file it names (default: the shipped {CONFIGURATION})",
    )
    new.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER", help="folder to make")
    add_json(new)


def _add_zero(verbs: Verbs) -> None:
    zero = add_verb(
        verbs, "zero", zero_verb, "measure the zeros of the transducers from a log with the engines off",
        "thrustd zero before-start.mcap -o my/calibration.toml",
    )  # fmt: skip
    zero.add_argument("log", type=Path, help="log of `thrustd run` that begins with the engines off")
    _add_file(zero)


def _add_calibrate(verbs: Verbs) -> None:
    calibrate = add_verb(
        verbs, "calibrate", calibrate_verb, "calibrate mounts: blocks, tethered run, drag in flight, hours in service",
        "thrustd calibrate blocks blocks.csv --mount left_upper -o my/calibration.toml\n"
        "  thrustd calibrate tether run.mcap --cell cell.csv -o my/calibration.toml\n"
        "  thrustd calibrate drag flight.mcap -o my/calibration.toml\n"
        "  thrustd calibrate hours flight1.mcap flight2.mcap -o my/calibration.toml",
    )  # fmt: skip
    calibrate.add_argument("what", choices=("blocks", "tether", "drag", "hours"))
    calibrate.add_argument(
        "files",
        type=Path,
        nargs="+",
        help="blocks: the record of the blocks; tether, drag, hours: logs of `thrustd run`",
    )
    calibrate.add_argument("--mount", help="with blocks: the mount whose transducer was measured")
    calibrate.add_argument("--cell", type=Path, help="with tether: record of the load cell (time_s, force_N)")
    calibrate.add_argument("--cell-std", type=float, default=0.0, help="with tether: sigma of its scale, as 0.002")
    _add_file(calibrate)


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o", "--out", type=file_type(".toml"), required=True, help="calibration file to write or update"
    )
    parser.add_argument("--config", type=configuration_of, help="use this configuration instead of the log's own")
    parser.add_argument("--date", type=day, help="date of the measurement (default: the log's, else today)")
    add_json(parser)


def commission_verb(arguments: argparse.Namespace) -> int:
    from thrustd.commission.commission import commission, summary_lines
    from thrustd.commission.pieces import read_pieces
    from thrustd.installation.installation import read_installation

    config = given_or_shipped(arguments.aircraft, CONFIGURATION, "--aircraft")
    installation = read_installation(config)
    given = arguments.bench, arguments.weight, arguments.chamber, arguments.flights
    with progress("commission") as advance:
        pieces = read_pieces(*given, installation)
        done = commission(pieces, installation, config, arguments.out, lambda share, what: advance(share))
    if arguments.json:
        mounts = {name: {"unseen_n": one.unseen_n, "notes": one.lines} for name, one in done.mounts.items()}
        missing = [piece.piece for piece in done.missing]
        print_json({"folder": str(done.folder), "config": str(done.config), "mounts": mounts, "missing": missing})
    else:
        print("\n".join(summary_lines(done)))
    note(f"written: {done.config}, {done.folder / 'report.html'}")
    return 0


def zero_verb(arguments: argparse.Namespace) -> int:
    from thrustd.commission.recalibrate import walks
    from thrustd.commission.zero import with_zeros, zeros

    flight, installation, on = _flight(arguments, arguments.log)
    found = zeros(flight, installation)
    refused = [each for each in found if each.refused]
    calibration = with_zeros(_known(arguments), found, on)
    if len(refused) < len(found):
        _write(arguments, calibration)
    if arguments.json:
        print_json({"date": str(on), "zeros": found, "recalibrate_by": calibration.recalibrate_by})
    else:
        for each in found:
            wide = f"{1e3 * each.zero_mm:+.1f} +- {1e3 * SIGMAS_95 * each.std_mm:.1f} um"
            said = f"refused: {each.refused}" if each.refused else f"{wide}, {each.before_n:+.0f} N until now"
            newest = calibration.of(each.mount).zeros[-1:]
            if not each.refused and abs(newest[0].mm - each.zero_mm) > 1e-6:
                why = "found under load" if newest[0].on == on else f"of {newest[0].on}"
                said += f"; the file keeps {1e3 * newest[0].mm:+.1f} um, {why}"
            print(f"{each.mount}: {said}")
        for walk in walks(calibration):
            rate, half = WEEK_DAYS * 1e3 * walk.mm_day, WEEK_DAYS * 1e3 * walk.half_mm_day
            print(f"{walk.mount} walks {rate:+.1f} +- {half:.1f} um a week: {walk.again} again by {walk.by}")
    return 1 if refused else 0


def calibrate_verb(arguments: argparse.Namespace) -> int:
    return {"blocks": _blocks, "tether": _tether, "drag": _drag, "hours": _hours}[arguments.what](arguments)


def _blocks(arguments: argparse.Namespace) -> int:
    from thrustd.commission.gauge_blocks import block_curve, with_curve
    from thrustd.commission.tether_file import without_tether
    from thrustd.records.files import read_recording

    if arguments.mount is None:
        raise UsageError("calibrate blocks: --mount is missing; expected the mount's name in the configuration")
    from thrustd.installation.installation import read_installation

    read_installation(given_or_shipped(arguments.config, CONFIGURATION, "--config")).place(arguments.mount)  # is there
    curve = block_curve(read_recording(_only(arguments)))
    known = _known(arguments) or _new(str(arguments.date or datetime.now(UTC).date()))
    _write(arguments, with_curve(without_tether(known), arguments.mount, curve))
    said = f"{arguments.mount}: {len(curve.read_mm)} blocks, {curve.true_mm[0]:g} to {curve.true_mm[-1]:g} mm"
    off = f"up to {1e3 * curve.largest_mm:.1f} um off a line, +- {1e3 * SIGMAS_95 * curve.std_mm:.1f} um"
    tell(arguments, {"mount": arguments.mount, "curve": curve}, lambda: print(f"{said}; {off}"))
    if known.tethered is not None:
        note(f"warning: the tethered run of {known.tethered} was read by another curve and is taken out: read it again")
    return 0


def _tether(arguments: argparse.Namespace) -> int:
    from thrustd.commission.tether import fit_tether
    from thrustd.commission.tether_file import with_tether, without_run, without_tether
    from thrustd.records.files import read_recording

    if arguments.cell is None:
        raise UsageError("calibrate tether: --cell is missing; expected the load cell's record (time_s, force_N)")
    cell = read_recording(arguments.cell)
    flight, installation, on = _flight(arguments, _only(arguments), without_run)
    fit = fit_tether(flight, cell, without_run(installation), arguments.cell_std)
    old = _known(arguments) or installation.calibration() or _new(on)
    _write(arguments, with_tether(without_tether(old), fit, on, cell.name))
    tell(arguments, {"date": str(on), "fit": fit}, lambda: _print_tether(fit))
    return 0


def _print_tether(fit: Any) -> None:
    from rich.table import Table

    table = Table("number", "value", "95 %", "told by the run", title="tethered static run")
    for each in fit.numbers:
        digits = {"um": 1, "um/K": 2}.get(each.unit, 4)
        told = "yes" if each.told else "no, its prior"
        unit = "" if each.unit == "-" else f" {each.unit}"
        table.add_row(each.what, f"{each.value:.{digits}f}{unit}", f"+- {each.half_width:.{digits}f}{unit}", told)
    console().print(table)
    print(f"cell minus all mounts: {fit.before_n:.0f} -> {fit.after_n:.0f} N RMS; cell's clock {fit.lag_s:+.1f} s")
    for name in fit.gains:
        rows = [row[1:] for row in fit.bands_n if row[0] == name]
        at = ", ".join(f"{force_n:.0f}" for force_n, *_ in rows)
        before, after = (", ".join(f"{SIGMAS_95 * row[i]:.0f}" for row in rows) for i in (1, 2))
        print(f"{name} at {at} N: +- {before} -> {after} N by gain and zero")
    for line in fit.remarks:
        print(f"warning: {line}")


def _drag(arguments: argparse.Namespace) -> int:
    from thrustd.commission.drag import fit_drag, missing_stretch, with_drag, without_drag

    read = [_flight(arguments, path, without_drag) for path in arguments.files]
    _, installation, on = read[-1]
    fit = fit_drag([flight for flight, *_ in read], installation)
    new = with_drag(installation.calibration() or _new(on), fit, installation, on)
    _write(arguments, new)
    for said in filter(None, map(missing_stretch, fit.flights)):
        note(said)
    if arguments.json:
        print_json({"date": on, "drag": new.drag, "fit": fit})
        return 0
    for one in fit.flights:
        print(f"{one.flight}: {one.m2:+.4f} +- {SIGMAS_95 * one.std_m2:.4f} m2, {one.where}")
        print(f"{one.flight}: mounts lean {_leans(one)} deg, nose up")
    if len(fit.flights) > 1:
        print(f"{len(fit.flights)} flights together: mounts lean {_leans(fit)} deg")
    assert new.drag is not None
    print(f"drag of a nacelle: {new.drag.m2:.4f} +- {SIGMAS_95 * new.drag.std_m2:.4f} m2")
    return 0


def _leans(told: "FlightDrag | DragFit") -> str:
    pairs = zip(told.lean_deg, told.lean_std_deg, strict=True)
    return ", ".join(f"{deg:+.2f} +- {SIGMAS_95 * std:.2f}" for deg, std in pairs)


def _hours(arguments: argparse.Namespace) -> int:
    from thrustd.commission.service import with_hours

    calibration = None
    for path in arguments.files:
        flight, installation, on = _flight(arguments, path)
        calibration = with_hours(calibration or _known(arguments) or _new(on), flight, installation.config)
    assert calibration is not None
    _write(arguments, calibration)
    hours = {name: mount.service_h for name, mount in calibration.mount.items()}
    said = "\n".join(f"{name}: {value:.2f} h in service" for name, value in hours.items())
    tell(arguments, {"service_h": hours}, lambda: print(said))
    return 0


def _only(arguments: argparse.Namespace) -> Path:
    if len(arguments.files) != 1:
        raise UsageError(f"calibrate {arguments.what}: {len(arguments.files)} files; expected one")
    path: Path = arguments.files[0]
    return path


def _flight(
    arguments: argparse.Namespace, path: Path, seen_by: "Callable[[Installation], Installation] | None" = None
) -> "tuple[Recording, Installation, str]":
    """Columns of a log's events, its installation, its day; `seen_by`: the installation that they are read by."""
    from thrustd.installation.installation import read_installation
    from thrustd.replay.columns import flight_columns
    from thrustd.replay.replay import open_installation
    from thrustd.sources.log_run import LogRun, run_paths

    config = read_installation(arguments.config) if arguments.config else None
    log = LogRun(run_paths(path))
    installation = open_installation(log, config)
    if (known := _known(arguments)) is not None:
        from thrustd.core.calibration import write_calibration

        installation = installation.calibrated_by(write_calibration(known), str(arguments.out))
    with progress(f"read {path.name}") as advance:
        flight = flight_columns(log, seen_by(installation) if seen_by else installation, advance)
    began_s = log.header.epoch_offset_ns * 1e-9 + float(flight.time_s[0])
    began = datetime.fromtimestamp(began_s if began_s > DAYS else datetime.now(UTC).timestamp(), UTC).date()
    return flight, installation, str(arguments.date or began)


def _known(arguments: argparse.Namespace) -> "Calibration | None":
    """What the file says so far."""
    from thrustd.core.calibration import read_calibration

    path: Path = arguments.out
    return read_calibration(read_text(path), str(path)) if path.exists() else None


def _new(on: str) -> "Calibration":
    from thrustd.core.calibration import Calibration

    return Calibration(on=on)


def _write(arguments: argparse.Namespace, calibration: "Calibration") -> None:
    from thrustd.core.calibration import read_calibration, write_calibration

    text = write_calibration(calibration)
    read_calibration(text, str(arguments.out))  # nothing is written that a flight would refuse
    write_whole(arguments.out, text)
    note(f'written: {arguments.out} (first line of the configuration: calibration = "{arguments.out.name}")')
