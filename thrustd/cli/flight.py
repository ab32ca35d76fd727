"""Verbs of a flight: run, replay, check."""

import argparse
import gc
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thrustd.cli.verb import Verbs, add_json, add_verb, console, file_type, note, print_json, progress, tell
from thrustd.core.errors import UsageError, printable
from thrustd.installation.folder import configuration_of

if TYPE_CHECKING:
    from thrustd.core.aircraft import AircraftData, Cant
    from thrustd.core.statics import Carried, Left
    from thrustd.installation.installation import Installation

LONGEST_LIVE_S = 3600.0


def add_verbs(verbs: Verbs) -> None:
    _add_run(verbs)
    _add_replay(verbs)
    _add_check(verbs)


def _add_run(verbs: Verbs) -> None:
    run = add_verb(verbs, "run", run_verb, "fly: read the sensors, estimate, record", "thrustd run deploy/ph-lab.toml")
    run.add_argument("config", type=configuration_of, help="configuration of the aircraft (TOML)")
    _add_trust(run)
    run.add_argument(
        "--log-folder", type=Path, metavar="FOLDER", help="record here instead of the configuration's folder"
    )


def _add_replay(verbs: Verbs) -> None:
    replay = add_verb(
        verbs, "replay", replay_verb, "run a recorded flight through the same pipeline",
        "thrustd replay replay_logs/throttle-steps.mcap -o out/replayed.mcap --picture out/flight.png",
    )  # fmt: skip
    replay.add_argument(
        "log",
        type=Path,
        nargs="+",
        help="flight log; for a whole run its folder, its first file or all its files",
    )
    replay.add_argument("-o", "--out", type=file_type(".mcap"), help="estimate log to write (MCAP)")
    replay.add_argument("--config", type=configuration_of, help="use this configuration instead of the log's own")
    replay.add_argument("--speed", type=float, help="multiple of real time (default: as fast as possible)")
    replay.add_argument("--smooth", type=Path, metavar="CSV", help="write the smoothed thrust of every step (CSV)")
    replay.add_argument(
        "--salvage", action="store_true", help="replay the intact parts of a damaged log and report what is lost"
    )
    replay.add_argument("--picture", type=Path, metavar="PNG", help="picture of thrust, band and error over time")
    add_json(replay)


def _add_check(verbs: Verbs) -> None:
    check = add_verb(
        verbs, "check", check_verb, "check a configuration and every file it names", "thrustd check deploy/ph-lab.toml"
    )
    check.add_argument("config", type=configuration_of, help="configuration of the aircraft (TOML)")
    _add_trust(check)
    check.add_argument(
        "--live",
        type=float,
        metavar="SECONDS",
        help="listen to the serial port and the bus this long, then report sensors that contradict each other",
    )
    check.add_argument("--manifest", action="store_true", help="print only what has to be signed")
    add_json(check)


def _add_trust(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--trust",
        type=Path,
        metavar="KEY",
        help="refuse a configuration whose CONFIG.sig was not made with this public key (PEM)",
    )


def _overdue(installation: "Installation") -> list[str]:
    """That the zeros were to be measured before today."""
    calibration, today = installation.calibration(), str(datetime.now(UTC).date())
    if calibration is None or calibration.recalibrate_by is None or calibration.recalibrate_by > today:
        return []
    name = installation.config.calibration
    return [
        f"{name}: recalibrate by {calibration.recalibrate_by}, and it is {today}: thrustd zero says which mount walks"
    ]


def _far(installation: "Installation") -> list[str]:
    """Gains that somebody wrote, for no tethered run would have."""
    from thrustd.commission.tether_file import gains_too_far

    known, name = installation.calibration(), installation.config.calibration
    gains = {mount: one.gain for mount, one in known.mount.items() if one.gain != 1.0} if known is not None else {}
    return [f"{name}: {said}, which `calibrate tether` would refuse" for said in gains_too_far(gains)]


def _hangs(aircraft: "AircraftData") -> dict[str, Any]:
    """What the mounts carry, what a front one does when the other is lost, how they lean."""
    from thrustd.core.statics import carried, left_over

    statics = carried(aircraft)
    fronts = [each.mount for each in statics if each.thrust_share]
    lost = [one for one in left_over(aircraft) if one.lost in fronts]
    flown = {name: aircraft.share(place) for place, name in enumerate(fronts)}
    return {"statics": statics, "flown": flown, "lost": lost, "cant": aircraft.cant}


def _print_hangs(
    statics: "list[Carried]", flown: "dict[str, float]", lost: "list[Left]", cant: "dict[str, Cant]"
) -> None:
    from thrustd.core.measures import SIGMAS_95

    for each in (each for each in statics if each.thrust_share):
        one_g = f"{each.weight_n:+.0f} +- {SIGMAS_95 * each.weight_std_n:.0f} N at 1 g"
        share = flown[each.mount]
        flies = "" if share == each.thrust_share else f"; {100 * share:.0f} % flies, without weight: rigid_body = false"
        print(f"{each.mount} mount by rigid-body statics: {100 * each.thrust_share:.0f} % of thrust, {one_g}{flies}")
    for one in lost:
        held = f"{one.lost} mount lost: {one.mount} carries {100 * one.thrust_share:.0f} % of thrust; no mount holds"
        print(f"{held} {one.thrust_turns_m:.2f} N m per N of it and {one.weight_turns_nm:.0f} N m of the weight")
    for mount, leans in cant.items():
        print(f"{mount}: leans {leans.deg:+.2f} +- {SIGMAS_95 * leans.std_deg:.2f} deg (95 %), nose up")


def check_verb(arguments: argparse.Namespace) -> int:
    from thrustd.installation.installation import read_installation
    from thrustd.installation.shipped import own_or_shipped
    from thrustd.installation.signature import manifest
    from thrustd.sources.can_bus import CanBus
    from thrustd.sources.merge import EventQueue
    from thrustd.sources.serial_port import SerialPort

    installation = read_installation(own_or_shipped(arguments.config, "config"), arguments.trust)
    installation.pipeline()
    if arguments.manifest:
        sys.stdout.write(manifest(installation.hashes()).decode())
        return 0
    warnings = [*installation.uncorrected(), *_overdue(installation), *_far(installation)]
    can, adc, queue = installation.config.can, installation.config.adc, EventQueue()
    where = f"{installation.where}: can"
    CanBus(can.interface, can.channel, can.bitrate, queue.put, where=where)  # names are judged, nothing is opened
    SerialPort(adc.port, adc.baud, queue.put)
    hashes, hangs = installation.hashes(), _hangs(installation.aircraft())
    found = _listen(arguments, installation) if arguments.live is not None else []
    if arguments.json:
        said = {**hangs, "sha256": hashes, "warnings": warnings, "findings": found}
        print_json({"config": str(arguments.config), "ok": not found, **said})
        return int(bool(found))
    for name, digest in hashes.items():
        print(f"{digest[:16]}  {printable(name)}")
    for line in warnings:
        print(f"warning: {line}")
    _print_hangs(**hangs)
    for line in found:
        print(f"degraded: {line}")
    if found:
        print(f"{arguments.config}: not ready: {len(found)} found in {arguments.live:g} s")
        return 1
    heard = "" if arguments.live is not None else "; whether port, bus and disk are there shows when it runs"
    print(f"{arguments.config}: ready to fly{heard}")
    return 0


def _listen(arguments: argparse.Namespace, installation: "Installation") -> list[str]:
    from thrustd.onboard.one_process import only_one
    from thrustd.onboard.preflight import findings, hear, needed

    if not 0.0 < arguments.live <= LONGEST_LIVE_S:
        raise UsageError(f"--live {arguments.live:g}: expected seconds above 0, {LONGEST_LIVE_S:g} at most")
    with only_one(arguments.config):
        engines = installation.config.aircraft.engines
        heard, wanted = hear(installation, arguments.live), needed(installation)
        return findings(heard, engines, wanted, installation.deck())


def replay_verb(arguments: argparse.Namespace) -> int:
    gc.disable()  # until the flight begins: all that is loaded stays
    from thrustd.installation.installation import read_installation
    from thrustd.replay.picture import FlightPicture
    from thrustd.replay.replay import replay
    from thrustd.replay.summary_table import largest_n, print_summary
    from thrustd.sources.log_run import LogRun, run_paths
    from thrustd.sources.paced import paced

    if arguments.speed is not None and not arguments.speed > 0:
        raise UsageError(f"--speed {arguments.speed}: expected a number above 0")
    config = read_installation(arguments.config) if arguments.config else None
    picture = FlightPicture() if arguments.picture else None
    paths = run_paths(arguments.log[0]) if len(arguments.log) == 1 else arguments.log
    log = LogRun(paths, arguments.salvage)
    if len(paths) > 1:
        note(f"{len(paths)} files of one run, {paths[0].name} to {paths[-1].name}")
    with progress(f"replay {paths[0].name}") as advance:
        summary = replay(
            log,
            arguments.out,
            config,
            pace=(lambda events: paced(events, arguments.speed)) if arguments.speed else None,
            advance=advance,
            picture=picture,
            smoothed=arguments.smooth,
        )
    if picture is not None:
        picture.save(arguments.picture, f"{summary.log}: {summary.length_s / 60:.1f} min", largest_n(summary))
        note(f"picture: {arguments.picture}")
    if summary.damage:
        note(f"thrustd: {summary.damage}")
    tell(arguments, summary, lambda: print_summary(summary, console()))
    return 0


def run_verb(arguments: argparse.Namespace) -> int:
    gc.disable()  # until READY: everything that is loaded stays, and a start in flight has no time to lose
    from thrustd.installation.installation import read_installation
    from thrustd.onboard.daemon import fly
    from thrustd.onboard.one_process import only_one

    with only_one(arguments.config):
        return fly(read_installation(arguments.config, arguments.trust), arguments.config.parent, arguments.log_folder)
