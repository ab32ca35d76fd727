"""Before a flight: what the sensors say of each other on the ground, heard for some seconds on the real wires.

    always       nothing that was reported goes on or comes again and again; what an estimate needs was heard;
                 every engine has its mounts, and its brochure when it runs
    Mach < 0.05  f_x = sin theta,  f_z = cos theta,  TAT = SAT
    N1 < 5 %     that engine burns no fuel, and N2 < 10 %
    N2 < 10 %    the same of N1 < 5 %
    running      fuel flow, N1 and N2 of each and of one engine against the other: `like_engines`

Medians over what was heard: on three recordings of PH-LAB f_x and sin theta of an aircraft slower than Mach 0.05 differ
by at most 0.013 g in nine of ten stretches of 20 s, by 0.04 g at most downwards, and by up to 0.19 g upwards, as in a
take-off roll. While an engine runs the bank of hypotheses weighs its sensors as in flight.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import cos, isfinite, nan, radians, sin
from statistics import median
from threading import Event as Flag

from thrustd.brochure.deck import Deck
from thrustd.core.faults import FAULT_KINDS, UNTIL_OVER
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Estimate, Fault, Output, Reading, Status
from thrustd.installation.installation import Installation
from thrustd.onboard.like_engines import Heard, running_engines
from thrustd.sensors.monitor_inputs import ENGINE_SIGNALS, Sensor
from thrustd.sources.can_bus import CanBus
from thrustd.sources.merge import EventQueue, merged
from thrustd.sources.serial_port import SerialPort
from thrustd.sources.ticker import Ticker
from thrustd.wire.event_batch import EventBatch

STANDING_MACH, OFF_N1_PCT, OFF_N2_PCT = 0.05, 5.0, 10.0
ACCELERATION_G = 0.05  # five times what an accelerometer and a pitch are mounted to
STAGNATION_K, IDLE_FUEL_KG_S = 3.0, 0.01
ONCE = ("zero_refused",)  # said once, and true for the flight
AGAIN = 3  # reports of one trouble, a second apart at least: the first bytes of a wire are often cut
BITS = Status.MOUNT_LOST | Status.MOUNT_FAILED | Status.BROCHURE_FAILED | Status.DISAGREE
NEEDED = (*ENGINE_SIGNALS, "mach", "pressure_altitude_m", "sat_degC", "tat_degC", "accel_x_g", "accel_z_g", "pitch_deg")


def hear(installation: Installation, seconds: float) -> Iterator[Output]:
    """Outputs of the pipeline on the wires of this installation; nothing is recorded or sent."""
    config, queue, stop = installation.config, EventQueue(), Flag()
    pipeline, can = installation.pipeline(), config.can
    bus = CanBus(can.interface, can.channel, can.bitrate, queue.put, where=f"{installation.where}: can")
    adc = SerialPort(config.adc.port, config.adc.baud, queue.put)
    begin_ns = -1
    for events in merged(queue, (adc, bus, Ticker(config.steps.tick_hz, queue.put)), stop):
        begin_ns = events[0].t_ns if begin_ns < 0 else begin_ns
        yield from pipeline.take(EventBatch.of(events))
        if events[-1].t_ns - begin_ns > seconds * 1e9:
            stop.set()


def needed(installation: Installation) -> list[Sensor]:
    """What the bus of this aircraft has to bring, of what its table knows."""
    config, parts = installation.config, installation.parts()
    there = {"aircraft": 1, "engine": len(config.aircraft.engines), "mount": len(config.mount)}
    wanted = {*NEEDED, *(channel for model in parts.models for channel in model.channels)}
    fields = [field for message in parts.can_table.messages.values() for field in message.fields]
    return [(f.signal, f.index) for f in fields if f.signal in wanted and f.index < there[CATALOGUE[f.signal].scope]]


def findings(
    outputs: Iterable[Output],
    engines: Sequence[str],
    needed: Iterable[Sensor] = (),
    deck: Deck | None = None,
) -> list[str]:
    """What speaks against a flight, a line each; none: ready. `needed`: see there. No deck: no engine is compared."""
    heard: defaultdict[Sensor, list[float]] = defaultdict(list)
    reports: Counter[tuple[str, str]] = Counter()
    last: dict[int, Estimate] = {}
    for output in outputs:
        if isinstance(output, Reading):
            heard[output.signal, output.index].append(output.value)
        elif isinstance(output, Estimate):
            last[output.engine] = output
        elif isinstance(output, Fault) and not output.active:
            reports.pop((output.where, output.kind), None)
        elif isinstance(output, Fault) and output.kind != "zero":
            reports[output.where, output.kind] += 1
    found = [f"{where}: {kind}: {FAULT_KINDS[kind].meaning}" for (where, kind), times in reports.items()
             if FAULT_KINDS[kind].shows_s == UNTIL_OVER or kind in ONCE or times >= AGAIN]  # fmt: skip
    silent = [f"{signal}[{index}]" for signal, index in needed if (signal, index) not in heard]
    if heard and silent:  # else the wire is said
        found.append(f"{', '.join(silent)}: no reading")
    for number, name in enumerate(engines):
        found += [f"{name}: {word}" for word in _troubles(last.get(number))]
    medians = _medians(heard)
    found += on_ground(medians.middle, len(engines))
    if deck is not None and _stands(medians.middle):
        found += running_engines(medians, deck, engines)
    return found


def _medians(heard: Mapping[Sensor, Sequence[float]]) -> Heard:
    begin = {sensor: median(values[: (len(values) + 1) // 2]) for sensor, values in heard.items()}
    end = {sensor: median(values[len(values) // 2 :]) for sensor, values in heard.items()}
    return Heard({sensor: median(values) for sensor, values in heard.items()}, begin, end)


def _stands(middle: Mapping[Sensor, float]) -> bool:
    """Or taxis."""
    return middle.get(("mach", 0), nan) < STANDING_MACH


def _troubles(last: Estimate | None) -> list[str]:
    """What the last estimate of an engine says against it, in words."""
    if last is None:
        return ["no estimate"]
    asked = BITS if last.status & Status.ENGINE_OFF else BITS | Status.BROCHURE_LOST
    return [str(bit.name).lower().replace("_", " ") for bit in Status(last.status) & asked]


def on_ground(middle: Mapping[Sensor, float], engines: int) -> list[str]:
    """Of an aircraft that stands or taxis, and of engines that are off there. `middle`: medians of the readings."""

    def value(signal: str, index: int = 0) -> float:
        return middle.get((signal, index), nan)

    if not _stands(middle):
        return []
    pitch = radians(value("pitch_deg"))
    asked = [
        ("accel_x_g", value("accel_x_g") - sin(pitch), ACCELERATION_G, "g, against sin pitch"),
        ("accel_z_g", value("accel_z_g") - cos(pitch), ACCELERATION_G, "g, against cos pitch"),
        ("tat_degC", value("tat_degC") - value("sat_degC"), STAGNATION_K, "K, against SAT of an aircraft that stands"),
    ]
    for e in range(engines):
        if value("n1_pct", e) < OFF_N1_PCT:
            asked += [
                (f"fuel_flow_kg_s[{e}]", value("fuel_flow_kg_s", e), IDLE_FUEL_KG_S, "kg/s, of an engine that is off"),
                (f"n2_pct[{e}]", value("n2_pct", e), OFF_N2_PCT, "%, of an engine whose N1 is off"),
            ]
        elif value("n2_pct", e) < OFF_N2_PCT:
            asked.append((f"n1_pct[{e}]", value("n1_pct", e), OFF_N1_PCT, "%, of an engine whose N2 is off"))
    return [
        f"{name}: off by {off:.3g} {of}, expected within {limit:g}"
        for name, off, limit, of in asked
        if isfinite(off) and abs(off) > limit
    ]
