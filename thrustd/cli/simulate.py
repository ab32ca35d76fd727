"""The verb simulate: the twin makes a flight, a bench record or a hidden-effect exercise, or plays on real wires."""

import argparse
import gc
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from math import isfinite
from pathlib import Path
from typing import Any

from thrustd.cli.verb import Advance, Verbs, add_json, add_verb, note, progress, seed, tell
from thrustd.core.errors import UsageError
from thrustd.installation.folder import configuration_of
from thrustd.installation.shipped import HIL, given_or_shipped

TELL_EVENTS = 500  # between two moves of the progress bar
MATTERS = ("thrust_line_mm", True), ("share", False)  # knobs, and whether it is with the statics that they do anything
BENCH_KINDS = ("steps", "sine", "multisine", "weight")


def add_verbs(verbs: Verbs) -> None:
    parser = add_verb(
        verbs, "simulate", simulate_verb, "simulate a flight, a bench record or a hidden effect with the twin",
        "thrustd simulate --minutes 10 --seed 7 -o out/flight.mcap\n"
        "  thrustd simulate --recording flight.npz --seed 7 -o out/flight.mcap\n"
        "  thrustd simulate --hil deploy/hil.toml --log out/flight.mcap",
    )  # fmt: skip
    parser.add_argument("-o", "--out", type=Path, help="log, record or (with --hide) folder to write")
    parser.add_argument(
        "--seed", type=seed, default=1, help="seed of the random numbers: engines, mounts, sensors, profile (default 1)"
    )
    parser.add_argument(
        "--config", type=configuration_of, help=f"installation to simulate (default: the shipped {HIL})"
    )
    parser.add_argument(
        "--minutes", type=float, help="length of the flight in minutes (default: 10, or all of the recording)"
    )
    made = parser.add_mutually_exclusive_group()
    made.add_argument("--recording", type=Path, help="fly this recording instead of a scripted flight")
    parser.add_argument("--engine-start", action="store_true", help="with --recording: put an engine start in front")
    made.add_argument(
        "--tethered",
        action="store_true",
        help="static run against a load cell, whose record goes beside the log as NAME-cell.csv",
    )
    parser.add_argument(
        "--installation", choices=("plain", "statics", "hostile"), default="plain",
        help="statics: mounts share weight and thrust as a rigid body does; hostile: with errors that no model knows",
    )  # fmt: skip
    parser.add_argument(
        "--knob", action="append", default=[], metavar="NAME=VALUE",
        help="set one error that the models do not know, e.g. drag_m2=0.04, or statics=1; may be repeated",
    )  # fmt: skip
    _add_bench(parser, made)
    _add_wires(parser)
    add_json(parser)


def _add_bench(parser: argparse.ArgumentParser, made: Any) -> None:
    made.add_argument("--bench", choices=BENCH_KINDS, help="make a bench record instead of a flight")
    made.add_argument(
        "--programme", type=Path, metavar="CSV", help="make a bench record of this programme (from plan-test)"
    )
    parser.add_argument("--hours", type=float, default=8.0, help="length of the bench record in hours (default 8)")
    parser.add_argument("--mount", choices=("upper", "lower"), default="upper", help="mount on the bench")
    parser.add_argument(
        "--room", type=float, default=20.0, metavar="DEGC", help="temperature of the bench (default 20)"
    )
    made.add_argument(
        "--hide",
        metavar="EFFECT[,EFFECT]",
        help="make a bench record without these effects, a measured and a held-out record with them",
    )
    parser.add_argument(
        "--strength", type=float, default=3.0, help="size of the hidden effect, as a multiple of the model's error"
    )


def _add_wires(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--hil", type=configuration_of, metavar="CONFIG", help="play in real time on the wires of this configuration"
    )
    parser.add_argument("--log", type=Path, help="with --hil: play this log instead of a new flight")
    parser.add_argument("--speed", type=float, default=1.0, help="with --hil: multiple of real time (default 1)")


def simulate_verb(arguments: argparse.Namespace) -> int:
    if arguments.hil is not None:
        report = _hil(arguments)
    elif arguments.out is None:
        raise UsageError("thrustd simulate: -o is missing; expected the file or folder to write")
    elif arguments.hide is not None:
        report = _hide(arguments)
    elif arguments.bench is not None or arguments.programme is not None:
        report = _bench(arguments)
    else:
        report = _flight(arguments)
    tell(arguments, report, lambda: print(", ".join(f"{key}: {value}" for key, value in report.items())))
    return 0


def _profile(arguments: argparse.Namespace) -> tuple[Any, Any]:
    from thrustd.records.files import read_recording
    from thrustd.twin.flight import recorded_flight, scripted_flight

    knobs, minutes = _knobs(arguments), arguments.minutes
    if minutes is not None and not 0.1 <= minutes <= 6000:
        raise UsageError(f"--minutes {minutes:g}: expected 0.1 to 6000")
    if arguments.recording is not None:
        record = read_recording(arguments.recording)
        if minutes is not None:
            record = record.window(float(record.time_s[0]), float(record.time_s[0]) + 60.0 * minutes)
        return recorded_flight(record, arguments.seed, arguments.engine_start, knobs)
    if arguments.engine_start:
        raise UsageError("--engine-start: expected with --recording; a scripted flight starts its engines itself")
    return scripted_flight(60.0 * (10.0 if minutes is None else minutes), arguments.seed, knobs)


def _knobs(arguments: argparse.Namespace) -> Any:
    """The installation asked for, and every knob that was given on top of it."""
    from thrustd.twin.installation import PLAIN, hostile

    knobs = hostile(arguments.seed) if arguments.installation == "hostile" else PLAIN
    knobs, names = knobs._replace(statics=arguments.installation == "statics"), set()
    for given in arguments.knob:
        name, _, text = given.partition("=")
        names.add(name)
        if name not in knobs._fields:
            raise UsageError(f"--knob {given}: expected NAME=VALUE with a name of {', '.join(knobs._fields)}")
        try:
            values = tuple(float(part) for part in text.split(","))
        except ValueError:
            raise UsageError(f"--knob {given}: expected a number, or several with commas") from None
        if not all(map(isfinite, values)) or (name == "statics" and values not in ((0.0,), (1.0,))):
            raise UsageError(f"--knob {given}: expected {'0 or 1' if name == 'statics' else 'finite numbers'}")
        there = getattr(knobs, name)
        size = len(there) if isinstance(there, tuple) else 1
        if len(values) not in (1, size):
            raise UsageError(f"--knob {given}: {len(values)} numbers, expected {size}")
        whole = values * size if len(values) == 1 else values
        changed: dict[str, Any] = {name: whole if isinstance(there, tuple) else type(there)(whole[0])}
        knobs = knobs._replace(**changed)
    for name, statics in MATTERS:
        if name in names and knobs.statics != statics:
            raise UsageError(f"--knob {name}: does nothing {'without' if statics else 'with'} --knob statics=1")
    return knobs


def _flight(arguments: argparse.Namespace) -> dict[str, Any]:
    gc.disable()  # until the flight begins: all that is loaded stays
    from thrustd.installation.installation import read_installation
    from thrustd.twin.flight import Rates, write_flight

    if arguments.out.suffix != ".mcap":
        raise UsageError(f"{arguments.out}: expected a name that ends in .mcap for a flight log")
    installation = read_installation(given_or_shipped(arguments.config, HIL, "--config"))
    installation.parts()  # its files go into the log: what a replay would refuse is refused now
    profile, airframe = _static_run(arguments) if arguments.tethered else _profile(arguments)
    table = installation.heard()
    rates = Rates(adc_hz=installation.config.adc.sample_hz)
    with progress(f"simulate {profile.name}"), ExitStack() as opened:
        gc.freeze()  # libraries and profile stay: no collection walks them meanwhile
        gc.enable()
        opened.callback(gc.unfreeze)
        write_flight(arguments.out, profile, airframe, table, installation.log_header(), arguments.seed, rates)
    return {"log": str(arguments.out), "minutes": round(profile.duration_s / 60, 2), "profile": profile.name}


def _static_run(arguments: argparse.Namespace) -> tuple[Any, Any]:
    from thrustd.records.files import write_recording
    from thrustd.twin.airframe import draw_airframe
    from thrustd.twin.static_run import static_run

    if arguments.minutes is not None:
        raise UsageError(
            f"--minutes {arguments.minutes:g}: expected without --tethered, whose programme takes 15 minutes"
        )
    airframe = draw_airframe(arguments.seed, _knobs(arguments))
    profile, cell = static_run(arguments.seed, airframe.healths)
    write_recording(cell, arguments.out.with_name(f"{arguments.out.stem}-cell.csv"))
    return profile, airframe


def _bench(arguments: argparse.Namespace) -> dict[str, Any]:
    from thrustd.records.files import read_recording, write_recording
    from thrustd.twin import bench
    from thrustd.twin.mount import LOWER, UPPER

    if not 0.01 <= arguments.hours <= bench.MOST_HOURS:
        raise UsageError(f"--hours {arguments.hours:g}: expected 0.01 to {bench.MOST_HOURS:g}")
    if not -60 <= arguments.room <= 100:
        raise UsageError(f"--room {arguments.room:g}: expected -60 to 100 degC")
    makers: dict[str, Callable[..., Any]] = {
        "steps": bench.step_bench, "sine": bench.sine_bench, "multisine": bench.multisine_bench,
        "weight": bench.weight_bench,
    }  # fmt: skip
    mount = UPPER if arguments.mount == "upper" else LOWER
    rig = bench.RIG._replace(room_degc=arguments.room)
    if arguments.programme is not None:
        record = bench.programme_bench(read_recording(arguments.programme), arguments.seed, mount, rig)
    else:
        record = makers[arguments.bench](arguments.hours, arguments.seed, mount=mount, rig=rig)
    write_recording(record, arguments.out)
    return {"record": str(arguments.out), "samples": len(record), "hours": round(record.duration_s / 3600, 3)}


def _hide(arguments: argparse.Namespace) -> dict[str, Any]:
    from thrustd.twin.hide import hide

    if not 0 < arguments.strength <= 100:
        raise UsageError(f"--strength {arguments.strength:g}: expected 0 to 100")
    hide(tuple(arguments.hide.split(",")), arguments.seed, arguments.strength, arguments.out)
    note(f"{arguments.out}/truth.json is sealed: look only after your own verdict")
    note("an effect is hidden by its size in newtons: its parameters need not be what a mount on PH-LAB has")
    return {"folder": str(arguments.out), "files": "bench.csv measured.csv heldout.csv"}


def _hil(arguments: argparse.Namespace) -> dict[str, Any]:
    from thrustd.installation.installation import read_installation
    from thrustd.sources.mcap_log import LogFile
    from thrustd.sources.paced import at_baud, paced
    from thrustd.twin.hil import Bench

    if not arguments.speed > 0:
        raise UsageError(f"--speed {arguments.speed:g}: expected a number above 0")
    config = read_installation(arguments.hil).config
    if arguments.log is None:
        _profile(arguments)  # what is wrong with it is said before somebody listens
    else:
        LogFile(arguments.log)
    bench = Bench(Path(config.adc.port), config.can.interface, config.can.channel)
    note(f"ADC on {config.adc.port}, CAN on {config.can.interface} {config.can.channel}")
    try:
        bench.wait_for_reader()
        with progress("hardware in the loop") as advance:
            events = paced(_events(arguments, advance), arguments.speed)
            report = bench.play(at_baud(events, config.adc.baud * arguments.speed))
    finally:
        bench.close()
    return {name: getattr(report, name) for name in report.__struct_fields__}


def _events(arguments: argparse.Namespace, advance: Advance) -> Iterator[Any]:
    from thrustd.core.types import Frame, Tick
    from thrustd.sources.mcap_log import LogFile

    if arguments.log is not None:
        log = LogFile(arguments.log)
        for number, event in enumerate(log.events()):
            if number % TELL_EVENTS == 0:  # a bar costs more than the event it counts
                advance(log.position_bytes / max(log.size_bytes, 1))
            yield event
        return
    from thrustd.installation.installation import read_installation
    from thrustd.twin.flight import Rates, fly

    installation = read_installation(arguments.hil)
    profile, airframe = _profile(arguments)
    rates = Rates(adc_hz=installation.config.adc.sample_hz)
    for item in fly(profile, airframe, installation.heard(), arguments.seed, rates):
        if isinstance(item, Frame | Tick):
            advance(max(item.t_ns * 1e-9 - float(profile.time_s[0]), 0.0) / max(profile.duration_s, 1e-9))
            yield item
