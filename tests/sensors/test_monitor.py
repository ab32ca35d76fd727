"""The sensor monitor: each of the five faults on each kind of sensor is named, a healthy flight stays quiet."""

from math import nan

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.core.aircraft import read_aircraft
from thrustd.core.columns import MOUNT_STATE
from thrustd.sensors.monitor import Layout, Monitor, MonitorInputs

CITATION = read_aircraft((ROOT / "deploy" / "citation-ii.toml").read_text(), "citation-ii.toml")
LAYOUT = Layout(("left_upper", "left_lower", "right_upper", "right_lower"), ((0, 1), (2, 3)))
SHARES = (0.5, 0.5)
START_S, END_S = 65.0, 90.0
SENSORS = {  # name -> (cruise value, noise, offset, drift per second, noise of the noisy one)
    ("deformation_mm", 0): (0.4, 2e-5, 0.2, 0.04, 0.1),
    ("deformation_mm", 3): (0.4, 2e-5, 0.2, 0.04, 0.1),
    ("n1_pct", 0): (75.0, 0.03, 8.0, 3.0, 3.0),
    ("n2_pct", 1): (84.0, 0.03, 6.0, 2.0, 3.0),
    ("fuel_flow_kg_s", 0): (0.06, 0.0002, 0.015, 0.006, 0.01),
    ("mach", 0): (0.35, 0.0003, 0.06, 0.05, 0.02),
    ("pressure_altitude_m", 0): (3000.0, 0.7, 150.0, 200.0, 30.0),
    ("sat_degC", 0): (-5.0, 0.08, 6.0, 2.5, 4.0),
    ("tat_degC", 0): (4.0, 0.08, 6.0, 2.5, 4.0),
    ("temperature_degC", 2): (30.0, 0.2, 20.0, 2.0, 10.0),
    ("accel_x_g", 0): (0.05, 0.002, 0.3, 0.3, 0.2),
    ("accel_y_g", 0): (0.0, 0.002, 0.3, 0.3, 0.3),
    ("accel_z_g", 0): (1.0, 0.003, 0.8, 1.0, 0.6),
}
OTHERS = {"pitch_deg": (float(np.degrees(np.arcsin(0.05))), 0.05)}  # value, noise: as the acceleration says
ALL = [*SENSORS, *[sensor for sensor in LAYOUT.sensors() if sensor not in SENSORS]]
SELDOM = ("temperature_degC",)  # read once a second


def spoilt(kind, value, at_stuck, since_s, parts, rng):
    _, _, offset, drift, noise = parts
    return {
        "stuck": at_stuck,
        "noisy": value + noise * rng.normal(),
        "offset": value + offset,
        "drift": value + drift * since_s,
        "dead": nan,
    }[kind]


def fly(sensor=None, kind="", seconds=92.0, seed=0):
    """(t, fault) of the monitor in a straight climb with noise; `sensor` fails from START_S to END_S."""
    rng = np.random.default_rng(seed)
    monitor, found, excluded, held = Monitor(LAYOUT, CITATION, SHARES), [], [], None
    read = {}
    for k in range(round(seconds * 10)):
        t_s, last, read = k / 10, read, {}
        for name in ALL:
            parts = (
                SENSORS.get(name) or OTHERS.get(name[0]) or next(p for key, p in SENSORS.items() if key[0] == name[0])
            )
            value = parts[0] + parts[1] * rng.normal() + (5.0 * t_s if name[0] == "pressure_altitude_m" else 0.0)
            if name == sensor and START_S <= t_s < END_S:
                held = value if held is None else held
                value = spoilt(kind, value, held, t_s - START_S, parts, rng)
            read[name] = last[name] if name[0] in SELDOM and k % 10 and value == value else value
        verdict = monitor.step(monitor_inputs(k, read))
        found += [(t_s, f"{fault.where} {fault.kind}" + " over" * (not fault.active)) for fault in verdict.faults]
        excluded.append(verdict.excluded)
    return found, excluded


def monitor_inputs(k, read):
    mounts = np.zeros(4, MOUNT_STATE)
    for i, mount in enumerate(mounts):
        mount["deformation_mm"] = mm = read["deformation_mm", i]
        mount["force_n"], mount["std_n"] = 3600.0 * mm + 1830.0 * (read["accel_x_g", 0] - 0.05), 50.0
    # plain stand-ins for the deck: right at the cruise point, with its sensitivities
    by_mach = 1.0 - 1.2 * (read["mach", 0] - 0.35)

    def deck_n(engine):
        fuel, n1, n2 = (read[name, engine] for name in ("fuel_flow_kg_s", "n1_pct", "n2_pct"))
        rise = 22.0 * (fuel - 0.06), 0.035 * (n1 - 75.0), 0.07 * (n2 - 84.0)
        said = tuple(n * (1.0 + r) * by_mach for n, r in zip((2900.0, 2850.0, 2950.0), rise, strict=True))
        return *said, 150.0, 4000.0, np.log(0.09)

    return MonitorInputs(
        t_ns=k * 100_000_000,
        readings=np.array([read[sensor] for sensor in LAYOUT.sensors()]),
        mounts=mounts,
        deck_n=np.array((deck_n(0), deck_n(1))),
    )


def test_a_healthy_flight_stays_quiet():
    found, excluded = fly(seconds=120.0)
    assert found == []
    assert not any(excluded)


@pytest.mark.parametrize("kind", ["stuck", "noisy", "offset", "drift", "dead"])
@pytest.mark.parametrize("sensor", list(SENSORS), ids=lambda sensor: f"{sensor[0]}[{sensor[1]}]")
def test_each_fault_is_named_in_time_and_nothing_else(sensor, kind):
    found, excluded = fly(sensor, kind)
    where = LAYOUT.mount_names[sensor[1]] if sensor[0] == "deformation_mm" else f"{sensor[0]}[{sensor[1]}]"
    first_s, first = found[0]
    assert first == f"{where} {kind}"
    # a fuel flow that drifts may lead a throttle that begins to move
    assert first_s - START_S <= {"stuck": 30.0, "drift": 8.0}.get(kind, 5.0)
    assert {word for _, word in found} <= {f"{where} {kind}", f"{where} {kind} over"}
    # mounts that follow a noisy acceleration are no witnesses
    also = set(LAYOUT.sensors()[:4]) if sensor[0] == "accel_x_g" else set()
    assert all(out <= {sensor} | also for out in excluded)


@pytest.mark.parametrize("sensor", [("deformation_mm", 0), ("fuel_flow_kg_s", 1), ("accel_x_g", 0)])
def test_a_sensor_that_was_stuck_and_works_again_is_trusted_again(sensor):
    found, excluded = fly(sensor, "stuck", seconds=130.0)
    assert [word.split()[1:] for _, word in found] == [["stuck"], ["stuck", "over"]]
    assert any(sensor in out for out in excluded) and not excluded[-1]


def test_an_lvdt_that_was_stuck_while_the_throttle_moved_is_trusted_again():
    """It comes back with a jump that the other mount does not make."""
    held_mm, up_mm = 0.4, 0.27  # as the deck has it

    def stuck_through_a_throttle_up(read, since_s):
        risen = np.clip((since_s - 5.0) / 8.0, 0.0, 1.0)
        for engine in range(2):
            read["fuel_flow_kg_s", engine] += 0.03 * risen
            read["n1_pct", engine] += 20.0 * risen
            read["n2_pct", engine] += 10.0 * risen
        for i in range(4):
            read["deformation_mm", i] += up_mm * risen
        if since_s < 30.0:
            read["deformation_mm", 0] = held_mm

    words = [word for since_s, word in reports(stuck_through_a_throttle_up, 160.0) if word.startswith("left_upper")]
    assert words == ["left_upper stuck", "left_upper stuck over"]


@pytest.mark.parametrize("sensor", [("deformation_mm", 0), ("n1_pct", 0), ("n2_pct", 1), ("fuel_flow_kg_s", 0)])
def test_a_sensor_that_scattered_for_a_minute_and_agrees_again_is_trusted_again(sensor):
    """What it said meanwhile, and its jumps, accuse nobody; a mount begins anew before it is weighed."""
    monitor, again = Monitor(LAYOUT, CITATION, SHARES), []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        for k in range(1500):
            read = cruise(k, rng)
            if 600 <= k < 1200:
                read[sensor] *= rng.uniform(-0.5, 2.0)
                if sensor[0] == "deformation_mm" and rng.random() < 0.1:
                    read[sensor] = nan  # out of its range
            verdict = monitor.step(monitor_inputs(1500 * seed + k, read))
            again += verdict.again
        assert not verdict.excluded and not monitor.bank.found.any(), seed
    assert again == [0] * 4 if sensor[0] == "deformation_mm" else not again


def test_spools_that_nobody_can_trust_stop_no_engine():
    rng, monitor = np.random.default_rng(0), Monitor(LAYOUT, CITATION, SHARES)
    for k in range(800):
        read = cruise(k, rng)
        if k >= 650:
            read["n1_pct", 0], read["n2_pct", 0] = rng.uniform(0.0, 30.0, 2) if k > 700 else rng.uniform(25.0, 90.0, 2)
        monitor.step(monitor_inputs(k, read))
    assert monitor.snapshot()["bank"][0]["rows"]


def cruise(k, rng):
    """Readings of a steady cruise at step k of 0.1 s."""
    read = {}
    for name in ALL:
        parts = SENSORS.get(name) or OTHERS.get(name[0]) or next(p for key, p in SENSORS.items() if key[0] == name[0])
        read[name] = parts[0] + parts[1] * rng.normal()
    return read


def reports(change, seconds=80.0, start_s=65.0):
    """(seconds after the start, report) when `change(read, since_s)` spoils the readings from the start on."""
    rng, monitor, found = np.random.default_rng(3), Monitor(LAYOUT, CITATION, SHARES), []
    for k in range(round(seconds * 10)):
        read = cruise(k, rng)
        since_s = k / 10 - start_s
        if since_s >= 0:
            change(read, since_s)
        said = monitor.step(monitor_inputs(k, read)).faults
        found += [(since_s, f"{f.where} {f.kind}" + " over" * (not f.active)) for f in said]
    return found


def test_an_acceleration_that_pitch_and_airspeed_contradict_is_named_though_every_thrust_agrees():
    def off(read, since_s):
        read["accel_x_g", 0] -= 0.002 * min(since_s, 30.0)  # 110 N of an engine's thrust, less than its deck is known

    found = reports(off, 80.0, 20.0)
    assert found and found[0][1].startswith("accel_x_g[0]")
    assert {word.split()[0] for _, word in found} == {"accel_x_g[0]"}


@pytest.mark.parametrize(
    ("name", "size", "within_s"), [("n1_pct", 2.5, 2.0), ("n2_pct", -2.0, 2.0), ("fuel_flow_kg_s", 0.015, 3.0)]
)
def test_a_jump_that_the_engine_does_not_share_is_named(name, size, within_s):
    def jump(read, since_s):
        read[name, 0] += size

    (after_s, word), *others = reports(jump)
    assert word == f"{name}[0] offset" and after_s < within_s
    assert others == []


@pytest.mark.parametrize("spools_follow", [0.0, 0.4])
def test_a_fuel_flow_that_leads_its_spools_or_feeds_bled_air_excludes_nobody(spools_follow):
    """A throttle that is moved by half a per cent of N1 moves the fuel flow at once, the spools within seconds."""

    def push(read, since_s):
        part = spools_follow * min(since_s / 2.0, 1.0)
        read["fuel_flow_kg_s", 0] += 0.004
        read["n1_pct", 0] += part
        read["n2_pct", 0] += part / 2.0

    assert reports(push) == []


def test_a_throttle_that_jumps_is_no_fault():
    def push(read, since_s):
        read["fuel_flow_kg_s", 0] += 0.005
        part = min(since_s / 1.5, 1.0)  # spools and mounts follow
        read["n1_pct", 0] += 3.2 * part
        read["n2_pct", 0] += 1.6 * part
        for mount in (0, 1):
            read["deformation_mm", mount] += 0.044 * part

    assert reports(push) == []


def test_a_spool_that_stands_while_the_engine_accelerates_is_stuck():
    def accelerate(read, since_s):
        rise = min(since_s / 4.0, 1.0)
        read["n1_pct", 0] = 75.0
        read["n2_pct", 0] += 5.0 * rise
        read["fuel_flow_kg_s", 0] += 0.016 * rise
        for mount in (0, 1):
            read["deformation_mm", mount] += 0.14 * rise

    after_s, word = reports(accelerate)[0]
    assert word == "n1_pct[0] stuck" and after_s < 2.0


def test_engine_data_that_freeze_together_leave_the_mounts_of_a_throttle_up_believed():
    """What they said while they rested spoke against the mounts; it is taken back when they are found to be stuck."""
    frozen = {}

    def freeze(read, since_s):
        for name in ("fuel_flow_kg_s", "n1_pct", "n2_pct"):
            read[name, 0] = frozen.setdefault(name, read[name, 0])
        for i in (0, 1):
            read["deformation_mm", i] += 0.4 * min(since_s / 4.0, 1.0)

    words = [word for _, word in reports(freeze)]
    assert {f"{name}[0] stuck" for name in frozen} <= set(words)
    wrongly = [word for word in words if "stuck" not in word]
    assert wrongly == ["mount[left] failed", "mount[left] failed over"]


def test_a_jump_seen_as_two_half_jumps_is_an_offset():
    def jump(read, since_s):
        read["deformation_mm", 0] += 0.1 if since_s < 0.05 else 0.2

    assert [word for _, word in reports(jump)] == ["left_upper offset"]


@pytest.mark.parametrize("sensor", [("accel_x_g", 0), ("mach", 0), ("deformation_mm", 2)])
def test_what_jumps_between_two_looks_is_out_at_once(sensor):
    rng, monitor = np.random.default_rng(5), Monitor(LAYOUT, CITATION, SHARES)
    for k in range(50):
        last = monitor_inputs(k, cruise(k, rng))
        monitor.step(last)
    read = cruise(50, rng)
    read[sensor] += 0.3
    verdict = monitor.step(monitor_inputs(50, read)._replace(t_ns=last.t_ns + 20_000_000))
    assert verdict.excluded == {sensor}
    verdict = monitor.step(monitor_inputs(50, cruise(50, rng)))
    assert not verdict.excluded


@pytest.mark.parametrize(("runs_down_pct", "kept"), [(nan, True), (3.0, False)])
def test_an_engine_that_nobody_hears_has_not_stopped(runs_down_pct, kept):
    monitor, rng = Monitor(LAYOUT, CITATION, SHARES), np.random.default_rng(0)
    for k in range(400):
        read = {}
        for name in ALL:
            parts = SENSORS.get(name) or OTHERS.get(name[0]) or next(p for n, p in SENSORS.items() if n[0] == name[0])
            read[name] = parts[0] + parts[1] * rng.normal()
        if k >= 350:
            for spool in [(name, e) for name in ("n1_pct", "n2_pct") for e in (0, 1)]:
                read[spool] -= min(runs_down_pct * (k - 350), read[spool])
        monitor.step(monitor_inputs(k, read))
    assert [bool(engine["rows"]) for engine in monitor.snapshot()["bank"]] == [kept, kept]
