"""The pipeline as its user sees it: bytes in, estimates out, nothing stops it."""

from math import hypot, isfinite

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.conftest import SCALE_MM, small_aircraft
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import CHANNEL_FAULT
from thrustd.core.types import Estimate, Fault, Frame, MountOutput, Status, Tick
from thrustd.pipeline.pipeline import Pipeline
from thrustd.wire.adc_frames import encode
from thrustd.wire.can_frames import ICD_INPUT_ROWS, CanEncoder
from thrustd.wire.event_batch import EventBatch

S = 1_000_000_000
CRUISE = {"mach": 0.4, "pressure_altitude_m": 3000.0, "sat_degC": -5.0, "accel_x_g": 0.0, "accel_y_g": 0.0,
          "accel_z_g": 1.0}  # fmt: skip
ENGINE = {"n1_pct": 80.0, "n2_pct": 90.0, "fuel_flow_kg_s": 0.075}


def adc(t_ns, sequence, deformation_mm):
    counts = tuple(CHANNEL_FAULT if mm is None else round(mm / SCALE_MM) for mm in deformation_mm)
    return Frame(t_ns, "adc", 0, encode(sequence, sequence * 10_000, counts))


class Bus:
    def __init__(self, installation):
        self._rng = np.random.default_rng(1)
        self._encoder = CanEncoder(installation.can_table(ICD_INPUT_ROWS), 1)

    def frames(self, t_ns, **changes):
        engine = {name: changes.pop(name, value) for name, value in ENGINE.items()}
        values = [(name, 0, value) for name, value in (CRUISE | changes).items()]
        values += [(name, e, value) for name, value in engine.items() for e in range(2)]
        noise = self._rng.normal(0, 1e-4, len(values))
        values = [(name, e, value * (1 + d) + 1e-3 * d) for (name, e, value), d in zip(values, noise, strict=True)]
        for name, index, value in values:
            yield Frame(t_ns, "can", *self._encoder.encode(name, index, value))


WINDMILLING = {"n1_pct": 15.0, "n2_pct": 15.0}  # nobody has a reason to doubt mounts that move as they like


def flight(installation, seconds, deformation_mm=lambda t: (0.3, 0.3, 0.3, 0.3), drop=lambda k: False, **changes):
    """100 Hz ADC, 10 Hz bus, 20 Hz ticks; every sensor has a little noise, as living sensors do."""
    bus, rng = Bus(installation), np.random.default_rng(0)
    for k in range(int(seconds * 100)):
        t_ns = S + k * 10_000_000
        if k % 10 == 0:
            yield from bus.frames(t_ns, **changes)
        if k % 5 == 0:
            yield Tick(t_ns)
        if not drop(k):
            noise_mm = rng.normal(0, 2e-4, 4)
            yield adc(
                t_ns,
                k,
                [None if mm is None else mm + e for mm, e in zip(deformation_mm(k / 100), noise_mm, strict=True)],
            )


def fly(installation, events):
    pipeline = Pipeline(installation.config, PARTS)
    return [output for event in events for output in pipeline.feed(event)]


def of(outputs, noun, **fields):
    return [o for o in outputs if isinstance(o, noun) and all(getattr(o, k) == v for k, v in fields.items())]


def test_a_steady_flight_gives_fifty_estimates_a_second_for_each_engine(aircraft):
    estimates = of(fly(aircraft, flight(aircraft, 10)), Estimate, engine=1)[1:]  # the first is a tick before any sample
    assert len(estimates) == 500
    assert np.diff([e.t_ns for e in estimates]) == pytest.approx(20_000_000)


def test_frames_that_may_wait_complete_nothing_and_a_step_waits_for_none(aircraft):
    steps = msgspec.structs.replace(aircraft.config.steps, estimate_hz=10.0)
    pipeline = Pipeline(msgspec.structs.replace(aircraft.config, steps=steps), PARTS)
    quiet_ns = early = due = 0
    for event in flight(aircraft, 10, drop=lambda k: 300 <= k < 500):
        estimates = of(pipeline.feed(event), Estimate)
        if isinstance(event, Frame):
            assert not (estimates and event.t_ns < quiet_ns)
            early += event.channel == "adc" and event.t_ns < quiet_ns
            due += bool(estimates)
        quiet_ns = pipeline.quiet_until_ns()
    assert due >= 80
    assert early == pytest.approx(0.8 * 800, abs=10)


@pytest.mark.parametrize("estimate_hz, expected_hz", [(10.0, 10.0), (20.0, 20.0), (50.0, 20.0)])
def test_a_silent_adc_costs_no_estimates(aircraft, estimate_hz, expected_hz):
    """Nor does the moment at which it goes, after 5 s. Ticks come at 20 Hz, some of them up to 8 ms late."""
    steps = msgspec.structs.replace(aircraft.config.steps, estimate_hz=estimate_hz)
    pipeline = Pipeline(msgspec.structs.replace(aircraft.config, steps=steps), PARTS)
    late_ns = np.random.default_rng(0).integers(0, 8_000_000, 10_000)
    events = (
        Tick(event.t_ns + late_ns.item(n)) if isinstance(event, Tick) else event
        for n, event in enumerate(flight(aircraft, 15, drop=lambda k: k >= 500))
    )
    times_ns = [o.t_ns for event in events for o in pipeline.feed(event) if isinstance(o, Estimate) and o.engine == 0]
    silent_s = np.array([t_ns for t_ns in times_ns if t_ns >= S + 6 * S]) * 1e-9
    assert len(silent_s) == pytest.approx(9 * expected_hz, abs=2)
    going_s = np.array([t_ns for t_ns in times_ns if t_ns >= S + 4 * S]) * 1e-9
    assert np.max(np.diff(silent_s)) < 2.0 / expected_hz
    assert np.max(np.diff(going_s)) < 2.2 / expected_hz


def test_an_open_channel_shows_on_its_own_engine_only(aircraft):
    for mount, engine in ((0, 0), (1, 0), (2, 1)):
        opened = lambda t, m=mount: tuple(None if i == m and t > 5 else 0.3 for i in range(4))  # noqa: E731
        estimates = of(fly(aircraft, flight(aircraft, 10, opened)), Estimate)
        seen = {e.engine for e in estimates if e.status & Status.CHANNEL_OPEN}
        assert seen == {engine}


def test_a_signal_that_goes_stale_shows_on_its_own_engine_only(aircraft):
    left_n1 = next(frame.ident for frame in Bus(aircraft).frames(0) if frame.ident == 500)
    events = (e for e in flight(aircraft, 12) if not (isinstance(e, Frame) and e.ident == left_n1 and e.t_ns > 6 * S))
    outputs = fly(aircraft, events)
    assert {e.engine for e in of(outputs, Estimate) if e.status & Status.SIGNAL_STALE} == {0}
    assert [f.where for f in of(outputs, Fault, kind="stale")] == ["n1_pct[0]"]


def spread(events):
    """Every message at its own time in the period of the bus, as nodes send that do not know each other."""
    idents, out = [], []
    for event in events:
        if isinstance(event, Frame) and event.channel == "can":
            idents += [event.ident] * (event.ident not in idents)
            event = event._replace(t_ns=event.t_ns + idents.index(event.ident) * 8_000_000)
        out.append(event)
    return sorted(out, key=lambda event: event.t_ns)


@pytest.mark.parametrize("wire, after_ms", [("adc", 0), *[("can", ms) for ms in range(3, 100, 16)]])
def test_a_wire_that_goes_is_said_once_and_not_each_of_its_signals(aircraft, wire, after_ms):
    first_ns = 6 * S + after_ms * 1_000_000
    gone = lambda e: isinstance(e, Frame) and e.channel == wire and first_ns < e.t_ns < first_ns + 6 * S  # noqa: E731
    outputs = fly(aircraft, (e for e in spread(flight(aircraft, 20)) if not gone(e)))
    faults = [f for f in of(outputs, Fault) if f.t_ns > 6 * S]
    silent = [(f.where, f.active) for f in faults if f.kind == "silent"]
    assert silent == [(wire, True), (wire, False)]
    assert faults[0].kind == "silent"
    assert faults[0].t_ns < first_ns + 0.5 * S
    assert [f for f in faults if f.kind in ("stale", "dead")] == []
    assert len(faults) <= 6, faults
    if wire == "can":
        [lost] = [f for f in faults if f.kind == "lost"]
        assert (lost.where, lost.count) == ("can", 60 * 12)
    away = [e for e in of(outputs, Estimate) if first_ns + 0.6 * S < e.t_ns < first_ns + 5.9 * S]
    shown = [bool(e.status & Status.LINK_LOST) for e in away]
    assert shown
    assert all(shown)
    assert not any(e.status & Status.LINK_LOST for e in of(outputs, Estimate) if e.t_ns > first_ns + 8 * S)


def test_a_bus_that_repeats_every_message_is_one_trouble(aircraft):
    repeats = lambda e: isinstance(e, Frame) and e.channel == "can"  # noqa: E731
    outputs = fly(aircraft, (e for event in flight(aircraft, 5) for e in [event] * (1 + repeats(event))))
    troubles = [f for f in of(outputs, Fault) if f.where.startswith("can")]
    assert {(f.where, f.kind) for f in troubles} == {("can", "late")}
    assert sum(f.count for f in troubles) > 400


def test_a_signal_that_stays_away_when_its_wire_is_back_is_said_then(aircraft):
    def gone(e):
        return isinstance(e, Frame) and e.channel == "can" and 6 * S < e.t_ns < (99 if e.ident == 500 else 8) * S

    outputs = fly(aircraft, (e for e in flight(aircraft, 20) if not gone(e)))
    stale = of(outputs, Fault, kind="stale")
    assert [(f.where, f.active) for f in stale] == [("n1_pct[0]", True)]
    assert 10 * S < stale[0].t_ns < 12 * S


def test_engine_thrust_is_the_sum_of_its_mounts(aircraft):
    outputs = fly(aircraft, flight(aircraft, 30, lambda t: (0.2, 0.3, 0.25, 0.25)))
    left = of(outputs, Estimate, engine=0)[-1]
    forces = [of(outputs, MountOutput, mount=m)[-1].force_n for m in (0, 1)]
    assert left.mount_n == pytest.approx(sum(forces), rel=1e-3)
    assert forces == pytest.approx([0.2 * 5079, 0.3 * 5079], abs=5)


def test_the_mounts_carry_thrust_minus_inertia(aircraft):
    still = of(fly(aircraft, flight(aircraft, 5)), Estimate, engine=0)[-1]
    climbing = of(fly(aircraft, flight(aircraft, 5, accel_x_g=0.1)), Estimate, engine=0)[-1]
    assert climbing.mount_n - still.mount_n == pytest.approx(373 * 9.80665 * 0.1, abs=5)


def test_short_gaps_are_stepped_through(aircraft):
    ramp = lambda t: (0.2 + 0.01 * t,) * 4  # noqa: E731
    whole = fly(aircraft, flight(aircraft, 20, ramp))
    holed = fly(aircraft, flight(aircraft, 20, ramp, drop=lambda k: 1000 <= k < 1040))
    assert of(holed, Fault, kind="lost")[0].count == 40
    assert any(e.status & Status.GAP for e in of(holed, Estimate))
    end = [of(outputs, MountOutput, mount=0)[-1].force_n for outputs in (whole, holed)]
    assert end[1] == pytest.approx(end[0], abs=2)


@pytest.mark.parametrize("slow", [-0.05, -0.03, 0.003, 0.01, 0.05])
def test_a_crystal_that_is_off_by_more_than_half_a_per_cent_is_named_and_no_sensor_is(aircraft, slow):
    late = lambda event: event.channel == "adc" if isinstance(event, Frame) else False  # noqa: E731
    events = [event._replace(t_ns=S + round((event.t_ns - S) * (1 + slow))) if late(event) else event
              for event in flight(aircraft, 40, **WINDMILLING)]  # fmt: skip
    outputs = fly(aircraft, sorted((event for event in events if event.t_ns < 39 * S), key=lambda event: event.t_ns))
    said = [(fault.where, fault.kind) for fault in of(outputs, Fault) if fault.active]
    assert said == ([("adc_clock", "rate")] if abs(slow) > 0.005 else [])


@pytest.mark.parametrize("slow", [-0.3, -0.08, 0.08, 0.3])
def test_a_crystal_that_is_too_far_off_to_be_followed_is_named_too(aircraft, slow):
    late = lambda event: event.channel == "adc" if isinstance(event, Frame) else False  # noqa: E731
    events = [event._replace(t_ns=S + round((event.t_ns - S) * (1 + slow))) if late(event) else event
              for event in flight(aircraft, 40, **WINDMILLING)]  # fmt: skip
    end_s = 40 * (1 + min(slow, 0.0)) - 1
    outputs = fly(aircraft, sorted((event for event in events if event.t_ns < end_s * S), key=lambda event: event.t_ns))
    said = {(fault.where, fault.kind) for fault in of(outputs, Fault) if fault.active}
    assert ("adc_clock", "rate") in said
    assert said <= {("adc_clock", "rate"), ("adc", "silent")}  # no sensor


def test_long_gaps_restart_the_linear_block_and_widen_the_band(aircraft):
    two_levels = lambda t: (0.2 if t < 20 else 0.6,) * 4  # noqa: E731
    outputs = of(
        fly(aircraft, flight(aircraft, 60, two_levels, drop=lambda k: 1900 <= k < 3100, **WINDMILLING)),
        MountOutput,
        mount=0,
    )
    before = [o.std_n for o in outputs if o.t_ns < S + 19 * S][-1]
    after = next(o.std_n for o in outputs if o.t_ns > S + 31.1 * S and isfinite(o.force_n))
    end = outputs[-1].std_n
    tau_s = np.array([0.5, 30.0])
    r = 6.0 / tau_s  # the load came 6 s ago on average
    left = np.sqrt(1 / np.sqrt(1 + 4 * r) - 1 / (1 + 2 * r))
    slow_n = 0.05 * 0.4 * 5079 * np.sum(left * np.exp(-0.1 / tau_s))  # modes of gain 0.05, from 0.2 to 0.6 mm
    assert after**2 - before**2 == pytest.approx(slow_n**2, rel=0.25)
    assert before < end < after


def test_gaps_of_seconds_are_stepped_through_and_widen_the_band(aircraft):
    two_levels = lambda t: (0.2 if t < 20 else 0.6,) * 4  # noqa: E731
    whole, holed = (
        of(fly(aircraft, flight(aircraft, 40, two_levels, drop=drop, **WINDMILLING)), MountOutput, mount=0)
        for drop in (lambda k: False, lambda k: 1900 <= k < 2300)
    )
    first = next(o for o in holed if o.t_ns > S + 23.1 * S and isfinite(o.force_n))
    unbroken = min(whole, key=lambda o: abs(o.t_ns - first.t_ns))
    assert first.std_n > unbroken.std_n
    assert abs(first.force_n - unbroken.force_n) < 2 * first.std_n


def test_ticks_keep_estimates_coming_when_the_adc_is_silent(aircraft):
    outputs = fly(aircraft, flight(aircraft, 30, drop=lambda k: k >= 1000))
    late = [e for e in of(outputs, Estimate, engine=0) if e.t_ns > S + 15 * S]
    assert len(late) > 200
    assert all(e.status & Status.MOUNT_LOST and isfinite(e.thrust_n) for e in late)


def test_a_marked_channel_leaves_the_engine_on_one_mount(aircraft):
    outputs = fly(aircraft, flight(aircraft, 20, lambda t: (0.3, None if t > 10 else 0.3, 0.3, 0.3)))
    assert of(outputs, Fault, kind="open")
    last = of(outputs, Estimate, engine=0)[-1]
    assert last.status & Status.ONE_MOUNT
    assert last.mount_n == pytest.approx(2 * 0.3 * 5079, rel=0.02)


def test_missing_accelerations_are_said_and_paid_for_in_the_band(aircraft):
    def without(events):
        return (e for e in events if not (isinstance(e, Frame) and e.channel == "can" and 300 <= e.ident <= 302))

    full = of(fly(aircraft, flight(aircraft, 5)), Estimate, engine=0)[-1]
    blind = of(fly(aircraft, without(flight(aircraft, 5))), Estimate, engine=0)[-1]
    assert blind.status & Status.LOAD_FACTOR_STALE
    assert not full.status & Status.LOAD_FACTOR_STALE
    assert blind.mount_std_n > full.mount_std_n + 100


def test_the_same_events_give_the_same_outputs_bit_for_bit(aircraft):
    events = list(flight(aircraft, 10, lambda t: (0.3 + 0.1 * np.sin(t),) * 4))
    assert repr(fly(aircraft, events)) == repr(fly(aircraft, events))


def test_a_warm_restart_continues_where_it_was(aircraft):
    events = list(flight(aircraft, 60, lambda t: (0.2 if t < 10 else 0.5,) * 4))
    half = len(events) // 2
    first = aircraft.pipeline()
    for event in events[:half]:
        first.feed(event)
    warm = aircraft.pipeline()
    assert warm.restore(first.snapshot())
    whole = [o for e in events[half:] for o in first.feed(e)]
    resumed = [o for e in events[half:] for o in warm.feed(e)]
    a, b = of(whole, MountOutput, mount=0)[-1], of(resumed, MountOutput, mount=0)[-1]
    assert b.force_n == pytest.approx(a.force_n, rel=1e-3)


ANYTHING = st.lists(
    st.one_of(
        st.builds(Frame, st.integers(0, 2**62), st.just("adc"), st.just(0), st.binary(max_size=60)),
        st.builds(Frame, st.integers(0, 2**62), st.just("can"), st.integers(0, 2047), st.binary(max_size=12)),
        st.builds(Tick, st.integers(0, 2**62)),
        st.builds(Fault, st.integers(0, 2**62), st.just("adc"), st.just("unplugged")),
    ),
    max_size=40,
)


@settings(max_examples=60, deadline=None)
@given(ANYTHING)
def test_nothing_that_arrives_stops_the_pipeline(events):
    pipeline = Pipeline(AIRCRAFT.config, PARTS)
    for event in events:
        pipeline.feed(event)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 900), ANYTHING), max_size=6), st.lists(st.integers(1, 200), max_size=20))
def test_outputs_do_not_depend_on_how_events_are_batched(damage, cuts):
    """A flight with gaps, an open channel, values out of range and anything at all in between."""
    deformation_mm = lambda t: (0.3 + 0.1 * np.sin(t), None if 2 < t < 3 else 0.3, 9.0 if 4 < t < 4.1 else 0.3, 0.3)  # noqa: E731
    events = list(flight(AIRCRAFT, 6, deformation_mm, drop=lambda k: 100 <= k < 140 or k == 300))
    events.insert(700, Frame(events[700].t_ns, "can", 302, bytes((1, 2, 0, 0, 0x42, 0xC8, 0, 0))))  # 100 g
    for at, anything in damage:
        events[at:at] = anything
    one_by_one = fly(AIRCRAFT, events)
    pipeline, outputs, at = Pipeline(AIRCRAFT.config, PARTS), [], 0
    for cut in [*cuts, len(events)]:
        outputs += pipeline.take(EventBatch.of(events[at : at + cut]))
        at += cut
    assert repr(outputs) == repr(one_by_one)


AIRCRAFT = small_aircraft()
PARTS = AIRCRAFT.parts()


def test_a_flight_that_begins_in_mid_air_has_its_whole_band_from_the_first_second(aircraft):
    """Before its past is long enough to be weighed, drag and scale of the installation are as unknown as after."""
    known = aircraft.parts().aircraft.installation
    cruise = {"mach": 0.4, "pressure_altitude_m": 3000.0}
    (first, *_) = (e for e in of(fly(aircraft, flight(aircraft, 3, **cruise)), Estimate) if e.t_ns > 2 * S)
    pressure_pa = dynamic_pressure_pa(*cruise.values())
    assert first.thrust_std_n > hypot(known.zero_n, known.drag_m2 * pressure_pa) > 1.5 * known.zero_n
