"""`thrustd brochure fit`: the spool curves of an engine come back from steady flight, and wear is a re-fit."""

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.brochure.deck import Deck, total_ratios
from thrustd.brochure.deck_data import hermite
from thrustd.brochure.fit.deck_fit import brochure_fit, rms_left_out_pct
from thrustd.core.errors import RecordingError
from thrustd.records.files import read_recording, write_recording
from thrustd.records.recording import make_recording

PATH = ROOT / "models" / "brochure" / "jt15d-4.json"
DECK = Deck.from_json(PATH.read_text(), PATH.name).data
PLATEAU_S = 80


def flight(path, seed, worn=1.0):
    """Plateaus of N1 from 50 to 98 %; fuel flow as the shipped curves say, `worn` times as much on the left."""
    rng = np.random.default_rng(seed)
    levels = np.column_stack([rng.permutation(np.linspace(50, 98, 14)), rng.uniform(0.2, 0.45, 14)])
    n1, mach = np.repeat(levels, PLATEAU_S, axis=0).T
    altitude = np.full(len(n1), 1000.0 + 1000.0 * seed)
    sat = 15.0 - 0.0065 * altitude
    columns = {"time_s": np.arange(len(n1), dtype=float), "mach": mach, "pressure_altitude_m": altitude}
    columns["sat_degC"] = sat
    ratios = np.array([total_ratios(*row) for row in zip(mach, altitude, sat, strict=True)])
    for curve, side, factor in zip(DECK.n1, ("left", "right"), (worn, 1.0), strict=True):
        log_flow = [
            hermite(curve, n / np.sqrt(theta)) + curve.mach_slope * m + curve.temperature_exponent * np.log(theta)
            for n, m, (_, theta) in zip(n1, mach, ratios, strict=True)
        ]
        columns[f"n1_pct_{side}"] = n1
        columns[f"fuel_flow_kg_s_{side}"] = factor * np.exp(log_flow) * ratios[:, 0] * np.sqrt(ratios[:, 1])
    write_recording(make_recording(path.stem, columns), path)
    return path


def fitted(folder, worn=1.0):
    return brochure_fit([flight(folder / f"flight{seed}.csv", seed, worn) for seed in (1, 2, 3)], DECK)


def test_the_curves_come_back_and_flights_left_out_are_met(tmp_path):
    fit = fitted(tmp_path)
    assert len(fit.left_out) == 6  # three flights, two engines
    assert max(fit.left_out.values()) < 0.04
    for old, new in zip(DECK.n1, fit.data.n1, strict=True):
        assert hermite(new, 80.0) == pytest.approx(hermite(old, 80.0), abs=0.1)


def test_the_table_ends_with_the_rms_over_flights_left_out(tmp_path):
    fit = fitted(tmp_path)
    for engine, name in enumerate(("left", "right")):
        mine = [error for (e, _), error in fit.left_out.items() if e == engine]
        rms_pct = 100 * float(np.sqrt(np.mean(np.square(mine))))
        assert rms_left_out_pct(fit)[name] == {"n1": pytest.approx(rms_pct, abs=1e-3)}


def test_a_worn_engine_is_a_re_fit_of_its_own_curve(tmp_path):
    (tmp_path / "worn").mkdir()
    new, worn = fitted(tmp_path), fitted(tmp_path / "worn", worn=1.05)
    left, right = (hermite(worn.data.n1[e], 80.0) - hermite(new.data.n1[e], 80.0) for e in (0, 1))
    assert left == pytest.approx(np.log(1.05), abs=0.01)
    assert right == pytest.approx(0.0, abs=0.01)


def test_one_flight_cannot_be_left_out(tmp_path):
    with pytest.raises(RecordingError, match="at least 2 flights"):
        brochure_fit([tmp_path / "one.csv"], DECK)


def changed(path, **columns):
    """The flight with columns replaced, or taken away where they are None."""
    record = read_recording(path)
    kept = {**record.channels, **columns}
    kept = {name: column for name, column in kept.items() if column is not None}
    write_recording(make_recording(path.stem, {"time_s": record.time_s, **kept}), path)
    return path


def test_n2_is_a_cross_check_only_where_two_flights_have_it(tmp_path):
    paths = [flight(tmp_path / f"flight{seed}.csv", seed) for seed in (1, 2, 3)]
    n1 = read_recording(paths[0])["n1_pct_left"]
    missing, n2 = np.full(len(n1), np.nan), {"n2_pct_left": 50 + 0.45 * n1, "n2_pct_right": 50 + 0.45 * n1}
    changed(paths[0], n2_pct_left=missing, n2_pct_right=missing)
    changed(paths[1], **n2)
    fit = brochure_fit(paths, DECK)
    assert (len(fit.left_out), fit.left_out_n2, fit.data.n2) == (6, {}, ())
    assert fit.remarks == ("N2 in fewer than two flights: no cross-check by N2 for left, right",)
    n1 = read_recording(paths[2])["n1_pct_left"]
    changed(paths[2], n2_pct_left=50 + 0.45 * n1)
    fit = brochure_fit(paths, DECK)
    assert [curve.engine for curve in fit.data.n2] == [0]
    assert set(fit.left_out_n2) == {(0, "flight2.csv"), (0, "flight3.csv")}
    assert fit.remarks == ("N2 in fewer than two flights: no cross-check by N2 for right",)


def test_an_engine_without_fuel_flow_is_left_out_of_that_flight(tmp_path):
    paths = [flight(tmp_path / f"flight{seed}.csv", seed) for seed in (1, 2, 3)]
    nothing = np.full(len(read_recording(paths[0])), np.nan)
    changed(paths[0], fuel_flow_kg_s_left=nothing)
    fit = brochure_fit(paths, DECK)
    assert {(0, "flight2.csv"), (0, "flight3.csv"), (1, "flight1.csv")} < set(fit.left_out)
    assert (0, "flight1.csv") not in fit.left_out
    assert "flight1.csv: left out: no numbers in fuel_flow_kg_s_left" in fit.remarks
    changed(paths[0], fuel_flow_kg_s_left=None, fuel_flow_kg_s_right=None)
    with pytest.raises(RecordingError, match=r"flight1.csv: no numbers in fuel_flow_kg_s_left; .*_right"):
        brochure_fit(paths, DECK)
