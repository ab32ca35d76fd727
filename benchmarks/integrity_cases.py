"""The campaign's cases: which fault begins at which moment, how long it is watched."""

from typing import NamedTuple

import numpy as np

from benchmarks.integrity_edits import (
    BOTH_ENGINES,
    HOSTILE,
    LEFT,
    Edit,
    Speaking,
    clock,
    common_ground,
    crosstalk,
    drift,
    gain,
    on_the_ground,
    order,
    says,
    slow_gain,
    step,
    stuck,
    swap,
    together,
)
from thrustd.core.columns import Floats

UPPER, LOWER = (0,), (1,)
FOR_GOOD_S = 600.0
RPM_PCT = 159.04  # N1 in 1/min of one per cent


class Case(NamedTuple):
    fault: str
    moment: str
    edit: Edit
    who: tuple[str, ...]  # where a report names it; empty: nothing on board has to
    seconds: float = 180.0
    short: bool = False  # it is in the short form
    kinds: frozenset[str] = frozenset()  # or what a report says
    bits: int = 0  # of the status that have to say so; 0: any that tells


L2 = ("left_upper", "left_lower", "mount[left]")
ANY = (*L2, "right_upper", "right_lower", "mount[right]", "accel_x_g[0]")
FUEL, N1L = ("fuel_flow_kg_s[0]", "brochure[left]"), ("n1_pct[0]", "brochure[left]")
ACC = ("accel_x_g[0]",)
PITCH = ("pitch_deg[0]", *ACC)
FUEL_FLOW_0 = ("fuel_flow_kg_s", 0)
ON_GROUND = "on the ground, sane in the air"


def _at(
    moments: str, fault: str, edit: Edit, who: tuple[str, ...], seconds: float = 180.0, short: str = ""
) -> list[Case]:
    places = [moment.strip() for moment in moments.split(",")]
    return [Case(fault, moment, edit, who, seconds, moment == short) for moment in places]


def _accel(change: Speaking) -> Edit:
    return says("accel_x_g", 0, change)


def _fuel(change: Speaking) -> Edit:
    return says(*FUEL_FLOW_0, change)


def _n1(change: Speaking) -> Edit:
    return says("n1_pct", 0, change)


def _less(_: Floats, values: Floats) -> Floats:
    return 0.8 * values


def _frozen(_: Floats, values: Floats) -> Floats:
    return np.full_like(values, values[0])


CASES: tuple[Case, ...] = (
    # both mounts of an engine
    *_at("ground idle", "both LVDTs of an engine drift +0.02 mm/min", drift(LEFT, 0.02), L2, FOR_GOOD_S, "ground idle"),
    *_at("take-off roll, cruise", "both LVDTs of an engine drift +0.02 mm/min", drift(LEFT, 0.02), L2, 420.0),
    *_at("cruise, throttle up", "both LVDTs of an engine drift -0.02 mm/min", drift(LEFT, -0.02), L2, 420.0),
    *_at("started", "both step +0.1 mm", step(LEFT, 0.1), L2, FOR_GOOD_S),
    *_at("ground idle, cruise, throttle up, flight idle", "both step +0.1 mm", step(LEFT, 0.1), L2, 180.0, "cruise"),
    *_at("take-off roll, cruise", "both step -0.1 mm", step(LEFT, -0.1), L2),
    *_at("take-off roll, cruise, throttle up", "both step +0.03 mm", step(LEFT, 0.03), L2),  # while the throttle moves
    *_at("take-off roll, cruise, throttle up", "both step +0.06 mm", step(LEFT, 0.06), L2),
    *_at("cruise, flight idle", "both stuck, 1 um noise", stuck(LEFT, 0.001), L2, 240.0, "cruise"),
    *_at("take-off roll, cruise, throttle up", "both halve", gain(LEFT, 0.5), L2, 180.0, "cruise"),
    *_at("take-off roll, cruise, throttle up", "both -10 %", gain(LEFT, 0.9), L2),
    *_at("take-off roll, cruise", "both -10 % within 5 min", slow_gain(LEFT, -0.02), L2, 420.0),
    *_at("ground idle, cruise", "both turn their sign", gain(LEFT, -1.0), L2),
    # one of them
    *_at("started, ground idle", "one LVDT drifts +0.02 mm/min", drift(UPPER, 0.02), L2, FOR_GOOD_S),
    *_at("cruise, flight idle", "one LVDT drifts +0.02 mm/min", drift(UPPER, 0.02), L2, 420.0, "cruise"),
    *_at("take-off roll, cruise", "one LVDT drifts -0.02 mm/min", drift(LOWER, -0.02), L2, 420.0),
    *_at("started, ground idle", "one LVDT +0.1 mm", step(UPPER, 0.1), L2, FOR_GOOD_S, "ground idle"),
    *_at("take-off roll, cruise, throttle up, flight idle", "one LVDT +0.1 mm", step(UPPER, 0.1), L2),
    *_at("ground idle, cruise", "one LVDT -0.1 mm", step(LOWER, -0.1), L2, 300.0),
    *_at("ground idle, cruise", "one LVDT stuck, 1 um noise", stuck(UPPER, 0.001), L2, 300.0),
    *_at("take-off roll, cruise", "one LVDT halves", gain(UPPER, 0.5), L2),
    *_at("take-off roll, cruise", "one LVDT -10 %", gain(LOWER, 0.9), L2),
    *_at("cruise", "one LVDT turns its sign", gain(UPPER, -1.0), L2),
    *_at("take-off roll, cruise", "LVDTs of an engine swapped", order((1, 0, 2, 3)), (), 180.0),
    *_at("started, cruise", "LVDTs of the engines swapped", order((2, 3, 0, 1)), (), FOR_GOOD_S),
    # what all mounts share
    *_at("take-off roll, cruise", "accel_x turns its sign", _accel(lambda _, g: -g), ACC, 300.0, "cruise"),
    *_at("ground idle, cruise, flight idle", "accel_x +0.05 g", _accel(lambda _, g: g + 0.05), ACC, 300.0, "cruise"),
    *_at("ground idle, cruise, flight idle", "accel_x -0.05 g", _accel(lambda _, g: g - 0.05), ACC, 300.0),
    *_at("cruise", "accel_x drifts 0.02 g/min", _accel(lambda s, g: g + 0.02 * s / 60.0), ACC, 300.0),
    *_at("take-off roll", "accel_x halves", _accel(lambda _, g: 0.5 * g), ACC),
    *_at("cruise", "pitch +3 deg", says("pitch_deg", 0, lambda _, deg: deg + 3.0), PITCH),
    # brochure
    *_at("started", f"fuel flow x 1.5 {ON_GROUND}", on_the_ground(FUEL_FLOW_0, 1.5), FUEL, FOR_GOOD_S, "started"),
    *_at("started", f"fuel flow x 0.6 {ON_GROUND}", on_the_ground(FUEL_FLOW_0, 0.6), FUEL, FOR_GOOD_S),
    *_at("ground idle, cruise", "fuel flow x 0.8", _fuel(lambda _, v: 0.8 * v), FUEL),
    *_at("cruise", "fuel flow x 1.2", _fuel(lambda _, v: 1.2 * v), FUEL),
    *_at("cruise", "fuel flow drifts 5 %/min", _fuel(lambda s, v: v * (1 + 0.05 * s / 60)), FUEL, 300.0),
    *_at("take-off roll, cruise", "N1 +3 %", _n1(lambda _, v: v + 3.0 * RPM_PCT), N1L),
    *_at("take-off roll, throttle up", "N1 freezes", _n1(_frozen), N1L),
    *_at("cruise", "N1 drifts 2 %/min", _n1(lambda s, v: v + 2.0 * RPM_PCT * s / 60.0), N1L, 300.0),
    *_at("ground idle", "N1 swapped", swap(("n1_pct", 0), ("n1_pct", 1)), (), 300.0),
    *_at("ground idle", "fuel flow swapped", swap(("fuel_flow_kg_s", 0), ("fuel_flow_kg_s", 1)), (), 300.0),
    *_at("ground idle, take-off roll", "Mach freezes", says("mach", 0, _frozen), ("mach[0]",), 240.0),
    *_at("cruise", "Mach drifts 0.03/min", says("mach", 0, lambda s, v: v + 0.03 * s / 60.0), (), 300.0),
    *_at("cruise", "Mach +0.05", says("mach", 0, lambda _, v: v + 0.05), ("mach[0]",)),
    *_at("cruise", "SAT +10 K", says("sat_degC", 0, lambda _, v: v + 10.0), ("sat_degC[0]",)),
    # the ADC's clock
    *_at("begin", "ADC clock 1 % slow", clock(0.01), ("adc_clock",), FOR_GOOD_S),
    *_at("ground idle, cruise", "ADC clock 1 % slow", clock(0.01), ("adc_clock",), 180.0, "cruise"),
    *_at("cruise", "ADC clock 3 % fast", clock(-0.03), ("adc_clock",)),
    *_at("cruise", "ADC clock 0.3 % slow", clock(0.003), ()),
    # two engines at once
    *_at("ground idle, cruise", "all four LVDTs +0.05 mm", step(BOTH_ENGINES, 0.05), ANY, 240.0),
    *_at("take-off roll, cruise", "all four LVDTs -0.1 mm", step(BOTH_ENGINES, -0.1), ANY, 240.0),
    *_at("cruise, throttle up", "all four LVDTs halve", gain(BOTH_ENGINES, 0.5), ANY),
    *_at("take-off roll, cruise", "all four LVDTs -10 %", gain(BOTH_ENGINES, 0.9), ANY, 240.0),
    *_at("begin", "crosstalk of 15 % between the engines", crosstalk(0.15), ANY, FOR_GOOD_S),
    *_at("ground idle, cruise", "crosstalk of 10 % between the engines", crosstalk(0.1), ANY, 240.0),
    *_at("ground idle, cruise", "crosstalk of 15 % between the engines", crosstalk(0.15), ANY, 240.0),
    *_at("begin", "all four LVDTs show 5 % of their sum", common_ground(BOTH_ENGINES, 0.05), ANY, FOR_GOOD_S),
    *_at("ground idle, cruise", "all four LVDTs show 2 % of their sum", common_ground(BOTH_ENGINES, 0.02), ANY, 240.0),
    *_at("ground idle, cruise", "all four LVDTs show 5 % of their sum", common_ground(BOTH_ENGINES, 0.05), ANY, 240.0),
    *_at("ground idle, cruise", "both LVDTs of an engine show 5 % of their sum", common_ground(LEFT, 0.05), L2, 240.0),
    *_at("cruise", "all four LVDTs drift +0.02 mm/min", drift(BOTH_ENGINES, 0.02), ANY, 420.0),
    *_at("cruise", "fuel flow of both engines x 0.8", together(_fuel(_less), says("fuel_flow_kg_s", 1, _less)), FUEL),
)  # fmt: skip
HEALTHY = Case("healthy", "begin", Edit(), (), 1e9, True)
AIRCRAFT = tuple(Case(f"hostile: {name}", "begin", edit, (), 1e9) for name, edit in HOSTILE.items())
assert len({(case.fault, case.moment) for case in CASES}) == len(CASES) >= 60 and np.isfinite(FOR_GOOD_S)
